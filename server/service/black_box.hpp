// The black box: what was being flown at the instant the server went down. A mapped file keeps what was
// stored in it when the process is killed or crashes, so a store per slice is all that it costs.
#pragma once

#include <atomic>
#include <cstddef>
#include <filesystem>
#include <vector>

#include "idl/wire/id.hpp"

namespace slew::service {

class BlackBox {
 public:
  /// Reads what the last server left, then starts anew. Throws std::runtime_error.
  explicit BlackBox(const std::filesystem::path& file);
  ~BlackBox();
  BlackBox(const BlackBox&) = delete;
  BlackBox& operator=(const BlackBox&) = delete;

  /// Being flown when the last server went down.
  const std::vector<wire::Id>& suspects() const { return suspects_; }

  /// A place for a thread that flies; the box must outlive it.
  class Seat {
   public:
    void take(const wire::Id& experiment) const { *id_ = experiment; }
    void leave() const { *id_ = {}; }

   private:
    friend class BlackBox;
    explicit Seat(wire::Id* id) : id_(id) {}
    wire::Id* id_;
  };
  Seat seat();

 private:
  static constexpr std::size_t kSeats = 512;
  wire::Id* seats_ = nullptr;
  std::atomic<std::size_t> given_{0};
  std::vector<wire::Id> suspects_;
};

}  // namespace slew::service

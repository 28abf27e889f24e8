// The series of finished experiments, one HDF5 file each: written beside, made durable, then renamed, so that
// a file under its final name is whole.
#pragma once

#include <filesystem>
#include <optional>

#include "idl/wire/id.hpp"
#include "server/series/series_file.hpp"
#include "server/service/sample_store.hpp"

namespace slew::service {

/// Safe to use from several threads.
class Archive {
 public:
  /// Makes the directory and removes what an interrupted write left. Throws std::runtime_error.
  explicit Archive(std::filesystem::path directory);

  /// Durable when it returns. Throws std::runtime_error, e.g. when the disk is full.
  void write(const wire::Id& experiment, const ChannelTable& channels, const SampleStore& samples) const;

  /// Empty when there is no such file. Throws std::invalid_argument for an unknown channel and
  /// std::runtime_error for a damaged file.
  std::optional<Series> read(const wire::Id& experiment, const SeriesSelection& selection) const;

  void remove(const wire::Id& experiment) const;
  /// Removes the oldest until the rest takes at most so much of the disk; how many it removed.
  std::size_t trim(std::uintmax_t most_bytes) const;
  std::filesystem::path path(const wire::Id& experiment) const;

 private:
  std::filesystem::path directory_;
};

}  // namespace slew::service

// Who may fly paced: as many as the pacers can keep on time, by what each was measured to cost.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "server/service/flight.hpp"

namespace slew::service {

/// Safe to use from several threads. A load is a share of one processor.
class Admission {
 public:
  explicit Admission(std::size_t pacers);

  /// What a paced experiment will need: a trial of a millisecond, and what every slice costs besides.
  static double trial_load(const Prepared& prepared);

  /// Why so much more load is too much, in figures; empty when it fits.
  std::optional<std::string> refusal(double more) const;
  /// It counts from now until its end.
  void admit(const FlightPointer& flight);

  double load() const;
  /// What may be promised: limits().max_paced_load of the processors that pacers can use.
  double capacity() const { return capacity_; }

 private:
  const double capacity_;
  mutable std::mutex mutex_;
  mutable std::vector<std::weak_ptr<Flight>> admitted_;
};

}  // namespace slew::service

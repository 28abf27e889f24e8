#include "server/service/registry.hpp"

namespace slew::service {

void Registry::add(const FlightPointer& flight) {
  const std::lock_guard lock(mutex_);
  by_experiment_.emplace(flight->entry().experiment_id, flight);
  by_request_.emplace(flight->entry().request_id, flight);
}

void Registry::remove(const FlightPointer& flight) {
  const std::lock_guard lock(mutex_);
  by_experiment_.erase(flight->entry().experiment_id);
  by_request_.erase(flight->entry().request_id);
}

void Registry::ended(const FlightPointer& flight) {
  const std::lock_guard lock(mutex_);
  ended_.push_back({flight, Monotonic::now()});
}

std::vector<FlightPointer> Registry::take_expired(std::size_t keep, Monotonic::duration age) {
  const std::lock_guard lock(mutex_);
  std::vector<FlightPointer> expired;
  const auto oldest = Monotonic::now() - age;
  while (!ended_.empty() && (ended_.size() > keep || ended_.front().at < oldest)) {
    FlightPointer flight = std::move(ended_.front().flight);
    ended_.pop_front();
    by_experiment_.erase(flight->entry().experiment_id);
    by_request_.erase(flight->entry().request_id);
    expired.push_back(std::move(flight));
  }
  return expired;
}

FlightPointer Registry::by_experiment(const wire::Id& id) const {
  const std::lock_guard lock(mutex_);
  const auto place = by_experiment_.find(id);
  return place == by_experiment_.end() ? nullptr : place->second;
}

FlightPointer Registry::by_request(const wire::Id& id) const {
  const std::lock_guard lock(mutex_);
  const auto place = by_request_.find(id);
  return place == by_request_.end() ? nullptr : place->second;
}

std::vector<FlightPointer> Registry::page(std::optional<wire::Phase> phase, std::size_t limit,
                                          std::size_t offset, std::size_t& total) const {
  const std::lock_guard lock(mutex_);
  std::vector<FlightPointer> found;
  total = 0;
  for (auto place = by_experiment_.rbegin(); place != by_experiment_.rend(); ++place) {
    const wire::Phase now = place->second->phase();
    if (phase ? now != *phase : now == slew_v1_RECEIVED) continue;
    if (total++ >= offset && found.size() < limit) found.push_back(place->second);
  }
  return found;
}

std::vector<FlightPointer> Registry::alive() const {
  const std::lock_guard lock(mutex_);
  std::vector<FlightPointer> found;
  for (const auto& [id, flight] : by_experiment_)
    if (const wire::Phase phase = flight->phase(); phase != slew_v1_RECEIVED && !wire::is_terminal(phase))
      found.push_back(flight);
  return found;
}

std::size_t Registry::alive_count() const {
  const std::lock_guard lock(mutex_);
  return by_experiment_.size() - ended_.size();
}

}  // namespace slew::service

#include "server/sensor/attitude_sensor.hpp"

#include <algorithm>
#include <cmath>

#include "server/attitude/small_rotation.hpp"

namespace slew {
namespace {

std::array<RandomStream, 3> axes(std::uint64_t seed, RandomUse use) {
  return {RandomStream(seed, use, 0), RandomStream(seed, use, 1), RandomStream(seed, use, 2)};
}

Eigen::Vector3d quantised(const Eigen::Vector3d& value, double quantum) {
  return quantum * (value / quantum).array().round().matrix();
}

// Rounding a rotation vector must not carry it past the whole turn, where the parameters end.
constexpr double kLongest_rad = 6.283185;

Eigen::Vector3d quantised_mrp(const Eigen::Vector3d& mrp, double quantum_rad) {
  Eigen::Vector3d theta = quantised(rotation_vector(mrp), quantum_rad);
  const double angle = theta.norm();
  if (angle > kLongest_rad) theta *= kLongest_rad / angle;
  return mrp_of_rotation_vector(theta);
}

}  // namespace

AttitudeSensor::AttitudeSensor(const AttitudeSensorParameters& parameters, std::uint64_t seed)
    : parameters_(parameters),
      is_ideal_(parameters.is_ideal()),
      angle_noise_(axes(seed, RandomUse::angle_noise)),
      rate_noise_(axes(seed, RandomUse::rate_noise)) {}

AttitudeReading AttitudeSensor::read(const Eigen::Vector3d& mrp, const Eigen::Vector3d& rate_rad_s) {
  if (is_ideal_) return {mrp, rate_rad_s};
  const bool is_first = readings_ == 0;
  if (samples_of_reading_ == 0) present_ = take(mrp, rate_rad_s);
  if (++samples_of_reading_ >= parameters_.laws_samples_per_reading) samples_of_reading_ = 0;

  const auto delay = static_cast<std::size_t>(parameters_.delay_samples);
  if (delay == 0) return present_;
  if (is_first) std::fill_n(on_their_way_.begin(), delay, present_);
  AttitudeReading arrived = on_their_way_[place_];
  on_their_way_[place_] = present_;
  place_ = (place_ + 1) % delay;
  return arrived;
}

AttitudeReading AttitudeSensor::take(const Eigen::Vector3d& mrp, const Eigen::Vector3d& rate_rad_s) {
  const std::uint64_t counter = readings_++;
  AttitudeReading reading{mrp, rate_rad_s};

  Eigen::Vector3d error_rad = parameters_.angle_bias_rad;
  if (parameters_.angle_noise_rad > 0)
    error_rad += parameters_.angle_noise_rad * noise(angle_noise_, counter);
  if (!error_rad.isZero(0)) reading.mrp = turned_further(mrp, mrp_of_rotation_vector(error_rad));
  if (parameters_.angle_quantum_rad > 0)
    reading.mrp = quantised_mrp(reading.mrp, parameters_.angle_quantum_rad);

  reading.rate_rad_s += parameters_.rate_bias_rad_s;
  if (parameters_.rate_noise_rad_s > 0)
    reading.rate_rad_s += parameters_.rate_noise_rad_s * noise(rate_noise_, counter);
  if (parameters_.rate_quantum_rad_s > 0)
    reading.rate_rad_s = quantised(reading.rate_rad_s, parameters_.rate_quantum_rad_s);
  return reading;
}

Eigen::Vector3d AttitudeSensor::noise(const std::array<RandomStream, 3>& axes, std::uint64_t counter) {
  return {axes[0].normal(counter), axes[1].normal(counter), axes[2].normal(counter)};
}

}  // namespace slew

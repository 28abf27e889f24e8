// What a law sees of attitude and rate: biased, noisy, quantised, sampled, late. Ideal where all is zero.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>

#include "server/random/random_stream.hpp"

namespace slew {

inline constexpr int kMaxSensorDelaySamples = 64;

struct AttitudeSensorParameters {
  Eigen::Vector3d angle_bias_rad = Eigen::Vector3d::Zero();  ///< a small rotation, body axes
  Eigen::Vector3d rate_bias_rad_s = Eigen::Vector3d::Zero();
  double angle_noise_rad = 0;   ///< standard deviation about each axis, of each reading
  double rate_noise_rad_s = 0;  ///< the same of the rate
  double angle_quantum_rad = 0, rate_quantum_rad_s = 0;
  int laws_samples_per_reading = 1;  ///< the law samples so often before there is a new reading
  int delay_samples = 0;             ///< a reading reaches the law so many of its samples later; at most 64

  bool is_ideal() const {
    return angle_bias_rad.isZero(0) && rate_bias_rad_s.isZero(0) && angle_noise_rad == 0 &&
           rate_noise_rad_s == 0 && angle_quantum_rad == 0 && rate_quantum_rad_s == 0 &&
           laws_samples_per_reading == 1 && delay_samples == 0;
  }
};

struct AttitudeReading {
  Eigen::Vector3d mrp = Eigen::Vector3d::Zero();
  Eigen::Vector3d rate_rad_s = Eigen::Vector3d::Zero();
};

/// Its state is a fixed number of readings on their way. A copy goes on as the original would have.
class AttitudeSensor {
 public:
  /// Expects parameters within their bounds.
  AttitudeSensor(const AttitudeSensorParameters& parameters, std::uint64_t seed);

  /// What the law has at its next sample: to be called once for every sample, in order, with the true
  /// attitude and rate (rad/s). Until the first reading has come through the delay it is given early.
  /// A reading is on the same side of |p| = 1 as the truth is but for its error: it never jumps to the
  /// shadow.
  AttitudeReading read(const Eigen::Vector3d& mrp, const Eigen::Vector3d& rate_rad_s);

 private:
  AttitudeReading take(const Eigen::Vector3d& mrp, const Eigen::Vector3d& rate_rad_s);
  static Eigen::Vector3d noise(const std::array<RandomStream, 3>& axes, std::uint64_t counter);

  AttitudeSensorParameters parameters_;
  bool is_ideal_;
  std::array<RandomStream, 3> angle_noise_, rate_noise_;
  std::uint64_t readings_ = 0;
  int samples_of_reading_ = 0;  ///< that the law has had of the present one
  AttitudeReading present_;
  std::array<AttitudeReading, kMaxSensorDelaySamples> on_their_way_;
  std::size_t place_ = 0;  ///< of the oldest, which the next one replaces
};

}  // namespace slew

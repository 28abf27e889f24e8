// What a law sees of attitude and rate: biased, noisy, quantised, sampled, late. Ideal where all is zero.
#pragma once

#include <Eigen/Core>

namespace slew {

struct AttitudeSensorParameters {
  Eigen::Vector3d angle_bias_rad = Eigen::Vector3d::Zero();  ///< a small rotation, body axes
  Eigen::Vector3d rate_bias_rad_s = Eigen::Vector3d::Zero();
  double angle_noise_rad = 0;   ///< standard deviation about each axis, of each reading
  double rate_noise_rad_s = 0;  ///< the same of the rate
  double angle_quantum_rad = 0, rate_quantum_rad_s = 0;
  int laws_samples_per_reading = 1;  ///< the law samples so often before there is a new reading
  int delay_samples = 0;             ///< a reading reaches the law so many of its samples later

  bool is_ideal() const {
    return angle_bias_rad.isZero(0) && rate_bias_rad_s.isZero(0) && angle_noise_rad == 0 &&
           rate_noise_rad_s == 0 && angle_quantum_rad == 0 && rate_quantum_rad_s == 0 &&
           laws_samples_per_reading == 1 && delay_samples == 0;
  }
};

}  // namespace slew
#include <cstdint>
namespace slew {
struct AttitudeReading {
  Eigen::Vector3d mrp, rate_rad_s;
};
class AttitudeSensor {
 public:
  AttitudeSensor(const AttitudeSensorParameters&, std::uint64_t) {}
  AttitudeReading read(const Eigen::Vector3d& p, const Eigen::Vector3d& w) { return {p, w}; }
};
}  // namespace slew

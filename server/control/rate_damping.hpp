// Rate damping, u = -D w: stops a tumbling body, in whatever attitude.
#pragma once

#include "server/control/attitude_sight.hpp"

namespace slew {

struct RateDamping : AttitudeLawTraits {
  static constexpr const char* kType = "rate_damping";

  Eigen::Vector3d damping_N_m_s = Eigen::Vector3d::Ones();  ///< the diagonal of D

  template <typename Fields>
  void fields(Fields& fields) {
    fields("damping_N_m_s", damping_N_m_s);
  }

  template <typename Scalar>
  AttitudeCommand<Scalar> command(const AttitudeSight<Scalar>& sight) const {
    AttitudeCommand<Scalar> command;
    command.torque_N_m = -damping_N_m_s.cwiseProduct(sight.rate_rad_s);
    return command;
  }
};

}  // namespace slew

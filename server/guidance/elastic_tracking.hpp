// The elastic motion that a slew is allowed to have (Sung, Lee & Kim 2001, Eqs. 16 and 17): the lowest free
// modes, driven by the tangential force of the commanded acceleration alone,
//   x_d'' + 2 zeta w x_d' + w^2 x_d = -mu b theta'',   b the first rows of T^-1 A_e.
// Table 1 prints A_e as an identity, which a scalar theta'' and an arbitrary basis forbid: it is the
// tangential load, A_e = [M^-1 (0; fa)]_f.
#pragma once

#include "server/structure/reduction.hpp"

namespace slew {

/// What the hub is to do meanwhile: what it would do by itself at zero momentum, or stand still.
enum class RigidReference { natural, zero };

struct ElasticTracking {
  Eigen::VectorXd frequency_rad_s, damping_ratio;  ///< of the modes that are tracked
  Eigen::VectorXd input;                           ///< mu b
  Eigen::MatrixXd shapes;                          ///< z_d = shapes x_d, all of z's rows

  Eigen::Index modes() const { return frequency_rad_s.size(); }
  /// x_d'' of x_d, x_d' and theta''.
  template <typename X, typename Rate>
  auto acceleration(const X& x, const Rate& rate, double slew_rad_s2) const {
    return -(2 * damping_ratio.array() * frequency_rad_s.array() * rate.array() +
             frequency_rad_s.array().square() * x.array() + input.array() * slew_rad_s2);
  }
};

/// The lowest `modes` of them, at most as many as there are. `scale` is mu.
ElasticTracking elastic_tracking(const ReducedStructure& structure, double alpha_1_s, double beta_s,
                                 Eigen::Index modes, double scale, RigidReference rigid);

}  // namespace slew

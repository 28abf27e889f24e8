// References p_d(t): their derivatives, and where the third one jumps.
#include "server/control/mrp_trajectory.hpp"

#include <gtest/gtest.h>

namespace {

using namespace slew;
using Eigen::Vector3d;

void expect_derivatives(const MrpTrajectory& trajectory, double t) {
  const double dt = 1e-4;
  const MrpReference<double> before = trajectory.at(t - dt), at = trajectory.at(t),
                             after = trajectory.at(t + dt);
  EXPECT_LE(((after.mrp - before.mrp) / (2 * dt) - at.rate_1_s).norm(), 1e-7) << t;
  EXPECT_LE(((after.rate_1_s - before.rate_1_s) / (2 * dt) - at.acceleration_1_s2).norm(), 1e-7) << t;
}

TEST(MrpTrajectory, NoneIsTheFinalAttitude) {
  const MrpTrajectory trajectory;
  EXPECT_TRUE(trajectory.is_fixed());
  EXPECT_EQ(trajectory.next_change_s(0), std::numeric_limits<double>::infinity());
  EXPECT_TRUE(trajectory.at(3).mrp.isZero(0));
  EXPECT_TRUE(trajectory.at(3).rate_1_s.isZero(0));
  EXPECT_TRUE(trajectory.at(3).acceleration_1_s2.isZero(0));
}

TEST(MrpTrajectory, Sinusoids) {
  const MrpTrajectory trajectory{MrpSinusoids{{.3, -.2, .1}, {.5, .8, 1.1}, {.1, 1.2, -.7}}};
  EXPECT_FALSE(trajectory.is_fixed());
  EXPECT_EQ(trajectory.next_change_s(0), std::numeric_limits<double>::infinity());
  EXPECT_DOUBLE_EQ(trajectory.at(2).mrp[1], -.2 * std::sin(2.8));
  for (double t = 0; t < 10; t += .37) expect_derivatives(trajectory, t);
}

TEST(MrpTrajectory, EigenaxisRotationIsFromRestToRest) {
  const Vector3d axis = Vector3d(1, 2, 2) / 3;
  const MrpTrajectory trajectory{EigenaxisRotation{axis, 2.5, -.5, 3, 8}};
  EXPECT_FALSE(trajectory.is_fixed());
  for (double t : {0., 3., 11., 20.}) {
    const double angle = t < 5 ? 2.5 : -.5;
    const MrpReference<double> rest = trajectory.at(t);
    EXPECT_LE((rest.mrp - std::tan(angle / 4) * axis).norm(), 1e-15);
    EXPECT_TRUE(rest.rate_1_s.isZero(0));
    EXPECT_TRUE(rest.acceleration_1_s2.isZero(0));
  }
  EXPECT_LE((trajectory.at(7).mrp - std::tan(.25) * axis).norm(), 1e-15);  // half way
  for (double t = .1; t < 13; t += .37) expect_derivatives(trajectory, t);
  for (double corner : {3., 11.}) {
    EXPECT_LE(
        (trajectory.at(corner + 1e-6).acceleration_1_s2 - trajectory.at(corner - 1e-6).acceleration_1_s2)
            .norm(),
        1e-6);
    EXPECT_EQ(trajectory.next_change_s(std::nextafter(corner, 0.)), corner);
  }
  EXPECT_EQ(trajectory.next_change_s(3), 11);
  EXPECT_EQ(trajectory.next_change_s(11), std::numeric_limits<double>::infinity());
}

// The body that follows p_d turns with theta' about the axis.
TEST(MrpTrajectory, EigenaxisRotationTurnsWithTheRateOfItsAngle) {
  const Vector3d axis = Vector3d(1, 2, 2) / 3;
  const MrpTrajectory trajectory{EigenaxisRotation{axis, 2, 0, 0, 4}};
  const MrpReference<double> half_way = trajectory.at(2);
  EXPECT_LE((rate_of_mrp_rate(half_way.mrp, half_way.rate_1_s) + 2 * 1.875 / 4 * axis).norm(), 1e-14);
}

}  // namespace

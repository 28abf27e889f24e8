// The arm of Agrawal & Bang 1995, clamped, with the fitted masses of the reference.
//   elbow-heavy  f  .1390 .4203 2.446 4.283 6.904 12.852 Hz    |D|  2.447 .833 .358 .126 .162 .007 kg^1/2 m
//   tip-heavy    f  .1391 .4199 2.475 4.238 6.852 12.944 Hz    |D|  1.641 1.292 .401 .160 .184 .008 kg^1/2 m
// The sum of D^2 over all modes is 6.8519 and 4.5828 kg m^2, of the arm's 6.8531 and 4.5839. Table 1 prints
// .139 .420 2.463 4.295 6.860 12.820 Hz.
#include "server/structure/space_frame.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <limits>
#include <numbers>

#include "server/propagation/modal_basis.hpp"
#include "server/structure/hub_coupling.hpp"
#include "server/structure/mass_properties.hpp"
#include "tests/unit/frame_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using Eigen::Matrix3d;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;
using std::numbers::pi;

const Vector3d kHubAxis = Vector3d::UnitZ();

NormalModes clamped_modes(const SpaceFrame& frame) {
  return normal_modes(assemble(frame), FrameBoundary::kClamped);
}

/// Half a unit of the last printed digit, and what the rounding of the printed masses (1e-4 of them) makes.
void expect_printed(double value, double printed, int decimals) {
  EXPECT_NEAR(value, printed, 0.5 * std::pow(10, -decimals) + 1e-5 * printed);
}

void expect_relative(double value, double expected, double tolerance) {
  EXPECT_NEAR(value, expected, tolerance * std::abs(expected));
}

double bisect(double low, double high, const std::function<double(double)>& f) {
  for (int i = 0; i < 100; ++i) {
    const double middle = (low + high) / 2;
    (f(low) * f(middle) <= 0 ? high : low) = middle;
  }
  return low;
}

// ---- Agrawal & Bang

class Arm : public testing::TestWithParam<ArmFit> {};
INSTANTIATE_TEST_SUITE_P(Fits, Arm, testing::Values(kElbowHeavy, kTipHeavy),
                         [](const auto& fit) { return fit.param.name; });

TEST_P(Arm, HasThePrintedFrequenciesAndCouplings) {
  const ArmFit& fit = GetParam();
  const AssembledFrame frame = assemble(arm(fit));
  const NormalModes modes = normal_modes(frame, FrameBoundary::kClamped);
  const HubCoupling hub = hub_coupling(frame, modes, kHubAxis);
  ASSERT_EQ(modes.size(), 18);
  for (std::size_t i = 0; i < 6; ++i) {
    SCOPED_TRACE(i);
    const auto mode = static_cast<Eigen::Index>(i);
    expect_printed(modes.frequency_rad_s(mode) / (2 * pi), fit.frequency_hz[i], i < 2 ? 4 : 3);
    expect_printed(std::abs(hub.coupling_sqrt_kg_m(mode)), fit.coupling_sqrt_kg_m[i], 3);
  }
  EXPECT_GT(modes.frequency_rad_s(6) / (2 * pi), 80);  // what the six-mode table leaves out
  expect_printed(hub.modal_inertia_kg_m2, fit.modal_inertia_kg_m2, 4);
  expect_printed(hub.inertia_kg_m2, fit.inertia_kg_m2, 4);
}

TEST_P(Arm, HasTheInertiaOfItsRodsAndMasses) {
  const double near_m = kArmRadius_m, far_m = kArmRadius_m + kArmLength_m;
  double inertia = kArmMassPerLength_kg_m * (std::pow(far_m, 3) - std::pow(near_m, 3)) / 3 +
                   kArmMassPerLength_kg_m * kArmLength_m * (far_m * far_m + kArmLength_m * kArmLength_m / 3);
  double mass = 2 * kArmMassPerLength_kg_m * kArmLength_m;
  const SpaceFrame parts = arm(GetParam());
  for (const PointMass& point : parts.point_masses) {
    inertia += point.mass_kg * parts.nodes[point.node].position_m.squaredNorm();
    mass += point.mass_kg;
  }
  const MassProperties properties = mass_properties(assemble(parts));
  expect_relative(properties.mass_kg, mass, 1e-14);
  expect_relative(properties.inertia_about_origin_kg_m2(2, 2), inertia, 1e-14);
}

// sum D^2 = I - r_c^T (M_cc - M_cf M_ff^-1 M_fc) r_c: completeness of the modes.
TEST_P(Arm, AllModesCarryAllButTheRootsShare) {
  const AssembledFrame frame = assemble(arm(GetParam()));
  const HubCoupling hub = hub_coupling(frame, normal_modes(frame, FrameBoundary::kClamped), kHubAxis);
  const auto f = frame.moving(FrameBoundary::kClamped);
  const std::vector<int> c{0, 1, 5};
  const VectorXd r = frame.rigid_motion.col(5);
  const MatrixXd fc = frame.mass(f, c), ff = frame.mass(f, f), cc = frame.mass(c, c);
  const double share = r(c).dot((cc - fc.transpose() * ff.ldlt().solve(fc)) * r(c));
  EXPECT_GT(share, 1e-3);
  expect_relative(hub.carried_by_hub_kg_m2, share, 1e-7);
}

// The hub hinged instead of clamped, once from the clamped modes and their couplings, once as a frame of its
// own: a link without mass, and too stiff to matter, joins the hub to the root.
TEST_P(Arm, CouplingsGiveTheFrequenciesWithTheHubFree) {
  constexpr double kHub_kg_m2 = 6.1;
  SpaceFrame parts = arm(GetParam());
  const AssembledFrame frame = assemble(parts);
  const NormalModes modes = normal_modes(frame, FrameBoundary::kClamped);
  const HubCoupling hub = hub_coupling(frame, modes, kHubAxis);
  SingleAxisPlant plant{kHub_kg_m2 + hub.inertia_kg_m2, {}};
  for (Eigen::Index i = 0; i < modes.size(); ++i)
    plant.modes.push_back({modes.frequency_rad_s(i), 0, hub.coupling_sqrt_kg_m(i)});
  const ModalBasis basis(plant);

  parts.nodes.front().held = {};
  parts.nodes.emplace_back().held = {true, true, true, true, true, false};
  FrameBeam& link = parts.beams.emplace_back();
  link.from_node = 7;
  link.to_node = 0;
  link.section = round_section(0, 1e7, 1e9);
  PointMass& body = parts.point_masses.emplace_back();
  body.node = 7;
  body.inertia_kg_m2(2, 2) = kHub_kg_m2;
  const NormalModes hinged = clamped_modes(parts);
  EXPECT_EQ(hinged.frequency_rad_s(0), 0);
  for (std::size_t i = 0; i < 7; ++i)  // beyond, the link is no longer stiff
    expect_relative(hinged.frequency_rad_s(static_cast<Eigen::Index>(i) + 1),
                    basis.free_frequencies_rad_s()[i], 2e-6);
}

// ---- closed forms

constexpr double kLength_m = 1.7, kMassPerLength_kg_m = 0.3, kBending_N_m2 = 2;

/// beta L of a beam from its frequency.
double beta_l(double frequency_rad_s) {
  return std::sqrt(frequency_rad_s * std::sqrt(kMassPerLength_kg_m / kBending_N_m2)) * kLength_m;
}

SpaceFrame closed_form_beam(int elements) {
  return plane_beam(kLength_m, round_section(kMassPerLength_kg_m, kBending_N_m2, 1e7), elements);
}

TEST(Cantilever, ConvergesOnTheClosedFormFromAbove) {
  const double exact[] = {1.87510406871196, 4.69409113297418, 7.85475743823761};
  double before[3] = {};
  for (const int elements : {8, 16, 32}) {
    SpaceFrame frame = closed_form_beam(elements);
    frame.nodes[0].held = kAllHeld;
    const NormalModes modes = clamped_modes(frame);
    for (int i = 0; i < 3; ++i) {
      const double error = beta_l(modes.frequency_rad_s(i)) - exact[i];
      EXPECT_GT(error, 0);
      // Fourth order: each halving leaves a sixteenth.
      if (elements > 8) {
        EXPECT_NEAR(before[i] / error, 16, 0.8);
      }
      before[i] = error;
    }
  }
  for (int i = 0; i < 3; ++i) EXPECT_LT(before[i], 2e-6 * exact[i]);
}

TEST(Cantilever, CarriesATipMass) {
  constexpr double kMass_kg = 0.8;
  const double ratio = kMass_kg / (kMassPerLength_kg_m * kLength_m);
  const auto characteristic = [&](double b) {
    return 1 + std::cos(b) * std::cosh(b) +
           ratio * b * (std::cos(b) * std::sinh(b) - std::sin(b) * std::cosh(b));
  };
  SpaceFrame frame = closed_form_beam(16);
  frame.nodes[0].held = kAllHeld;
  frame.point_masses.push_back({1, kMass_kg, Matrix3d::Zero()});
  const NormalModes modes = clamped_modes(frame);
  expect_relative(beta_l(modes.frequency_rad_s(0)), bisect(0.5, 2, characteristic), 1e-7);
  expect_relative(beta_l(modes.frequency_rad_s(1)), bisect(3, 5, characteristic), 2e-6);
}

// A beam without mass has one mode, sqrt(3 E I / (m l^3)), in each plane, and one along itself.
TEST(Cantilever, WithoutMassLeavesTheTipsModesOnly) {
  SpaceFrame frame = plane_beam(kLength_m, round_section(0, kBending_N_m2, 1e7), 5);
  frame.held_everywhere = {};
  frame.nodes[0].held = kAllHeld;
  frame.nodes[1].position_m = kLength_m * Vector3d(2, -1, 2) / 3;
  frame.point_masses.push_back({1, 0.8, Matrix3d::Zero()});
  const NormalModes modes = clamped_modes(frame);
  ASSERT_EQ(modes.size(), 3);
  const double bending_rad_s = std::sqrt(3 * kBending_N_m2 / (0.8 * std::pow(kLength_m, 3)));
  expect_relative(modes.frequency_rad_s(0), bending_rad_s, 1e-9);
  expect_relative(modes.frequency_rad_s(1), bending_rad_s, 1e-9);
  expect_relative(modes.frequency_rad_s(2), std::sqrt(1e7 / kLength_m / 0.8), 1e-9);
}

TEST(Cantilever, TwistsAndBendsAboutBothAxes) {
  SpaceFrame frame = closed_form_beam(16);
  frame.held_everywhere = {};
  frame.nodes[0].held = kAllHeld;
  BeamSection& section = frame.beams[0].section;
  section.bending_stiffness_y_N_m2 = 9 * kBending_N_m2;
  section.torsional_stiffness_N_m2 = 3;
  section.polar_inertia_per_length_kg_m = 0.02;
  const NormalModes modes = clamped_modes(frame);
  const double y_bending =
      std::pow(1.87510406871196 / kLength_m, 2) * std::sqrt(kBending_N_m2 / kMassPerLength_kg_m);
  const double torsion = pi / (2 * kLength_m) * std::sqrt(3 / 0.02);
  ASSERT_LT(3 * y_bending, torsion);
  expect_relative(modes.frequency_rad_s(0), y_bending, 1e-6);
  expect_relative(modes.frequency_rad_s(1), 3 * y_bending, 1e-6);
  // E I about z resists deflection along y, the side that the orientation is on.
  EXPECT_GT(std::abs(modes.shapes(7, 0)), 1e6 * std::abs(modes.shapes(8, 0)));
  EXPECT_GT(std::abs(modes.shapes(8, 1)), 1e6 * std::abs(modes.shapes(7, 1)));
  double nearest = 1e9;
  for (Eigen::Index i = 2; i < modes.size(); ++i)
    if (std::abs(modes.shapes(9, i)) > 1e3 * modes.shapes.col(i).segment<2>(7).norm())
      nearest = std::min(nearest, modes.frequency_rad_s(i));
  expect_relative(nearest, torsion, 1e-3);
}

// One element, exactly as the consistent mass has it: w^2 = 3 stiffness / (mass l^2), 10 % above the rod's.
TEST(Cantilever, OfOneElementStretchesAndTwistsByTheConsistentMass) {
  SpaceFrame frame = closed_form_beam(1);
  frame.held_everywhere = {false, true, true, false, true, true};
  frame.nodes[0].held = kAllHeld;
  const NormalModes modes = clamped_modes(frame);
  ASSERT_EQ(modes.size(), 2);
  const BeamSection& section = frame.beams[0].section;
  const double torsion = section.torsional_stiffness_N_m2 / section.polar_inertia_per_length_kg_m;
  const double axial = section.axial_stiffness_N / section.mass_per_length_kg_m;
  expect_relative(modes.frequency_rad_s(0), std::sqrt(3 * torsion) / kLength_m, 1e-9);
  expect_relative(modes.frequency_rad_s(1), std::sqrt(3 * axial) / kLength_m, 1e-9);
}

TEST(Bar, HasTheAxialModesOfARod) {
  const double exact_rad_s = std::sqrt(5e4 / 0.3) / kLength_m * pi / 2;
  double before = 0;
  for (const int elements : {8, 16}) {
    SpaceFrame frame;
    frame.nodes.resize(2);
    frame.nodes[0].held = kAllHeld;
    frame.nodes[1].position_m.y() = kLength_m;
    frame.nodes[1].held = {true, false, true, false, false, false};
    frame.bars.push_back({0, 1, 0.3, 5e4});
    frame.elements_per_member = elements;
    const NormalModes modes = clamped_modes(frame);
    ASSERT_EQ(modes.size(), elements);
    expect_relative(modes.frequency_rad_s(0), exact_rad_s, 2e-3);
    expect_relative(modes.frequency_rad_s(1), 3 * exact_rad_s, 2e-2);
    const double error = modes.frequency_rad_s(0) / exact_rad_s - 1;
    if (before > 0) {
      EXPECT_NEAR(before / error, 4, 0.1);
    }
    before = error;
  }
}

// Across itself a bar is a rigid rod: a pendulum on a spring bar has the rod's inertia, m l^2 / 3.
TEST(Bar, SwingsAsARigidRod) {
  for (const int elements : {1, 5}) {
    SpaceFrame frame;
    frame.nodes.resize(3);
    frame.nodes[0].held = frame.nodes[2].held = kAllHeld;
    frame.nodes[1].position_m << 2, 0, 0;
    frame.nodes[2].position_m << 2, 3, 0;
    frame.nodes[1].held = {false, false, true, false, false, false};
    frame.bars.push_back({0, 1, 0.3, 1e9});
    frame.bars.push_back({1, 2, 0, 7});
    frame.elements_per_member = elements;
    const NormalModes modes = clamped_modes(frame);
    EXPECT_EQ(modes.size(), 1 + elements);  // the spring's parts have no mass, and no modes of their own
    expect_relative(modes.frequency_rad_s(0), std::sqrt(7.0 / 3 / (0.3 * 2 / 3)), 1e-6);
  }
}

TEST(Release, TurnsAClampIntoAPinAboutItsAxisOnly) {
  SpaceFrame frame = closed_form_beam(32);
  frame.held_everywhere = {};
  frame.nodes[0].held = frame.nodes[1].held = kAllHeld;
  frame.beams[0].section.bending_stiffness_y_N_m2 = 1e3 * kBending_N_m2;
  const DofFlags pin{false, false, false, false, false, true};
  expect_relative(beta_l(clamped_modes(frame).frequency_rad_s(0)), 4.73004074486270, 1e-6);
  frame.beams[0].released_at_to = pin;
  expect_relative(beta_l(clamped_modes(frame).frequency_rad_s(0)), 3.92660231204792, 1e-6);
  frame.beams[0].released_at_from = pin;
  const NormalModes both = clamped_modes(frame);
  expect_relative(beta_l(both.frequency_rad_s(0)), pi, 1e-6);
  expect_relative(beta_l(both.frequency_rad_s(1)), 2 * pi, 1e-5);
  // The other plane keeps its clamps.
  bool is_clamped = false;
  for (const double w : both.frequency_rad_s)
    is_clamped |= std::abs(beta_l(w / std::sqrt(1e3)) - 4.73004074486270) < 1e-5;
  EXPECT_TRUE(is_clamped);
}

TEST(Release, StaysInThePlaneOfAPlaneFrame) {
  SpaceFrame frame = closed_form_beam(4);
  frame.nodes[0].held = frame.nodes[1].held = kAllHeld;
  const auto before = clamped_modes(frame).size();
  frame.beams[0].released_at_to = {false, false, false, true, true, true};  // a ball
  EXPECT_EQ(clamped_modes(frame).size(), before + 1);
}

// ---- what holds for any frame

TEST(FreeBeam, HasSixRigidModes) {
  SpaceFrame frame = closed_form_beam(12);
  frame.held_everywhere = {};
  frame.nodes[1].position_m = kLength_m * Vector3d(2, -1, 2) / 3;
  frame.beams[0].section.polar_inertia_per_length_kg_m = 1e-4;
  frame.nodes[0].held = kAllHeld;  // taken away by the boundary
  const NormalModes modes = normal_modes(assemble(frame), FrameBoundary::kFree);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(modes.frequency_rad_s(i), 0);
  for (int i : {6, 7}) expect_relative(beta_l(modes.frequency_rad_s(i)), 4.73004074486270, 1e-5);
  for (int i : {8, 9}) expect_relative(beta_l(modes.frequency_rad_s(i)), 7.85320462409584, 1e-4);
}

TEST(FreeBeam, InAPlaneHasThree) {
  const NormalModes modes = normal_modes(assemble(closed_form_beam(64)), FrameBoundary::kFree);
  for (int i = 0; i < 3; ++i) EXPECT_EQ(modes.frequency_rad_s(i), 0);
  expect_relative(beta_l(modes.frequency_rad_s(3)), 4.73004074486270, 1e-7);
}

TEST(FreeBeam, ThatSpinsWithoutInertiaIsRefused) {
  SpaceFrame frame = closed_form_beam(3);
  frame.held_everywhere = {};
  frame.nodes[1].position_m = kLength_m * Vector3d(2, -1, 2) / 3;
  frame.beams[0].section.polar_inertia_per_length_kg_m = 0;
  EXPECT_THROW(normal_modes(assemble(frame), FrameBoundary::kFree), std::domain_error);
  // Clamped, torsion is statics and bending is as ever.
  frame.nodes[0].held = kAllHeld;
  const NormalModes still = clamped_modes(frame);
  frame.beams[0].section.polar_inertia_per_length_kg_m = 1e-9;
  const NormalModes twisting = clamped_modes(frame);
  EXPECT_EQ(twisting.size() - still.size(), 3);
  for (int i = 0; i < 6; ++i) expect_relative(still.frequency_rad_s(i), twisting.frequency_rad_s(i), 1e-7);
}

TEST(AnyFrame, IsNotStrainedByRigidMotions) {
  const AssembledFrame frame = assemble(one_of_everything());
  EXPECT_LT((frame.stiffness * frame.rigid_motion).cwiseAbs().maxCoeff(),
            1e-13 * frame.stiffness.cwiseAbs().maxCoeff());
  EXPECT_TRUE(frame.stiffness.isApprox(frame.stiffness.transpose(), 1e-14));
  EXPECT_TRUE(frame.mass.isApprox(frame.mass.transpose(), 1e-14));
}

TEST(AnyFrame, HasMassNormalisedModesThatDiagonaliseIt) {
  const AssembledFrame frame = assemble(one_of_everything());
  const NormalModes modes = normal_modes(frame, FrameBoundary::kClamped);
  const MatrixXd identity = MatrixXd::Identity(modes.size(), modes.size());
  EXPECT_LT((modes.shapes.transpose() * frame.mass * modes.shapes - identity).cwiseAbs().maxCoeff(), 1e-7);
  const MatrixXd strain = modes.shapes.transpose() * frame.stiffness * modes.shapes;
  for (Eigen::Index i = 0; i < modes.size(); ++i)
    expect_relative(strain(i, i), modes.frequency_rad_s(i) * modes.frequency_rad_s(i), 1e-7);
  EXPECT_EQ(modes.shapes.topRows(6).cwiseAbs().maxCoeff(), 0);
}

// Next to nothing on a spring overflows.
TEST(AnyFrame, MustHaveModesThatADoubleHolds) {
  SpaceFrame frame = closed_form_beam(1);
  frame.beams[0].section.mass_per_length_kg_m = 0;
  frame.point_masses.push_back({1, 1e-320, Matrix3d::Zero()});
  EXPECT_THROW(clamped_modes(frame), std::domain_error);
}

TEST(AnyFrame, HasNoModesWhereNothingMoves) {
  SpaceFrame held = closed_form_beam(1);
  held.nodes[0].held = held.nodes[1].held = kAllHeld;
  EXPECT_EQ(clamped_modes(held).size(), 0);
  SpaceFrame loose;
  loose.nodes.resize(2);
  loose.point_masses.push_back({0, 2, Matrix3d::Zero()});
  EXPECT_EQ(clamped_modes(loose).frequency_rad_s, VectorXd::Zero(3));
}

// Thin rods, bars and a body, by hand.
TEST(AnyFrame, HasTheMassPropertiesOfItsParts) {
  const SpaceFrame parts = one_of_everything();
  double mass = 0;
  Vector3d moment = Vector3d::Zero();
  Matrix3d second = Matrix3d::Zero(), inertia = Matrix3d::Zero();
  const auto add_rod = [&](std::size_t from, std::size_t to, double per_length, double polar) {
    const Vector3d a = parts.nodes[from].position_m, b = parts.nodes[to].position_m, t = b - a;
    const double m = per_length * t.norm();
    mass += m;
    moment += m * (a + b) / 2;
    second += m * (a * a.transpose() + b * b.transpose() + (a + b) * (a + b).transpose()) / 6;
    inertia += polar * t * t.transpose() / t.norm();  // about its own axis, as the rod's torsion has it
  };
  for (const FrameBeam& beam : parts.beams)
    add_rod(beam.from_node, beam.to_node, beam.section.mass_per_length_kg_m,
            beam.section.polar_inertia_per_length_kg_m);
  for (const FrameBar& bar : parts.bars) add_rod(bar.from_node, bar.to_node, bar.mass_per_length_kg_m, 0);
  for (const PointMass& point : parts.point_masses) {
    const Vector3d& p = parts.nodes[point.node].position_m;
    mass += point.mass_kg;
    moment += point.mass_kg * p;
    second += point.mass_kg * p * p.transpose();
    inertia += point.inertia_kg_m2;
  }
  inertia += second.trace() * Matrix3d::Identity() - second;

  const MassProperties properties = mass_properties(assemble(parts));
  expect_relative(properties.mass_kg, mass, 1e-14);
  EXPECT_LT((properties.first_moment_kg_m - moment).norm(), 1e-14);
  EXPECT_LT((properties.centre_m - moment / mass).norm(), 1e-14);
  EXPECT_LT((properties.inertia_about_origin_kg_m2 - inertia).norm(), 1e-14);
  const Vector3d c = moment / mass;
  EXPECT_LT((properties.inertia_about_centre_kg_m2 -
             (inertia - mass * (c.squaredNorm() * Matrix3d::Identity() - c * c.transpose())))
                .norm(),
            1e-14);
}

// The whole of it turned, the hub's axis with it.
TEST(AnyFrame, KeepsItsModesWhenItIsTurned) {
  const SpaceFrame frame = one_of_everything();
  const Matrix3d turn = Eigen::Quaterniond(0.3, -0.7, 0.4, 0.9).normalized().toRotationMatrix();
  SpaceFrame turned = frame;
  for (FrameNode& node : turned.nodes) node.position_m = turn * node.position_m;
  for (FrameBeam& beam : turned.beams) beam.orientation = turn * beam.orientation;
  for (PointMass& point : turned.point_masses) {
    const Matrix3d inertia = turn * point.inertia_kg_m2 * turn.transpose();
    point.inertia_kg_m2 = (inertia + inertia.transpose()) / 2;
  }
  const AssembledFrame a = assemble(frame), b = assemble(turned);
  const NormalModes here = normal_modes(a, FrameBoundary::kClamped);
  const NormalModes there = normal_modes(b, FrameBoundary::kClamped);
  const Vector3d axis(1, -2, 0.5);
  const HubCoupling couplings = hub_coupling(a, here, axis), others = hub_coupling(b, there, turn * axis);
  ASSERT_EQ(here.size(), there.size());
  for (Eigen::Index i = 0; i < here.size(); ++i) {
    expect_relative(there.frequency_rad_s(i), here.frequency_rad_s(i), 1e-7);
    EXPECT_NEAR(std::abs(others.coupling_sqrt_kg_m(i)), std::abs(couplings.coupling_sqrt_kg_m(i)), 1e-6);
  }
  expect_relative(others.inertia_kg_m2, couplings.inertia_kg_m2, 1e-12);
}

// Of a long chain the mass of the root's element is little: the modes then carry nearly all of all six rigid
// motions, and never more.
TEST(AnyFrame, CarriesMoreOfItsMassInModesTheFinerItIs) {
  double before = 1e9;
  for (const int elements : {1, 2, 4, 8}) {
    SpaceFrame parts = one_of_everything();
    parts.elements_per_member = elements;
    const AssembledFrame frame = assemble(parts);
    const auto couplings = rigid_couplings(frame, normal_modes(frame, FrameBoundary::kClamped));
    const Eigen::Matrix<double, 6, 6> left =
        frame.rigid_motion.transpose() * frame.mass * frame.rigid_motion - couplings.transpose() * couplings;
    EXPECT_GT(left.selfadjointView<Eigen::Lower>().eigenvalues().minCoeff(), -1e-9);
    EXPECT_LT(left.trace(), before);
    before = left.trace();
  }
}

// The SCOLE reference's frame, mast and hexagonal antenna on a free plate: mass properties and frequencies.
TEST(Scole, HasTheReferencesMassPropertiesAndFreeFrequencies) {
  SpaceFrame frame;
  const double l = 0.6096, h = 3.048, s = l * std::sqrt(3) / 2;
  for (int i = 0; i <= 7; ++i) frame.nodes.emplace_back().position_m << 0, 0, i * h / 7;
  for (const auto& [x, y] : {std::array{1.5 * l, s}, std::array{l, 2 * s}, std::array{0.0, 2 * s},
                             std::array{-0.5 * l, s}, std::array{l, 0.0}, std::array{0.5 * l, s}})
    frame.nodes.emplace_back().position_m << x, y, h;
  // E, G, rho, A, I of steel for the mast and aluminium for the antenna; J = 2 I.
  const auto tube = [](double e, double g, double rho, double area, double second) {
    return BeamSection{rho * area, rho * 2 * second, e * area, e * second, e * second, g * 2 * second};
  };
  const BeamSection mast = tube(200e9, 77.5e9, 7850, 8.39107585385456e-5, 3.2461218037869806e-9);
  const BeamSection antenna = tube(69e9, 26e9, 2700, 1.1073787931188361e-4, 7.95460745879483e-9);
  const auto join = [&](std::size_t from, std::size_t to, const BeamSection& section) {
    FrameBeam& beam = frame.beams.emplace_back();
    beam.from_node = from;
    beam.to_node = to;
    beam.section = section;
  };
  for (std::size_t i = 0; i < 7; ++i) join(i, i + 1, mast);
  const std::size_t rim[] = {7, 12, 8, 9, 10, 11};
  for (std::size_t i = 0; i < 6; ++i) {
    join(rim[i], rim[(i + 1) % 6], antenna);
    join(13, rim[i], antenna);
  }
  frame.point_masses.push_back(
      {0, 202.1241, Vector3d(76.31322015666396, 31.689089555426236, 107.9996893982537).asDiagonal()});

  const AssembledFrame assembled = assemble(frame);
  ASSERT_EQ(assembled.mass.rows(), 84);
  const MassProperties properties = mass_properties(assembled);
  expect_relative(properties.mass_kg, 206.319, 1e-6);
  EXPECT_LT((properties.first_moment_kg_m - Vector3d(0.66665499, 1.1546803, 9.726309)).norm(), 1e-6);
  Matrix3d inertia;
  inertia << 103.6971, -0.35194656, -2.0319644, -0.35194656, 58.66658, -3.5194656, -2.0319644, -3.5194656,
      109.28676;
  EXPECT_LT((properties.inertia_about_origin_kg_m2 - inertia).cwiseAbs().maxCoeff(), 1e-4);

  const NormalModes modes = normal_modes(assembled, FrameBoundary::kFree);
  for (int i = 0; i < 6; ++i) EXPECT_EQ(modes.frequency_rad_s(i), 0);
  const double expected[] = {5.63879,  6.480817, 16.96904, 24.90807, 42.11732,
                             77.87582, 95.16522, 197.0459, 209.4099, 278.5341};
  for (int i = 0; i < 10; ++i) expect_relative(modes.frequency_rad_s(6 + i), expected[i], 1e-6);
}

// ---- what is refused

struct Spoiled {
  const char* field;
  std::function<void(SpaceFrame&)> spoil;
};

TEST(Validation, NamesTheFieldThatIsWrong) {
  const double nan = std::nan("");
  const Spoiled cases[] = {
      {"nodes/2/position_m", [&](SpaceFrame& f) { f.nodes[2].position_m.z() = nan; }},
      {"beams/1/to_node", [](SpaceFrame& f) { f.beams[1].to_node = 4; }},
      {"beams/1/from_node", [](SpaceFrame& f) { f.beams[1].from_node = 99; }},
      {"beams/0/to_node", [](SpaceFrame& f) { f.beams[0].to_node = 0; }},
      {"beams/2/section/axial_stiffness_N", [](SpaceFrame& f) { f.beams[2].section.axial_stiffness_N = 0; }},
      {"beams/2/section/mass_per_length_kg_m",
       [](SpaceFrame& f) { f.beams[2].section.mass_per_length_kg_m = -1; }},
      {"beams/2/section/polar_inertia_per_length_kg_m",
       [](SpaceFrame& f) { f.beams[2].section.polar_inertia_per_length_kg_m = -1; }},
      {"beams/0/section/bending_stiffness_y_N_m2",
       [&](SpaceFrame& f) { f.beams[0].section.bending_stiffness_y_N_m2 = nan; }},
      {"beams/0/section/bending_stiffness_z_N_m2",
       [&](SpaceFrame& f) { f.beams[0].section.bending_stiffness_z_N_m2 = -3; }},
      {"beams/0/section/torsional_stiffness_N_m2",
       [](SpaceFrame& f) {
         f.beams[0].section.torsional_stiffness_N_m2 = std::numeric_limits<double>::infinity();
       }},
      {"beams/0/orientation", [](SpaceFrame& f) { f.beams[0].orientation.setZero(); }},
      {"beams/0/orientation",
       [](SpaceFrame& f) { f.beams[0].orientation = f.nodes[0].position_m - f.nodes[1].position_m; }},
      {"bars/1/axial_stiffness_N", [](SpaceFrame& f) { f.bars[1].axial_stiffness_N = 0; }},
      {"bars/1/mass_per_length_kg_m", [](SpaceFrame& f) { f.bars[1].mass_per_length_kg_m = -1; }},
      {"bars/0/to_node", [](SpaceFrame& f) { f.bars[0].to_node = f.bars[0].from_node; }},
      {"point_masses/0/node", [](SpaceFrame& f) { f.point_masses[0].node = 4; }},
      {"point_masses/0/mass_kg", [](SpaceFrame& f) { f.point_masses[0].mass_kg = -1; }},
      {"point_masses/0/inertia_kg_m2", [](SpaceFrame& f) { f.point_masses[0].inertia_kg_m2(0, 1) = 1; }},
      {"point_masses/0/inertia_kg_m2", [](SpaceFrame& f) { f.point_masses[0].inertia_kg_m2(1, 1) = -1; }},
      {"elements_per_member", [](SpaceFrame& f) { f.elements_per_member = 0; }},
      {"elements_per_member", [](SpaceFrame& f) { f.elements_per_member = 60; }},
      {"elements_per_member", [](SpaceFrame& f) { f.elements_per_member = std::numeric_limits<int>::max(); }},
  };
  EXPECT_TRUE(validate(one_of_everything()).empty());
  for (const Spoiled& spoiled : cases) {
    SCOPED_TRACE(spoiled.field);
    SpaceFrame frame = one_of_everything();
    spoiled.spoil(frame);
    const std::vector<FrameFault> faults = validate(frame);
    ASSERT_EQ(faults.size(), 1U);
    EXPECT_EQ(faults[0].field, spoiled.field);
    EXPECT_FALSE(faults[0].problem.empty() || faults[0].given.empty() || faults[0].allowed.empty());
    EXPECT_THROW(assemble(frame), std::invalid_argument);
  }
}

TEST(Validation, RefusesAFrameWithoutNodesOrMass) {
  ASSERT_EQ(validate(SpaceFrame{}).size(), 1U);
  EXPECT_EQ(validate(SpaceFrame{})[0].field, "nodes");
  const SpaceFrame frame = plane_beam(1, round_section(0, 1, 1), 2);
  ASSERT_EQ(validate(frame).size(), 1U);
  EXPECT_EQ(validate(frame)[0].field, "point_masses");
}

TEST(HubAxis, IsADirectionOfAnyLength) {
  const AssembledFrame frame = assemble(arm(kElbowHeavy));
  const NormalModes modes = normal_modes(frame, FrameBoundary::kClamped);
  const HubCoupling unit = hub_coupling(frame, modes, kHubAxis),
                    longer = hub_coupling(frame, modes, 8 * kHubAxis);
  EXPECT_EQ(unit.coupling_sqrt_kg_m, longer.coupling_sqrt_kg_m);
  EXPECT_EQ(unit.inertia_kg_m2, longer.inertia_kg_m2);
  EXPECT_THROW(hub_coupling(frame, modes, Vector3d::Zero()), std::invalid_argument);
}

}  // namespace

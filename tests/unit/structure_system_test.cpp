// SCOLE on 12 degrees of freedom (S03 to S09): 5.640245 6.482829 17.00994 24.95578 54.22759 78.90443 rad/s;
// the whole structure's receptance at 10 and 55 rad/s; 5.88366 deg/s, stop at 5.098871 s; A 0.522839 /
// 0.477161, 0.557232 s apart, arrival 6.441500 s; the loads at 0.6 s; sliding and filter eigenvalues.
#include "server/simulation/structure_system.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "server/estimation/algebraic_riccati.hpp"
#include "tests/unit/structure_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

constexpr double kDegPerRad = 180 / std::numbers::pi;

void expect_relative(double value, double expected, double tolerance) {
  EXPECT_NEAR(value, expected, tolerance * std::abs(expected));
}

const StructureSystem& scole_system() {
  static const auto system = build_structure_system(scole_slew(ScoleCase::a));
  return *system;
}

TEST(StructureSystem, KrylovVectorsHaveTheReferencesFrequencies) {
  const FreeModes modes = free_modes(scole_system().plant);
  const double expected[] = {5.640245, 6.482829, 17.00994, 24.95578, 54.22759, 78.90443};
  ASSERT_EQ(modes.frequency_rad_s.size(), 6);
  for (Index i = 0; i < 6; ++i) expect_relative(modes.frequency_rad_s[i], expected[i], 1e-4);
  ASSERT_EQ(scole_system().controller->tracking.modes(), 2);
  for (Index i = 0; i < 2; ++i)
    expect_relative(scole_system().controller->tracking.frequency_rad_s[i], expected[i], 1e-4);
}

TEST(StructureSystem, KrylovVectorsAnswerAsTheWholeStructureAtTheirShifts) {
  const auto& [elements, plant, design, dynamics, command, antenna, sensors, controller] = scole_system();
  const SlewingStructure& structure = elements.structure;
  MatrixXd tip(structure.size(), 2);
  for (std::size_t i = 0; i < 2; ++i)
    tip.col(static_cast<Index>(i)) = structure.absolute(NodeMotion{kScoleTip, i}.coordinate());
  const MatrixXd reduced_tip = plant.basis.transpose() * tip;
  const auto whole = [&](double w) -> MatrixXd {
    return receptance(structure.mass, structure.stiffness, 0, 0, tip, tip, w).real();
  };
  const auto reduced = [&](double w) -> MatrixXd {
    return receptance(plant.mass, plant.stiffness, 0, 0, reduced_tip, reduced_tip, w).real();
  };
  MatrixXd at_10(2, 2), at_55(2, 2);
  at_10 << -0.0022967397, -0.0013833033, -0.0013833033, -0.0038150003;
  at_55 << -0.00022450598, 6.992076e-05, 6.992076e-05, -0.00014374501;
  EXPECT_LT((whole(10) - at_10).norm(), 1e-4 * at_10.norm());
  EXPECT_LT((whole(55) - at_55).norm(), 1e-4 * at_55.norm());
  for (const double w : {10.0, 55.0}) EXPECT_LT((reduced(w) - whole(w)).norm(), 1e-6 * whole(w).norm());
  // d/dw of P^T (K - w^2 M)^-1 P.
  const auto slope = [](const MatrixXd& mass, const MatrixXd& stiffness, const MatrixXd& loads) -> MatrixXd {
    const MatrixXd moved = (stiffness - 100 * mass).partialPivLu().solve(loads);
    return 20 * moved.transpose() * mass * moved;
  };
  const MatrixXd expected = slope(structure.mass, structure.stiffness, tip);
  EXPECT_LT((slope(plant.mass, plant.stiffness, reduced_tip) - expected).norm(), 1e-6 * expected.norm());
  EXPECT_GT((reduced(20) - whole(20)).norm(), 1e-6 * whole(20).norm());
}

TEST(StructureSystem, CommandHasTheReferencesTimes) {
  const SineSquaredSlew& command = scole_system().command;
  const SineSquaredPulses& pulses = command.pulses();
  expect_relative(pulses.inertia_kg_m2, 103.6971, 1e-6);
  expect_relative(pulses.coast_rate_rad_s() * kDegPerRad, 5.8836559, 1e-5);
  expect_relative(pulses.pulse_s(), 0.78539816, 1e-5);
  expect_relative(pulses.stop_s(), 5.0988706, 1e-5);
  expect_relative(pulses.stop_s() - pulses.pulse_s(), 4.3134724, 1e-5);
  expect_relative(pulses.end_s(), 5.8842687, 1e-5);
  ASSERT_EQ(command.impulses().size(), 2u);
  expect_relative(command.impulses()[0].amplitude, 0.5228392, 1e-4);
  expect_relative(command.impulses()[1].amplitude, 0.4771608, 1e-4);
  expect_relative(command.impulses()[1].time_s, 0.55723152, 1e-4);
  expect_relative(command.arrival_s(), 6.4415003, 1e-4);
  // S06: 6 deg/s exactly makes 75 slug ft^2.
  SineSquaredPulses published{20 * kFootPound_N_m, 4, 101.68635, 1};
  expect_relative(published.coast_rate_rad_s() * kDegPerRad, 6, 1e-5);
  const SlewState end = command.at(100);
  expect_relative(end.angle_rad * kDegPerRad, 30, 1e-12);
  EXPECT_NEAR(end.rate_rad_s, 0, 1e-15);
}

TEST(StructureSystem, ZeroOrderLoadsAreTheReferences) {
  const SlewState slew = scole_system().command.at(0.6);
  expect_relative(slew.angle_rad * kDegPerRad, 0.64920194, 1e-4);
  expect_relative(slew.rate_rad_s * kDegPerRad, 2.8407292, 1e-4);
  expect_relative(slew.acceleration_rad_s2 * kDegPerRad, 3.7812305, 1e-4);
  const auto loads =
      zero_order_loads(scole_system().elements.structure, slew.acceleration_rad_s2, slew.rate_rad_s);
  const Vector3d moment(6.8434824, -0.018231743, -0.13496448), force(0, -0.64472543, 0.052293979);
  EXPECT_LT((loads.head<3>() - force).norm(), 1e-4 * force.norm());
  EXPECT_LT((loads.tail<3>() - moment).norm(), 1e-4 * moment.norm());
}

void expect_eigenvalues(const Eigen::VectorXcd& values, std::vector<double> real,
                        std::vector<double> imaginary) {
  std::vector<double> re, im;
  for (const auto& value : values) {
    re.push_back(value.real());
    im.push_back(std::abs(value.imag()));
  }
  for (auto* list : {&re, &im, &real, &imaginary}) std::sort(list->begin(), list->end());
  ASSERT_EQ(re.size(), real.size());
  for (std::size_t i = 0; i < re.size(); ++i) {
    EXPECT_NEAR(re[i], real[i], std::max(1e-3, 1e-3 * std::abs(real[i])));
    EXPECT_NEAR(im[i], imaginary[i], std::max(1e-3, 1e-3 * imaginary[i]));
  }
}

TEST(StructureSystem, DesignHasTheReferencesEigenvalues) {
  const StructureController& controller = *scole_system().controller;
  expect_eigenvalues(controller.law.sliding_eigenvalues,
                     {-50.954, -33.44, -33.44, -21.747, -19.457, -10.548, -10.254, -10, -10, -10, -10,
                      -9.4974, -9.4974, -7.6825, -7.6825},
                     {0, 0, 0, 0, 0, 0, 0, 0, 0, 7.0085, 7.0085, 8.1518, 8.1518, 68.362, 68.362});
  expect_eigenvalues(
      steady_filter(controller.filter).eigenvalues(),
      {-31.136, -31.136, -14.708, -14.708, -3.1271, -3.1271, -1.8419, -1.8419, -0.93242, -0.93242, -0.91198,
       -0.91198},
      {5.568, 5.568, 6.4163, 6.4163, 16.92, 16.92, 24.76, 24.76, 52.195, 52.195, 72.501, 72.501});
}

TEST(StructureSystem, SurfaceTakesTheInputsOneByOne) {
  const auto& law = scole_system().controller->law;
  const auto dynamics = scole_system().plant_dynamics;
  const MatrixXd product = law.surface * dynamics.input_matrix();
  EXPECT_LT((product - MatrixXd::Identity(9, 9)).norm(), 1e-10);
}

TEST(StructureSystem, GainsGrowFromNothingToTheSteadyOnes) {
  const StructureController& controller = *scole_system().controller;
  MatrixXd gain;
  controller.gains->gain_at(0, gain);
  EXPECT_EQ(gain.norm(), 0);
  controller.gains->gain_at(12, gain);
  EXPECT_LT((gain - controller.gains->steady_gain()).norm(), 1e-6 * gain.norm());
  // In between against a finer integration.
  const GainSchedule finer(controller.filter, 12, 1e-12);
  MatrixXd other;
  for (const double t : {0.013, 0.11, 0.37, 0.81, 2.3, 5.01}) {
    controller.gains->gain_at(t, gain);
    finer.gain_at(t, other);
    EXPECT_LT((gain - other).norm(), 1e-6 * other.norm()) << t;
  }
}

// Other reductions in the same form: each holds its own frequencies.
TEST(StructureSystem, ReducesInOneForm) {
  const StructureElements elements = structure_elements(scole_slew());
  const FreeModes whole = free_modes(reduce(elements.structure, elastic_basis(elements, EveryMode{})));
  const FreeModes free = free_modes(reduce(elements.structure, elastic_basis(elements, HubFreeModes{6})));
  const FreeModes clamped = free_modes(reduce(elements.structure, elastic_basis(elements, ClampedModes{6})));
  for (Index i = 0; i < 6; ++i) {
    expect_relative(free.frequency_rad_s[i], whole.frequency_rad_s[i], 1e-8);
    EXPECT_GE(clamped.frequency_rad_s[i], whole.frequency_rad_s[i] * (1 - 1e-9));
  }
  expect_relative(clamped.frequency_rad_s[0], whole.frequency_rad_s[0], 2e-3);
  EXPECT_THROW(elastic_basis(elements, ClampedModes{79}), std::invalid_argument);
}

TEST(StructureSystem, SaysWhyVectorsDoNotExist) {
  const StructureElements elements = structure_elements(scole_slew());
  const FreeModes whole = free_modes(reduce(elements.structure, elastic_basis(elements, EveryMode{})));
  const auto why = [&](const KrylovVectors& vectors) -> std::string {
    try {
      elastic_basis(elements, vectors);
    } catch (const std::domain_error& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_NE(why({{whole.frequency_rad_s[2]}, along(kScoleTip, 0, 2)}).find("natural frequency"),
            std::string::npos);
  EXPECT_NE(why({{0}, along(kScoleTip, 0, 2)}).find("natural frequency"), std::string::npos);
  EXPECT_NE(why({std::vector<double>(40, 10.0), along(kScoleTip, 0, 2)}).find("more than the 78"),
            std::string::npos);
  EXPECT_NE(why({{10}, {{kScoleTip, 0}, {kScoleTip, 0}}}).find("depends"), std::string::npos);
}

// A double integrator: the surface is z2 = -sqrt(q11/q22) z1, from the scalar Riccati equation.
TEST(StructureSystem, RiccatiEquationHasItsClosedForm) {
  MatrixXd a(1, 1), g(1, 1), q(1, 1);
  a << 0;
  g << 4;
  q << 9;
  EXPECT_NEAR(stabilising_solution(a, g, q)(0, 0), 1.5, 1e-14);
  a << 2;
  EXPECT_NEAR(stabilising_solution(a, g, q)(0, 0), (2 + std::sqrt(4.0 + 36)) / 4, 1e-13);
  g << 0;
  EXPECT_THROW(stabilising_solution(a, g, q), std::domain_error);
  a << 0;
  EXPECT_THROW(stabilising_solution(a, g, q), std::domain_error);
}

}  // namespace

// ARKODE's implicit Runge-Kutta and CVODE's backward differentiation, with the equations of the loop written
// twice, end at the same place.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "tests/unit/structure_cases.hpp"

namespace {

using namespace slew;
using namespace slew::test;

class Ignore final : public SampleSink {
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const SwitchEvent&) override {}
};

void expect_agreement(StructureSpecification spec, double tolerance) {
  spec.verification_tolerance = 1e-9;
  spec.system = build_structure_system(spec);
  Ignore ignore;
  const auto run = make_structure_run(spec), other = make_structure_verification(spec);
  for (auto* one : {run.get(), other.get()})
    while (one->advance(std::numeric_limits<double>::infinity(), 1 << 20, ignore) == RunStatus::running) {
    }
  const Verification verification = compare(run->report(), other->report());
  EXPECT_EQ(verification.final_time_difference_s, 0);
  ASSERT_EQ(verification.final_state_difference.size(), run->channels().state.size());
  for (std::size_t i = 0; i < verification.final_state_difference.size(); ++i)
    EXPECT_NEAR(verification.final_state_difference[i], 0, tolerance) << run->channels().state[i].name;
  EXPECT_NEAR(verification.metrics.peak_rate_rad_s, run->report().metrics.peak_rate_rad_s, 1e-4);
}

TEST(StructureSecondOpinion, AgreesUnderControl) {
  for (const ScoleCase which : {ScoleCase::a, ScoleCase::b, ScoleCase::rigid_d}) {
    StructureSpecification spec = scole_slew(which);
    spec.duration_s = 7;
    expect_agreement(spec, 1e-7);
  }
}

TEST(StructureSecondOpinion, AgreesOnTheCommandAlone) {
  expect_agreement(scole_slew(ScoleCase::open), 1e-7);
}

TEST(StructureSecondOpinion, AgreesOnTheLawAsPrintedUnderNoise) {
  StructureSpecification spec = scole_slew(ScoleCase::a);
  spec.control->gains.form = LawForm::as_printed;
  spec.process_noise = HeldNoise{1e-5, 0.1};
  spec.sensor_noise = HeldNoise{1e-8, 0.1};
  spec.duration_s = 1.5;
  expect_agreement(spec, 1e-7);
}

TEST(StructureSecondOpinion, AgreesOnARicherPlantAboutAnotherAxis) {
  StructureSpecification spec = scole_slew(ScoleCase::a);
  spec.plant = ClampedModes{20};
  spec.axis = Eigen::Vector3d(0.3, 1, -0.2);
  spec.duration_s = 1.5;
  expect_agreement(spec, 1e-7);
}

}  // namespace

// Orders 5 and 4, and an extension of order 4: halving the step divides the errors by 64, and by 32 between.
#include "server/propagation/dormand_prince.hpp"

#include <gtest/gtest.h>

#include "server/propagation/runge_kutta_4.hpp"

namespace slew {
namespace {

using Integrator = DormandPrince<4>;

// x'' = -x, and t beside it: y' = 2 t y has exp(t^2).
void slope(double t, const Integrator::State& x, Integrator::State& dx) {
  dx[0] = x[1];
  dx[1] = -x[0];
  dx[2] = 2 * t * x[2];
}

double error_after(double h, double x) {
  Integrator integrator(3);
  integrator.begin(slope, 0.3, {std::sin(0.3), std::cos(0.3), std::exp(0.09)});
  integrator.attempt(slope, 0.3, h);
  const double t = 0.3 + x * h;
  std::array<double, 3> state;
  integrator.at(x, 0, 3, state.data());
  return std::abs(state[0] - std::sin(t)) + std::abs(state[2] - std::exp(t * t));
}

TEST(DormandPrince, a_step_is_of_order_five) {
  EXPECT_NEAR(error_after(0.04, 1) / error_after(0.02, 1), 64, 16);
}

TEST(DormandPrince, what_lies_between_is_of_order_four) {
  EXPECT_NEAR(error_after(0.04, 0.4) / error_after(0.02, 0.4), 32, 8);
}

TEST(DormandPrince, the_estimate_is_of_the_size_of_the_error_of_order_four) {
  Integrator integrator(3);
  const Integrator::State start{std::sin(0.3), std::cos(0.3), std::exp(0.09)};
  Integrator::State absolute{};
  absolute.fill(1);
  integrator.begin(slope, 0.3, start);
  integrator.attempt(slope, 0.3, 0.04);
  const double coarse = integrator.error(0, absolute);
  integrator.attempt(slope, 0.3, 0.02);
  EXPECT_NEAR(coarse / integrator.error(0, absolute), 32, 8);
  EXPECT_GT(coarse, error_after(0.04, 1));
}

TEST(DormandPrince, goes_on_with_the_slope_it_ended_with) {
  Integrator whole(3), again(3);
  whole.begin(slope, 0, {0, 1, 1});
  whole.attempt(slope, 0, 0.1);
  again.begin(slope, 0.1, whole.end());
  whole.go_on();
  whole.attempt(slope, 0.1, 0.1);
  again.attempt(slope, 0.1, 0.1);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(whole.end()[i], again.end()[i]);
}

TEST(RungeKutta4, a_step_is_of_order_four_and_what_lies_between_of_order_three) {
  const auto error = [](double h, double x) {
    RungeKutta4<4> method(3);
    method.begin(slope, 0.3, {std::sin(0.3), std::cos(0.3), std::exp(0.09)});
    method.step(slope, 0.3, h);
    std::array<double, 4> state;
    method.at(slope, 0.3 + h, x, state.data());
    const double t = 0.3 + x * h;
    return std::abs(state[0] - std::sin(t)) + std::abs(state[2] - std::exp(t * t));
  };
  EXPECT_NEAR(error(0.04, 1) / error(0.02, 1), 32, 8);
  EXPECT_NEAR(error(0.04, 0.5) / error(0.02, 0.5), 16, 4);
}

}  // namespace
}  // namespace slew

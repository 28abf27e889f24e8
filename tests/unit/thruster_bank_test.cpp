// Thrusters at work: a pulse of 30 ms through a valve that opens after 10 ms and closes after 20 ms is on for
// 40 ms.
#include "server/actuator/thruster_bank.hpp"

#include <gtest/gtest.h>

#include "server/actuator/propellant.hpp"

namespace slew {
namespace {

Thruster thruster() {
  Thruster one;
  one.position_m = {0, 2, 0};
  one.direction = {0, 0, 1};
  one.thrust_N = 3;
  return one;
}

// Everything that is due up to t, in its order.
void run_to(ThrusterBank& bank, double t_s) {
  while (bank.next_s() <= t_s) bank.arrive(bank.next_s());
}

TEST(ThrusterBank, torque_is_arm_times_thrust) {
  ThrusterBank bank({thruster()}, {}, 0);
  EXPECT_TRUE(bank.torque_N_m().isZero(0));
  ASSERT_TRUE(bank.command(1, 0, true));
  EXPECT_EQ(bank.torque_N_m(), Eigen::Vector3d(6, 0, 0));
  ASSERT_TRUE(bank.command(3, 0, false));
  EXPECT_TRUE(bank.torque_N_m().isZero(0));
  EXPECT_EQ(bank.on_time_s(0, 10), 2);
  EXPECT_EQ(bank.impulse_s(0, 10), 2);
  EXPECT_EQ(bank.firings(0), 1u);
}

TEST(ThrusterBank, valves_are_late) {
  Thruster late = thruster();
  late.on_delay_s = 0.010;
  late.off_delay_s = 0.020;
  ThrusterBank bank({late}, {}, 0);
  ASSERT_TRUE(bank.command(0, 0, true));
  EXPECT_DOUBLE_EQ(bank.next_s(), 0.010);
  ASSERT_TRUE(bank.command(0.005, 0, true));  // told again
  run_to(bank, 0.02);
  EXPECT_TRUE(bank.is_open(0));
  ASSERT_TRUE(bank.command(0.030, 0, false));
  run_to(bank, 1);
  EXPECT_NEAR(bank.on_time_s(0, 1), 0.040, 1e-15);
}

TEST(ThrusterBank, a_pulse_shorter_than_its_delays_differ_never_reaches_the_valve) {
  Thruster late = thruster();
  late.on_delay_s = 0.050;
  ThrusterBank bank({late}, {}, 0);
  ASSERT_TRUE(bank.command(0, 0, true));
  ASSERT_TRUE(bank.command(0.030, 0, false));
  run_to(bank, 1);
  EXPECT_EQ(bank.on_time_s(0, 1), 0);
  EXPECT_EQ(bank.firings(0), 0u);
}

TEST(ThrusterBank, refuses_more_commands_than_fit_on_their_way) {
  Thruster late = thruster();
  late.on_delay_s = late.off_delay_s = 100;
  ThrusterBank bank({late}, {}, 0);
  int taken = 0;
  while (taken < 1000 && bank.command(taken, 0, taken % 2 == 0)) ++taken;
  EXPECT_EQ(taken, 16);
}

TEST(ThrusterBank, thrust_rises_and_falls_linearly) {
  Thruster slow = thruster();
  slow.rise_s = 0.2;
  slow.fall_s = 0.4;
  ThrusterBank bank({slow}, {}, 0);
  ASSERT_TRUE(bank.command(0, 0, true));
  EXPECT_DOUBLE_EQ(bank.next_s(), 0.2);
  EXPECT_DOUBLE_EQ(bank.level_at(0, 0.1), 0.5);
  EXPECT_DOUBLE_EQ(bank.torque_at(0.1)[0], 3);
  run_to(bank, 1);
  EXPECT_EQ(bank.level_at(0, 1), 1);
  ASSERT_TRUE(bank.command(1, 0, false));
  EXPECT_DOUBLE_EQ(bank.level_at(0, 1.1), 0.75);
  run_to(bank, 2);
  EXPECT_EQ(bank.level_at(0, 2), 0);
  EXPECT_DOUBLE_EQ(bank.impulse_s(0, 2), 0.1 + 0.8 + 0.2);
  // Closed while it rises: from where it is.
  ASSERT_TRUE(bank.command(3, 0, true));
  ASSERT_TRUE(bank.command(3.1, 0, false));
  run_to(bank, 4);
  EXPECT_NEAR(bank.impulse_s(0, 4) - 1.1, 0.025 + 0.05, 1e-15);
}

TEST(ThrusterBank, a_minimum_of_the_effect_is_another_of_the_command) {
  Thruster slow = thruster();
  slow.minimum_on_time_s = 0.05;
  slow.rise_s = 0.01;
  slow.fall_s = 0.03;
  EXPECT_EQ(ThrusterBank({slow}, {}, 0).shortest_command_s(0), 0.05);
  slow.minimum_on_time_of = MinimumOnTimeOf::effective_thrust;
  ThrusterBank bank({slow}, {}, 0);
  const double command_s = bank.shortest_command_s(0);
  EXPECT_DOUBLE_EQ(command_s, 0.04);
  ASSERT_TRUE(bank.command(0, 0, true));
  run_to(bank, command_s);
  ASSERT_TRUE(bank.command(command_s, 0, false));
  run_to(bank, 1);
  EXPECT_NEAR(bank.impulse_s(0, 1), 0.05, 1e-15);
}

TEST(ThrusterBank, stuck_valves_do_not_listen) {
  Thruster open = thruster(), closed = thruster();
  open.stuck_open_from_s = 1;
  closed.stuck_closed_from_s = 1;
  ThrusterBank bank({open, closed}, {}, 0);
  ASSERT_TRUE(bank.command(0.5, 1, true));
  EXPECT_DOUBLE_EQ(bank.next_s(), 1);
  run_to(bank, 1);
  EXPECT_TRUE(bank.is_open(0));
  EXPECT_FALSE(bank.is_open(1));
  ASSERT_TRUE(bank.command(2, 0, false));
  ASSERT_TRUE(bank.command(2, 1, true));
  run_to(bank, 3);
  EXPECT_TRUE(bank.is_open(0));
  EXPECT_FALSE(bank.is_open(1));
  EXPECT_EQ(bank.on_time_s(0, 3), 2);
  EXPECT_EQ(bank.on_time_s(1, 3), 0.5);
}

TEST(ThrusterBank, nothing_fires_once_the_tank_is_empty) {
  Propellant gas;
  gas.specific_impulse_s = 100;
  gas.tank_kg = 3.0 / (100 * kStandardGravity_m_s2) * 5;  // 5 s of 3 N
  Thruster slow = thruster();
  slow.rise_s = 0.5;
  ThrusterBank bank({slow}, gas, 0);
  ASSERT_TRUE(bank.command(0, 0, true));
  run_to(bank, 5.2);
  EXPECT_FALSE(bank.is_empty());
  EXPECT_NEAR(bank.next_s(), 5.25, 1e-12);
  run_to(bank, 6);
  EXPECT_TRUE(bank.is_empty());
  EXPECT_TRUE(bank.torque_N_m().isZero(0));
  EXPECT_NEAR(bank.propellant_kg(10).value(), *gas.tank_kg, 1e-12 * *gas.tank_kg);
  ASSERT_TRUE(bank.command(7, 0, false));
  ASSERT_TRUE(bank.command(8, 0, true));
  EXPECT_TRUE(bank.torque_N_m().isZero(0));
}

TEST(ThrusterBank, noise_and_misalignment_are_drawn_by_the_seed) {
  Thruster rough = thruster();
  rough.noise = 0.05;
  rough.misalignment_rad = 0.01;
  const auto torques = [&](std::uint64_t seed) {
    ThrusterBank bank({rough, rough}, {}, seed);
    std::vector<double> seen;
    for (int i = 0; i < 50; ++i) {
      EXPECT_TRUE(bank.command(i, 0, true));
      seen.push_back(bank.torque_N_m()[0]);
      EXPECT_TRUE(bank.command(i + 0.5, 0, false));
    }
    return seen;
  };
  const auto seen = torques(1);
  EXPECT_EQ(seen, torques(1));
  EXPECT_NE(seen, torques(2));
  double mean = 0, square = 0;
  for (const double torque : seen) mean += torque / 50;
  for (const double torque : seen) square += (torque - mean) * (torque - mean) / 49;
  EXPECT_NEAR(mean, 6, 0.2);
  EXPECT_NEAR(std::sqrt(square), 0.3, 0.12);
}

TEST(ThrusterBank, a_copy_goes_on_alone) {
  Thruster slow = thruster();
  slow.rise_s = 1;
  ThrusterBank bank({slow}, {}, 0);
  ASSERT_TRUE(bank.command(0, 0, true));
  ThrusterBank copy(bank);
  ASSERT_TRUE(copy.command(0.5, 0, false));
  run_to(bank, 2);
  EXPECT_EQ(bank.level_at(0, 2), 1);
  EXPECT_EQ(copy.level_at(0, 2), 0);
}

}  // namespace
}  // namespace slew

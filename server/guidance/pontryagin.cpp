#include "server/guidance/pontryagin.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <array>
#include <cmath>

namespace slew {

namespace {

using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Vector7 = Eigen::Matrix<double, 7, 1>;

// Conditions of less than this relative size are none.
constexpr double kRankTolerance = 1e-9;
// Of the Hamiltonian, which is -1: less is rounding of the fit.
constexpr double kSignTolerance = 1e-6;

// The values that control i may take.
std::array<double, 3> values(const RigidManeuverPlant& plant, Eigen::Index i) {
  const double least = plant.least_control[i], most = plant.most_control[i];
  return {least, std::clamp(0.0, least, most), most};
}

// One point in time of one control: S = row . multipliers, and which control is flown.
struct Look {
  std::size_t control;
  double time_s;
  Vector7 row;  ///< the last entry is that of mu, times |u| - it is consumption
  double flown;
};

double excess(const RigidManeuverPlant& plant, const Look& look, const Vector7& multipliers, double* better) {
  const double s = look.row.head<6>().dot(multipliers.head<6>());
  const double price = look.row[6] * multipliers[6];
  const auto hamiltonian = [&](double u) { return s * u + price * std::abs(u); };
  double least = hamiltonian(look.flown);
  const double flown = least;
  *better = look.flown;
  for (const double u : values(plant, static_cast<Eigen::Index>(look.control)))
    if (hamiltonian(u) < least) least = hamiltonian(u), *better = u;
  return flown - least;
}

// Where the conditions leave multipliers free, those with the least sum of squared excesses: Newton on a
// convex function.
void choose_among_free(const RigidManeuverPlant& plant, const std::vector<Look>& looks,
                       ManeuverMultipliers& multipliers) {
  Vector7 m;
  m << multipliers.terminal, multipliers.consumption;
  const Eigen::Index n = multipliers.free.cols();
  for (int iteration = 0; iteration < 30; ++iteration) {
    Eigen::MatrixXd curvature = Eigen::MatrixXd::Zero(n, n);
    Eigen::VectorXd slope = Eigen::VectorXd::Zero(n);
    for (const Look& look : looks) {
      double better = 0;
      const double e = excess(plant, look, m, &better);
      if (e <= 0) continue;
      Vector7 change = look.row * (look.flown - better);
      change[6] = look.row[6] * (std::abs(look.flown) - std::abs(better));
      const Eigen::VectorXd along = multipliers.free.transpose() * change;
      curvature += along * along.transpose();
      slope += e * along;
    }
    if (slope.norm() < 1e-14) break;
    m -= multipliers.free * curvature.completeOrthogonalDecomposition().solve(slope);
    m[6] = std::max(m[6], 0.0);
  }
  multipliers.terminal = m.head<6>();
  multipliers.consumption = m[6];
}

// Of a free body as of one under moments that only its attitude makes, S_i'' = ... - r^T I^-1 (B_i x I^-1 B_j
// + B_j x I^-1 B_i) u_j, where r is the costate of the rate.
double least_clebsch(const ManeuverBody& body, const Eigen::Vector3d& costate,
                     const std::vector<Eigen::Index>& throttled) {
  const auto n = static_cast<Eigen::Index>(throttled.size());
  const Eigen::Vector3d turned = body.inverse * costate;
  Eigen::MatrixXd matrix(n, n);
  for (Eigen::Index a = 0; a < n; ++a)
    for (Eigen::Index b = 0; b < n; ++b) {
      const auto i = throttled[static_cast<std::size_t>(a)], j = throttled[static_cast<std::size_t>(b)];
      const Eigen::Vector3d bi = body.plant.influence_N_m.col(i), bj = body.plant.influence_N_m.col(j);
      matrix(a, b) =
          turned.dot(bi.cross(body.acceleration_rad_s2.col(j)) + bj.cross(body.acceleration_rad_s2.col(i)));
    }
  return Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues()[0];
}

// Throughout the middles of throttled segments.
void test_arcs(const ManeuverBody& body, const OnOffProgram& maneuver,
               const std::vector<Eigen::Vector3d>& rate_costates, SignTest& test) {
  const double square = maneuver.end_s * maneuver.end_s;
  for (std::size_t i = 0; i < maneuver.controls.size(); ++i)
    for (std::size_t k = 0; k < maneuver.controls[i].size(); ++k) {
      if (!is_throttled(body.plant, i, maneuver.controls[i][k])) continue;
      const std::vector<double>& times = maneuver.switch_times_s[i];
      test.throttled_s += (k == times.size() ? maneuver.end_s : times[k]) - (k == 0 ? 0 : times[k - 1]);
    }
  for (std::size_t p = 0; p + 1 < test.times_s.size(); ++p) {
    const double middle_s = 0.5 * (test.times_s[p] + test.times_s[p + 1]);
    std::vector<Eigen::Index> throttled;
    for (std::size_t i = 0; i < maneuver.controls.size(); ++i) {
      const std::vector<double>& times = maneuver.switch_times_s[i];
      const auto segment = std::upper_bound(times.begin(), times.end(), middle_s) - times.begin();
      if (is_throttled(body.plant, i, maneuver.controls[i][static_cast<std::size_t>(segment)]))
        throttled.push_back(static_cast<Eigen::Index>(i));
    }
    if (throttled.empty()) continue;
    for (const Eigen::Vector3d& costate : {rate_costates[p], rate_costates[p + 1]})
      test.legendre_clebsch =
          std::min(test.legendre_clebsch, square * least_clebsch(body, costate, throttled));
  }
}

}  // namespace

ManeuverMultipliers fit_multipliers(const SwitchTimeProgram& program, const OnOffProgram& maneuver,
                                    bool is_consumption_active) {
  const SwitchTimeProgram::Slopes slopes = program.slopes(maneuver);
  const Eigen::Index n = program.parameter_count();
  const Eigen::Index unknowns = is_consumption_active ? 7 : 6;
  Eigen::MatrixXd conditions(n, unknowns);
  conditions.leftCols(6) = slopes.error_slope.transpose();
  if (is_consumption_active) conditions.col(6) = slopes.consumption_slope;
  const Eigen::VectorXd right = -Eigen::VectorXd::Unit(n, program.time_at());
  // Rows and unknowns of like size: controls may differ by powers of ten in strength.
  Eigen::VectorXd rows = conditions.rowwise().norm().cwiseMax(1e-300);
  const Eigen::MatrixXd scaled = rows.cwiseInverse().asDiagonal() * conditions;
  const Eigen::VectorXd columns = scaled.colwise().norm().transpose().cwiseMax(1e-300);
  const Eigen::MatrixXd even = scaled * columns.cwiseInverse().asDiagonal();
  Eigen::JacobiSVD<Eigen::MatrixXd> svd(even, Eigen::ComputeFullU | Eigen::ComputeFullV);
  svd.setThreshold(kRankTolerance);
  const Eigen::VectorXd solved =
      columns.cwiseInverse().asDiagonal() * svd.solve(rows.cwiseInverse().asDiagonal() * right).eval();
  ManeuverMultipliers multipliers;
  multipliers.terminal = solved.head<6>();
  multipliers.consumption = is_consumption_active ? solved[6] : 0;
  multipliers.residual = (conditions * solved - right).lpNorm<Eigen::Infinity>();
  const Eigen::Index left = unknowns - svd.rank();
  multipliers.free = Eigen::MatrixXd::Zero(7, left);
  multipliers.free.topRows(unknowns) = columns.cwiseInverse().asDiagonal() * svd.matrixV().rightCols(left);
  for (Eigen::Index j = 0; j < left; ++j) multipliers.free.col(j).normalize();
  return multipliers;
}

SignTest test_signs(const ManeuverProblem& problem, const ManeuverBody& body,
                    const SwitchTimeProgram& program, const OnOffProgram& maneuver,
                    bool is_consumption_active, int steps) {
  SignTest test;
  test.multipliers = fit_multipliers(program, maneuver, is_consumption_active);
  OnOffFlight flight(body);
  flight.fly_finely(maneuver, problem.initial, maneuver.end_s / steps);
  const FlownPoint& end = flight.end();
  const TerminalError error({end.attitude, end.rate_rad_s}, problem.final);
  Matrix6 change = Matrix6::Zero();
  change.topLeftCorner<3, 3>() = error.attitude;
  change.bottomRightCorner<3, 3>() = program.reference_s() * Eigen::Matrix3d::Identity();
  const Matrix6 to_end = program.reference_s() * change * end.transition;

  // Looks lie in the order of time, control after control; a switch is looked at from before and from after.
  const std::size_t controls = maneuver.controls.size();
  std::vector<std::vector<Look>> looks(controls);
  std::vector<std::size_t> segment(controls, 0);
  std::vector<Look> all;
  std::vector<Eigen::Matrix<double, 6, 3>> responses;
  for (std::size_t p = 0; p < flight.points().size(); ++p) {
    const FlownPoint& point = flight.points()[p];
    const Eigen::Matrix<double, 6, 3> response =
        to_end * inverse_transition(point.transition, body.plant.is_free()).rightCols<3>();
    test.times_s.push_back(point.time_s);
    if (program.levels() > 0) responses.push_back(response);
    Eigen::VectorXd switching(controls);
    for (std::size_t i = 0; i < controls; ++i) {
      Look look{i, point.time_s, Vector7::Zero(), 0};
      const auto column = static_cast<Eigen::Index>(i);
      look.row.head<6>() = response * body.acceleration_rad_s2.col(column);
      look.row[6] = body.plant.consumption(column);
      const auto& times = maneuver.switch_times_s[i];
      look.flown = maneuver.controls[i][segment[i]];
      looks[i].push_back(look);
      while (segment[i] < times.size() && times[segment[i]] <= point.time_s) {
        ++segment[i];
        look.flown = maneuver.controls[i][segment[i]];
        looks[i].push_back(look);
      }
    }
  }
  if (test.multipliers.free.cols() > 0) {
    for (const auto& of_control : looks) all.insert(all.end(), of_control.begin(), of_control.end());
    choose_among_free(body.plant, all, test.multipliers);
  }
  Vector7 m;
  m << test.multipliers.terminal, test.multipliers.consumption;
  if (program.levels() > 0) {
    std::vector<Eigen::Vector3d> rate_costates;
    rate_costates.reserve(responses.size());
    for (const auto& response : responses)
      rate_costates.emplace_back(response.transpose() * test.multipliers.terminal);
    test_arcs(body, maneuver, rate_costates, test);
  }
  for (std::size_t p = 0; p < test.times_s.size(); ++p) test.switching.emplace_back(controls);
  for (std::size_t i = 0; i < controls; ++i) {
    std::size_t p = 0;
    double best_in_interval = 0;
    std::optional<SignViolation> open;
    const auto close = [&] {
      if (open && open->to_s > open->from_s) {
        test.violations.push_back(*open);
        test.violating_s += open->to_s - open->from_s;
        test.saving_s += open->saving_s;
      }
      open.reset();
    };
    for (std::size_t k = 0; k < looks[i].size(); ++k) {
      const Look& look = looks[i][k];
      if (p < test.times_s.size() && test.times_s[p] == look.time_s)
        test.switching[p++][static_cast<Eigen::Index>(i)] = look.row.head<6>().dot(m.head<6>());
      double better = 0;
      const double e = excess(body.plant, look, m, &better);
      test.worst = std::max(test.worst, e);
      const double before = k > 0 ? looks[i][k - 1].time_s : 0;
      if (e <= kSignTolerance || (open && (better != open->value || look.flown != looks[i][k - 1].flown)))
        close();
      if (e <= kSignTolerance) continue;
      if (!open) {
        open = SignViolation{i, look.time_s, look.time_s, better, 0, look.time_s};
        best_in_interval = e;
      }
      open->saving_s += e * (look.time_s - std::max(before, open->from_s));
      open->to_s = look.time_s;
      if (e > best_in_interval) best_in_interval = e, open->peak_s = look.time_s;
    }
    close();
  }
  return test;
}

}  // namespace slew

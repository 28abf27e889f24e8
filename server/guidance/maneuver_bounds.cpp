#include "server/guidance/maneuver_bounds.hpp"

#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

namespace slew {

namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Over the corners of the control's box, the largest |m u|.
double largest_image(const Eigen::Matrix3Xd& m, const RigidManeuverPlant& plant) {
  const Eigen::Index n = plant.controls();
  if (n > 16) {  // a bound will do
    double sum = 0;
    for (Eigen::Index i = 0; i < n; ++i)
      sum += m.col(i).norm() * std::max(std::abs(plant.least_control[i]), std::abs(plant.most_control[i]));
    return sum;
  }
  double largest = 0;
  for (unsigned corner = 0; corner < (1U << n); ++corner) {
    Eigen::Vector3d image = Eigen::Vector3d::Zero();
    for (Eigen::Index i = 0; i < n; ++i)
      image += m.col(i) * ((corner >> i & 1U) ? plant.most_control[i] : plant.least_control[i]);
    largest = std::max(largest, image.norm());
  }
  return largest;
}

bool is_from_rest_to_rest(const ManeuverProblem& problem) {
  return problem.initial.rate_rad_s.isZero() && problem.final.rate_rad_s.isZero();
}

Eigen::Vector3d momentum(const RigidManeuverPlant& plant, const RigidState& state) {
  return rotation_matrix_of<double>(state.attitude).transpose() * (plant.inertia_kg_m2 * state.rate_rad_s);
}

// The largest a with a effort + hold within the controls' bounds; negative where there is none.
double largest_within(const RigidManeuverPlant& plant, const Eigen::VectorXd& effort,
                      const Eigen::VectorXd& hold, double sign) {
  double least = 0, most = kInfinity;
  for (Eigen::Index i = 0; i < effort.size(); ++i) {
    const double slope = sign * effort[i];
    const double low = plant.least_control[i] - hold[i], high = plant.most_control[i] - hold[i];
    if (std::abs(slope) < 1e-14) {
      if (low > 0 || high < 0) return -1;
      continue;
    }
    least = std::max(least, std::min(low / slope, high / slope));
    most = std::min(most, std::max(low / slope, high / slope));
  }
  return most >= least ? most : -1;
}

std::string text(double value) {
  std::ostringstream stream;
  stream.precision(6);
  stream << value;
  return stream.str();
}

}  // namespace

Eigenaxis eigenaxis(const Vector4<double>& from, const Vector4<double>& to) {
  Vector4<double> q = euler_parameter_product<double>(euler_parameter_conjugate(from), to);
  if (q[0] < 0) q = -q;
  const double sine = q.tail<3>().norm();
  if (sine < 1e-12) return {Eigen::Vector3d::UnitX(), 0};
  return {q.tail<3>() / sine, 2 * std::atan2(sine, q[0])};
}

EigenaxisManeuver eigenaxis_maneuver(const ManeuverBody& body, const Eigenaxis& eigenaxis) {
  const RigidManeuverPlant& plant = body.plant;
  EigenaxisManeuver maneuver;
  maneuver.eigenaxis = eigenaxis;
  const Eigen::Vector3d l = eigenaxis.axis, momentum_per_rate = plant.inertia_kg_m2 * l;
  const auto solver = plant.influence_N_m.completeOrthogonalDecomposition();
  maneuver.effort_s2 = solver.solve(momentum_per_rate);
  maneuver.effort_s2.cwiseAbs().maxCoeff(&maneuver.critical);
  // Bounds that are not +-1 count in units of themselves.
  double largest = 0;
  for (Eigen::Index i = 0; i < plant.controls(); ++i) {
    const double bound =
        std::max(1e-300, std::min(std::abs(plant.least_control[i]), std::abs(plant.most_control[i])));
    const double needed = std::abs(maneuver.effort_s2[i]) / bound;
    if (needed > largest * (1 + 1e-12)) largest = needed, maneuver.critical = i;
    const double along = l.dot(plant.influence_N_m.col(i));
    maneuver.boldest_rad_s2 += std::max(along * plant.least_control[i], along * plant.most_control[i]);
  }
  maneuver.boldest_rad_s2 /= l.dot(momentum_per_rate);
  maneuver.synthetic_s = 2 * std::sqrt(eigenaxis.angle_rad * largest);

  // dw/dangle = a/w while accelerating and, from the end backwards, the same with the braking controls: the
  // rates meet where the energy of both is the same. With e = w^2/2, de/dangle = a(e).
  maneuver.hold = solver.solve(l.cross(momentum_per_rate));
  constexpr int kSteps = 4000;
  const double step = eigenaxis.angle_rad / kSteps;
  std::vector<double> up(kSteps + 1, 0.0), down(kSteps + 1, 0.0);
  const auto climb = [&](std::vector<double>& energy, double sign) {
    for (int k = 0; k < kSteps; ++k) {
      const auto at = [&](double e) {
        return std::max(0.0, largest_within(plant, maneuver.effort_s2, 2 * e * maneuver.hold, sign));
      };
      const double first = at(energy[k]);
      energy[k + 1] = energy[k] + step * at(energy[k] + 0.5 * step * first);
    }
  };
  climb(up, 1);
  climb(down, -1);
  // dt = 2 dangle / (w_k + w_k+1), exact for a constant acceleration.
  maneuver.times_s = {0};
  maneuver.rates_rad_s = {0};
  for (int k = 0; k < kSteps; ++k) {
    const double w0 = std::sqrt(2 * std::min(up[k], down[kSteps - k]));
    const double w1 = std::sqrt(2 * std::min(up[k + 1], down[kSteps - k - 1]));
    maneuver.time_s += w0 + w1 > 0 ? 2 * step / (w0 + w1) : kInfinity;
    maneuver.times_s.push_back(maneuver.time_s);
    maneuver.rates_rad_s.push_back(w1);
  }
  if (eigenaxis.angle_rad == 0) maneuver.time_s = 0;
  return maneuver;
}

double least_time_s(const ManeuverProblem& problem) {
  if (!problem.plant.is_free() || !is_from_rest_to_rest(problem)) return 0;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(problem.plant.inertia_kg_m2);
  const double angle = eigenaxis(problem.initial.attitude, problem.final.attitude).angle_rad;
  const Eigen::Matrix3Xd scaled = principal.operatorInverseSqrt() * problem.plant.influence_N_m;
  const double by_energy =
      2 * std::sqrt(angle * std::sqrt(principal.eigenvalues()[0]) / largest_image(scaled, problem.plant));
  if (!problem.most_rate_rad_s) return by_energy;
  return std::max(by_energy, angle / problem.most_rate_rad_s->norm());
}

double least_consumption(const ManeuverProblem& problem) {
  const RigidManeuverPlant& plant = problem.plant;
  if (!plant.is_free()) return 0;
  // Momentum for what is consumed, at best.
  double best = 0;
  for (Eigen::Index i = 0; i < plant.controls(); ++i) {
    if (!(plant.consumption(i) > 0)) return 0;
    best = std::max(best, plant.influence_N_m.col(i).norm() / plant.consumption(i));
  }
  double least = (momentum(plant, problem.final) - momentum(plant, problem.initial)).norm() / best;
  if (problem.longest_s && is_from_rest_to_rest(problem)) {
    // |h(t)| is at most what was consumed so far, and at most what will be: half of all.
    const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> principal(plant.inertia_kg_m2);
    const double angle = eigenaxis(problem.initial.attitude, problem.final.attitude).angle_rad;
    least = std::max(least, 2 * angle * principal.eigenvalues()[0] / (best * *problem.longest_s));
  }
  return least;
}

std::vector<ManeuverFault> maneuver_faults(const ManeuverProblem& problem) {
  std::vector<ManeuverFault> faults;
  const RigidManeuverPlant& plant = problem.plant;
  const auto fault = [&](std::string field, std::string what, std::string given, std::string allowed) {
    faults.push_back({std::move(field), std::move(what), std::move(given), std::move(allowed)});
  };
  const Eigen::Index n = plant.controls();
  if (!plant.inertia_kg_m2.allFinite() ||
      !plant.inertia_kg_m2.isApprox(plant.inertia_kg_m2.transpose(), 1e-9)) {
    fault("plant/inertia_kg_m2", "must be symmetric and finite", "", "a symmetric matrix");
  } else {
    const Eigen::Vector3d principal =
        Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(plant.inertia_kg_m2).eigenvalues();
    if (!(principal[0] > 0))
      fault("plant/inertia_kg_m2", "must be positive definite",
            text(principal[0]) + " as least principal moment", "more than 0");
    else if (principal[2] > (principal[0] + principal[1]) * (1 + 1e-9))
      fault("plant/inertia_kg_m2", "is of no body: one principal moment exceeds the sum of the others",
            text(principal[2]), "at most " + text(principal[0] + principal[1]));
  }
  if (n < 1 || n > 12)
    fault("plant/influence_N_m", "must have 1 to 12 columns", std::to_string(n), "1 to 12");
  if (plant.least_control.size() != n || plant.most_control.size() != n) {
    fault("plant/least_control", "one bound of each control is needed",
          std::to_string(plant.least_control.size()), std::to_string(n));
    return faults;
  }
  if (!plant.influence_N_m.allFinite()) fault("plant/influence_N_m", "must be finite", "", "finite numbers");
  for (Eigen::Index i = 0; i < n; ++i)
    if (!(plant.least_control[i] < plant.most_control[i]) || !(plant.least_control[i] <= 0) ||
        !(plant.most_control[i] >= 0) || !std::isfinite(plant.least_control[i]) ||
        !std::isfinite(plant.most_control[i]))
      fault("plant/least_control/" + std::to_string(i), "zero must lie between the bounds, which differ",
            text(plant.least_control[i]) + " to " + text(plant.most_control[i]), "least <= 0 <= most");
  for (Eigen::Index i = 0; i < plant.consumption_1_s.size(); ++i)
    if (!(plant.consumption_1_s[i] >= 0) || !std::isfinite(plant.consumption_1_s[i]))
      fault("plant/consumption_1_s/" + std::to_string(i), "must be finite and not negative",
            text(plant.consumption_1_s[i]), "0 or more");
  if (plant.weight && !(plant.weight->centre_m.allFinite() && std::isfinite(plant.weight->mass_kg) &&
                        std::isfinite(plant.weight->gravity_m_s2)))
    fault("plant/weight", "must be finite", "", "finite numbers");
  for (const auto& [name, state] :
       {std::pair{"initial", &problem.initial}, std::pair{"final", &problem.final}}) {
    if (!state->attitude.allFinite() || std::abs(state->attitude.norm() - 1) > 1e-9)
      fault(std::string(name) + "/attitude", "must be of norm 1", text(state->attitude.norm()), "1");
    if (!state->rate_rad_s.allFinite())
      fault(std::string(name) + "/rate_rad_s", "must be finite", "", "finite numbers");
    if (problem.most_rate_rad_s &&
        !(state->rate_rad_s.array().abs() <= problem.most_rate_rad_s->array()).all())
      fault(std::string(name) + "/rate_rad_s", "is beyond the limit on rates", text(state->rate_rad_s.norm()),
            "within most_rate_rad_s");
  }
  if (problem.most_rate_rad_s && !(problem.most_rate_rad_s->minCoeff() > 0))
    fault("most_rate_rad_s", "must be more than 0", text(problem.most_rate_rad_s->minCoeff()), "more than 0");
  if (problem.longest_s && !(*problem.longest_s > 0))
    fault("longest_s", "must be more than 0", text(*problem.longest_s), "more than 0");
  if (!faults.empty()) return faults;

  Eigen::JacobiSVD<Eigen::MatrixXd> svd(plant.influence_N_m, Eigen::ComputeFullU);
  svd.setThreshold(1e-9);
  if (svd.rank() < 3) {
    const Eigen::Vector3d axis = svd.matrixU().col(2);
    fault("plant/influence_N_m", "gives no torque about an axis",
          "rank " + std::to_string(svd.rank()) + ", none about (" + text(axis[0]) + ", " + text(axis[1]) +
              ", " + text(axis[2]) + ")",
          "rank 3");
    return faults;
  }
  // Controls that push one way only must together push every way: some u > 0 with B u = 0 inside.
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {1.0, -1.0}) {
      double push = 0;
      for (Eigen::Index i = 0; i < n; ++i) {
        const double along = sign * plant.influence_N_m(axis, i);
        push += std::max(along * plant.least_control[i], along * plant.most_control[i]);
      }
      if (!(push > 0))
        fault("plant/influence_N_m", "gives torque about an axis one way only",
              "axis " + std::to_string(axis + 1), "both ways about every axis");
    }
  const double shortest = least_time_s(problem);
  if (problem.longest_s && *problem.longest_s < shortest)
    fault("longest_s", "no maneuver is that short", text(*problem.longest_s), "more than " + text(shortest));
  if (problem.most_consumption) {
    const bool is_still = eigenaxis(problem.initial.attitude, problem.final.attitude).angle_rad == 0 &&
                          is_from_rest_to_rest(problem);
    const double least = least_consumption(problem);
    if (!std::isfinite(*problem.most_consumption) || *problem.most_consumption < least ||
        (*problem.most_consumption <= 0 && !is_still))
      fault("most_consumption", "no maneuver consumes so little", text(*problem.most_consumption),
            least > 0 ? "more than " + text(least) : "more than 0");
  }

  // Parameters of the smooth families.
  const auto is_one_each = [&](std::size_t size) { return size == 0 || size == static_cast<std::size_t>(n); };
  if (!is_one_each(problem.switches.size()) || !is_one_each(problem.smoothness.size()) ||
      !is_one_each(problem.t1.size()) || !is_one_each(problem.sequences.size()) ||
      !is_one_each(problem.switch_starts_s.size()))
    fault("switches", "one entry of each control is needed", "", std::to_string(n));
  for (const int count : problem.switches)
    if (count < 0 || count > 4)
      fault("switches", "must be 0 to 4 in a smooth family", std::to_string(count), "0 to 4");
  for (const double alpha : problem.smoothness)
    if (!(alpha > 0) || !std::isfinite(alpha))
      fault("smoothness", "must be more than 0", text(alpha), "more than 0");
  if (!(problem.least_smoothness > 0))
    fault("least_smoothness", "must be more than 0", text(problem.least_smoothness), "more than 0");
  if (!(problem.rise > 0 && problem.rise <= 0.5))
    fault("rise", "must be in (0, 0.5]", text(problem.rise), "(0, 0.5]");
  for (const double t1 : problem.t1)
    if (!(t1 > 0 && t1 <= 0.25)) fault("t1", "must be in (0, 0.25]", text(t1), "(0, 0.25]");
  if (!(problem.least_t1 > 0 && problem.most_t1 <= 0.25 && problem.least_t1 <= problem.most_t1))
    fault("least_t1", "0 < least_t1 <= most_t1 <= 0.25", text(problem.least_t1), "(0, 0.25]");
  for (const SwitchSequence& sequence : problem.sequences) {
    if (sequence.empty() || sequence.size() > 12)
      fault("sequences", "1 to 12 segments of each control", std::to_string(sequence.size()), "1 to 12");
    for (std::size_t k = 0; k < sequence.size(); ++k)
      if (std::abs(sequence[k]) > 1 || (k > 0 && sequence[k] == sequence[k - 1]))
        fault("sequences", "-1, 0 or 1, each other than the one before", std::to_string(sequence[k]),
              "-1, 0, 1");
  }
  for (const ProfileParameter& parameter : problem.parameters)
    if (!std::isfinite(parameter.start) || !(parameter.least <= parameter.most))
      fault("parameters", "finite, and least <= most", text(parameter.start), "finite numbers");
  if (problem.time_start_s && !(*problem.time_start_s > 0 && std::isfinite(*problem.time_start_s)))
    fault("time_start_s", "must be more than 0", text(*problem.time_start_s), "more than 0");
  return faults;
}

}  // namespace slew

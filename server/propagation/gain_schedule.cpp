#include "server/propagation/gain_schedule.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <new>
#include <stdexcept>
#include <string>

#include "server/propagation/erk_solver.hpp"

namespace slew {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

int covariance_rate(sunrealtype, N_Vector state, N_Vector slope, void* filter_of) {
  const auto& filter = *static_cast<const ElasticFilter*>(filter_of);
  const Index n = filter.size();
  const MatrixXd covariance = Eigen::Map<const MatrixXd>(NV_DATA_S(state), n, n);
  MatrixXd rate;
  filter.covariance_rate(covariance, rate);
  Eigen::Map<MatrixXd>(NV_DATA_S(slope), n, n) = rate;
  return 0;
}

}  // namespace

// Errors of P die out as twice the slowest motion, or faster where it is seen, and an explicit step is
// bounded by the sum of two of the fastest.
void check_filter_work(const ElasticFilter& filter, double until_s) {
  constexpr double kToDieOut = 25, kStable = 2;
  const Eigen::VectorXcd motions = filter.state.eigenvalues();
  const double slowest = motions.real().cwiseAbs().minCoeff();
  const double length_s = 2 * slowest * until_s > kToDieOut ? 0.5 * kToDieOut / slowest : until_s;
  const double steps = length_s * 2 * motions.cwiseAbs().maxCoeff() / kStable;
  if (steps * std::pow(static_cast<double>(filter.size()), 3) > kMostFilterWork)
    throw std::domain_error("the filter's Riccati equation would take " +
                            std::to_string(std::llround(steps)) + " steps of " +
                            std::to_string(filter.size()) +
                            " states squared: the design model has motions that are too fast, or too many");
}

GainSchedule::GainSchedule(const ElasticFilter& filter, double until_s, double relative_tolerance) {
  const Index n = filter.size();
  const MatrixXd steady = steady_covariance(filter);
  steady_ = steady * filter.output.transpose() / filter.intensities.measurement;
  ErkSolver solver;
  solver.state = N_VNew_Serial(static_cast<sunindextype>(n * n), solver.context);
  if (!solver.state) throw std::bad_alloc();
  Eigen::Map<MatrixXd> covariance(NV_DATA_S(solver.state), n, n);
  covariance = filter.initial_covariance();
  solver.memory = ERKStepCreate(&covariance_rate, 0.0, solver.state, solver.context);
  if (!solver.memory) throw std::bad_alloc();
  // What is asked of it is an unchanging function of the filter.
  check_sundials(ERKStepSetUserData(solver.memory, const_cast<ElasticFilter*>(&filter)),
                 "ERKStepSetUserData");
  check_sundials(ERKStepSetTableNum(solver.memory, ARKODE_DORMAND_PRINCE_7_4_5), "ERKStepSetTableNum");
  check_sundials(ERKStepSStolerances(solver.memory, relative_tolerance,
                                     relative_tolerance * steady.cwiseAbs().maxCoeff()),
                 "ERKStepSStolerances");
  check_sundials(ERKStepSetMaxNumSteps(solver.memory, 10000000), "ERKStepSetMaxNumSteps");
  check_sundials(ERKStepSetStopTime(solver.memory, until_s), "ERKStepSetStopTime");
  keep(filter, 0, covariance);
  // Far more than were expected: its motions are faster than they seemed.
  const double most = 4 * kMostFilterWork / std::pow(static_cast<double>(n), 3);
  sunrealtype t_s = 0;
  while (t_s < until_s) {
    check_sundials(ERKStepEvolve(solver.memory, until_s, solver.state, &t_s, ARK_ONE_STEP), "ERKStepEvolve");
    keep(filter, t_s, covariance);
    if (static_cast<double>(times_s_.size()) > most)
      throw std::domain_error("the filter's Riccati equation takes too many steps");
    if ((covariance - steady).norm() <= 0.1 * relative_tolerance * steady.norm()) break;
  }
}

// P'' = F P' + P' F^T, F = A - P C^T C / Qm.
void GainSchedule::keep(const ElasticFilter& filter, double t_s, const MatrixXd& covariance) {
  MatrixXd rate;
  filter.covariance_rate(covariance, rate);
  const MatrixXd seen = filter.output.transpose() / filter.intensities.measurement;
  const MatrixXd turned = (filter.state - covariance * seen * filter.output) * rate;
  times_s_.push_back(t_s);
  gains_.push_back(covariance * seen);
  slopes_.push_back(rate * seen);
  curvatures_.push_back((turned + turned.transpose()) * seen);
}

void GainSchedule::gain_at(double t_s, MatrixXd& gain) const {
  if (t_s >= times_s_.back()) {
    gain = gains_.back();
    return;
  }
  const auto above = std::upper_bound(times_s_.begin(), times_s_.end(), t_s);
  const auto i = static_cast<std::size_t>(std::max<std::ptrdiff_t>(above - times_s_.begin() - 1, 0));
  const double h = times_s_[i + 1] - times_s_[i], s = (t_s - times_s_[i]) / h, r = 1 - s;
  const double s3 = s * s * s, r3 = r * r * r;
  gain.noalias() = r3 * (1 + 3 * s + 6 * s * s) * gains_[i] + s3 * (1 + 3 * r + 6 * r * r) * gains_[i + 1] +
                   h * (r3 * s * (1 + 3 * s) * slopes_[i] - s3 * r * (1 + 3 * r) * slopes_[i + 1]) +
                   0.5 * h * h * (r3 * s * s * curvatures_[i] + s3 * r * r * curvatures_[i + 1]);
}

}  // namespace slew

#include "server/simulation/structure_loop.hpp"

#include <utility>

namespace slew {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using ConstVector = Eigen::Map<const VectorXd>;
using Vector = Eigen::Map<VectorXd>;

StructureLoop::StructureLoop(std::shared_ptr<const StructureSystem> system)
    : system_(std::move(system)),
      size_(2 * system_->plant.size() + 2 * system_->tracked() + system_->filtered()),
      process_noise_(VectorXd::Zero(system_->plant.elastic())),
      sensor_noise_(VectorXd::Zero(system_->sensors.rows())),
      u_(VectorXd::Zero(system_->plant_dynamics.inputs())) {
  if (!system_->controller) return;
  const StructureController& controller = *system_->controller;
  const Index k = controller.filter.size(), n = controller.tracking.modes();
  tracked_acceleration_ = VectorXd::Zero(n);
  estimate_ = VectorXd::Zero(12 + k);
  innovation_ = VectorXd::Zero(controller.filter.sensors());
  correction_ = law_correction_ = VectorXd::Zero(k);
  desired_ = VectorXd::Zero(3 * n);
  gain_ = MatrixXd::Zero(k, controller.filter.sensors());
  of_controls_ = MatrixXd::Zero(u_.size(), size_);
  seen_ = MatrixXd::Zero(k, size_);
}

// What sensors, filter and tracking model make of y, and the controls:
// u = -(estimate z^ + elastic L (y - C z^_f + C z_df) - tracked [x_d; x_d'; x_d''] + G D).
void StructureLoop::see(double t_s, const double* y) {
  slew_ = system_->command.at(t_s);
  if (!system_->controller) return;
  const StructureController& controller = *system_->controller;
  const TrackingLaw& law = controller.law;
  const Index p = plant(), n = controller.tracking.modes(), k = controller.filter.size();
  const ConstVector z(y, 2 * p), tracked(y + tracking_at(), 2 * n), filtered(y + filter_at(), k);

  tracked_acceleration_ =
      controller.tracking.acceleration(tracked.head(n), tracked.tail(n), slew_.acceleration_rad_s2);
  innovation_.noalias() = system_->sensors * z;
  innovation_.noalias() -= controller.filter.output * filtered;
  innovation_ += sensor_noise_;
  controller.gains->gain_at(t_s, gain_);
  correction_.noalias() = gain_ * innovation_;
  innovation_.noalias() += law.innovation_of_tracked * tracked;
  law_correction_.noalias() = gain_ * innovation_;

  estimate_ << z.head(6), filtered.head(k / 2), z.segment(p, 6), filtered.tail(k / 2);
  desired_ << tracked, tracked_acceleration_;
  u_.setZero();
  u_.noalias() -= law.estimate * estimate_;
  u_.noalias() -= law.elastic * law_correction_;
  u_.noalias() += law.tracked * desired_;
  u_ -= law.tangential_load * slew_.acceleration_rad_s2 +
        law.centrifugal_load * (slew_.rate_rad_s * slew_.rate_rad_s);
}

const VectorXd& StructureLoop::controls(double t_s, const double* y) {
  see(t_s, y);
  return u_;
}

void StructureLoop::slope(double t_s, const double* y, double* rate) {
  see(t_s, y);
  const StructureDynamics& dynamics = system_->plant_dynamics;
  const Index p = plant();
  const ConstVector z(y, p), v(y + p, p);
  const double acceleration = slew_.acceleration_rad_s2, square = slew_.rate_rad_s * slew_.rate_rad_s;
  Vector(rate, p) = v;
  Vector a(rate + p, p);
  a.setZero();
  a.noalias() -= dynamics.stiffness * z;
  a.noalias() -= dynamics.damping * v;
  if (acceleration != 0) a.noalias() -= (acceleration * dynamics.tangential) * z;
  if (square != 0) {
    a.noalias() -= (square * dynamics.centrifugal) * z;
    a.noalias() -= (slew_.rate_rad_s * dynamics.gyroscopic) * v;
  }
  a -= dynamics.tangential_load * acceleration + dynamics.centrifugal_load * square;
  a.tail(p - 6) += process_noise_;
  if (!system_->controller) return;
  a.noalias() += dynamics.input * u_;

  const StructureController& controller = *system_->controller;
  const Index n = controller.tracking.modes(), k = controller.filter.size();
  const ConstVector tracked(y + tracking_at(), 2 * n), filtered(y + filter_at(), k);
  Vector(rate + tracking_at(), n) = tracked.tail(n);
  Vector(rate + tracking_at() + n, n) = tracked_acceleration_;
  Vector estimated(rate + filter_at(), k);
  estimated = correction_;
  estimated.noalias() += controller.filter.state * filtered;
  estimated.noalias() += controller.input * u_;
  estimated += controller.known_loads.col(0) * acceleration + controller.known_loads.col(1) * square;
}

void StructureLoop::jacobian(double t_s, double* matrix) {
  slew_ = system_->command.at(t_s);
  const StructureDynamics& dynamics = system_->plant_dynamics;
  const Index p = plant();
  Eigen::Map<MatrixXd> j(matrix, size_, size_);
  j.setZero();
  j.block(0, p, p, p).setIdentity();
  const double acceleration = slew_.acceleration_rad_s2, rate = slew_.rate_rad_s;
  j.block(p, 0, p, p) =
      -(dynamics.stiffness + acceleration * dynamics.tangential + rate * rate * dynamics.centrifugal);
  j.block(p, p, p, p) = -(dynamics.damping + rate * dynamics.gyroscopic);
  if (!system_->controller) return;

  const StructureController& controller = *system_->controller;
  const TrackingLaw& law = controller.law;
  const Index n = controller.tracking.modes(), k = controller.filter.size(), at_t = tracking_at(),
              at_f = filter_at();
  controller.gains->gain_at(t_s, gain_);
  seen_.setZero();  // L (y - C z^_f), for each of y
  seen_.leftCols(2 * p).noalias() = gain_ * system_->sensors;
  seen_.rightCols(k).noalias() -= gain_ * controller.filter.output;

  of_controls_.setZero();
  of_controls_.leftCols(6) = -law.estimate.leftCols(6);
  of_controls_.middleCols(p, 6) = -law.estimate.middleCols(6 + k / 2, 6);
  of_controls_.middleCols(at_f, k / 2) = -law.estimate.middleCols(6, k / 2);
  of_controls_.rightCols(k / 2) = -law.estimate.rightCols(k / 2);
  of_controls_.noalias() -= law.elastic * seen_;
  for (Index mode = 0; mode < n; ++mode) {
    const double w = controller.tracking.frequency_rad_s[mode],
                 damping = 2 * controller.tracking.damping_ratio[mode] * w;
    j(at_t + mode, at_t + n + mode) = 1;
    j(at_t + n + mode, at_t + mode) = -w * w;
    j(at_t + n + mode, at_t + n + mode) = -damping;
    of_controls_.col(at_t + mode) += law.tracked.col(mode) - w * w * law.tracked.col(2 * n + mode);
    of_controls_.col(at_t + n + mode) += law.tracked.col(n + mode) - damping * law.tracked.col(2 * n + mode);
  }
  seen_.middleCols(at_t, 2 * n).noalias() = gain_ * law.innovation_of_tracked;
  of_controls_.middleCols(at_t, 2 * n).noalias() -= law.elastic * seen_.middleCols(at_t, 2 * n);
  seen_.middleCols(at_t, 2 * n).setZero();  // the law's, not the filter's

  j.middleRows(p, p).noalias() += dynamics.input * of_controls_;
  j.bottomRows(k) = seen_;
  j.block(at_f, at_f, k, k) += controller.filter.state;
  j.bottomRows(k).noalias() += controller.input * of_controls_;
}

}  // namespace slew

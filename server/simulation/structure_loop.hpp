// The closed loop of a structure as one system of first order: y = [z, z', x_d, x_d', z^_f, z^_f'], linear in
// y, with coefficients that follow the command and the filter's gains. Its slope, its Jacobian, its controls.
#pragma once

#include <memory>
#include <span>

#include "server/simulation/structure_system.hpp"

namespace slew {

class StructureLoop {
 public:
  explicit StructureLoop(std::shared_ptr<const StructureSystem> system);

  Eigen::Index size() const { return size_; }
  const StructureSystem& system() const { return *system_; }

  /// Numbers of white noise that are held from now on.
  void hold_process_noise(const Eigen::VectorXd& acceleration) { process_noise_ = acceleration; }
  void hold_sensor_noise(const Eigen::VectorXd& noise) { sensor_noise_ = noise; }

  /// y' and, on the way, the controls. Not const: everything between is kept in place.
  void slope(double t_s, const double* y, double* rate);
  /// u at y; one for each actuator.
  const Eigen::VectorXd& controls(double t_s, const double* y);
  /// dy'/dy, column by column.
  void jacobian(double t_s, double* matrix);

  // Where the parts of y begin.
  Eigen::Index plant() const { return system_->plant.size(); }
  Eigen::Index tracking_at() const { return 2 * plant(); }
  Eigen::Index filter_at() const { return 2 * plant() + 2 * system_->tracked(); }

 private:
  void see(double t_s, const double* y);

  std::shared_ptr<const StructureSystem> system_;
  Eigen::Index size_;
  Eigen::VectorXd process_noise_, sensor_noise_;
  // In between, kept so that a step allocates nothing.
  SlewState slew_;
  Eigen::VectorXd tracked_acceleration_, estimate_, innovation_, correction_, law_correction_, desired_, u_;
  Eigen::MatrixXd gain_, of_controls_, seen_;
};

}  // namespace slew

// What is measured on a slew of a flexible structure, step by step of its solver.
#pragma once

#include <span>

#include "server/simulation/metrics.hpp"
#include "server/simulation/structure_loop.hpp"
#include "server/simulation/structure_piece.hpp"

namespace slew {

class StructureMeter {
 public:
  explicit StructureMeter(const StructureSpecification& specification);

  /// Steps in the order of time, each beginning where the last ended.
  void step(const StructurePiece& piece, StructureLoop& loop);
  /// All of it, at the end of the run or so far; `y` is the state there.
  Metrics finish(double t_s, const double* y) const;

 private:
  /// The three axes of one quantity.
  struct Watched {
    std::array<double, 3> peak_rad{}, residual_rad{};
    double outside_until_s = 0;  ///< the origin of the run where it never was
    bool is_outside = false;
  };
  void watch(Watched& watched, std::span<const Quintic> axes, const StructurePiece& piece) const;
  Quintic hub_error(const StructurePiece& piece) const;
  AntennaRotation rotation(const Watched& watched) const;

  const std::shared_ptr<const StructureSystem> system_;
  const StructureSettling settling_;
  const double duration_s_, angle_rad_;
  std::vector<std::pair<std::string, bool>> groups_;  ///< name, and whether of torques
  std::vector<std::size_t> group_of_;                 ///< of each actuator
  std::vector<std::array<std::size_t, 2>> members_;
  std::vector<std::array<double, 3>> nodes_;

  Watched pointing_, relative_, hub_;
  std::vector<double> effort_;  ///< of each actuator
  double impulse_N_m_s_ = 0, peak_rate_rad_s_ = 0;
  double shape_s_ = 0, farthest_rad_ = -1;
  Eigen::VectorXd shape_;    ///< z of the plant then
  Eigen::VectorXd scratch_;  ///< a state
};

}  // namespace slew

#include "server/simulation/structure_metrics.hpp"

#include <algorithm>
#include <cmath>

namespace slew {
namespace {

using Eigen::Index;

/// Places in a step at which its polynomials are looked at for extrema and crossings.
constexpr int kPlaces = 8;
constexpr double kLastSeconds = 1;  ///< of the residual

constexpr std::array<std::array<double, 2>, 4> kGauss{{{0.06943184420297371, 0.17392742256872692},
                                                       {0.33000947820757187, 0.32607257743127307},
                                                       {0.6699905217924281, 0.32607257743127307},
                                                       {0.9305681557970263, 0.17392742256872692}}};

/// The greatest size of a parabola through three places h apart, whose middle one is the greatest of them.
double vertex(double before, double here, double after) {
  const double bend = before - 2 * here + after;
  const double slope = 0.5 * (after - before);
  return bend < 0 ? here - 0.5 * slope * slope / bend : here;
}

}  // namespace

StructureMeter::StructureMeter(const StructureSpecification& spec)
    : system_(spec.system),
      settling_(spec.settling),
      duration_s_(spec.duration_s),
      angle_rad_(spec.guidance.angle_rad),
      shape_(Eigen::VectorXd::Zero(spec.system->plant.size())) {
  for (const ActuatorGroup& group : spec.actuators) {
    for (std::size_t i = 0; i < group.motions.size(); ++i) group_of_.push_back(groups_.size());
    groups_.emplace_back(group.name, !group.motions.empty() && group.motions.front().is_rotation());
  }
  effort_.assign(group_of_.size(), 0);
  const SpaceFrame& frame = spec.frame;
  for (const FrameBeam& beam : frame.beams) members_.push_back({beam.from_node, beam.to_node});
  for (const FrameBar& bar : frame.bars) members_.push_back({bar.from_node, bar.to_node});
  for (const FrameNode& node : frame.nodes)
    nodes_.push_back({node.position_m[0], node.position_m[1], node.position_m[2]});
}

void StructureMeter::watch(Watched& watched, std::span<const Quintic> axes,
                           const StructurePiece& piece) const {
  static const std::array<QuinticWeights, kPlaces + 1> kWeights = [] {
    return []<std::size_t... I>(std::index_sequence<I...>) {
      return std::array<QuinticWeights, kPlaces + 1>{QuinticWeights(static_cast<double>(I) / kPlaces)...};
    }
    (std::make_index_sequence<kPlaces + 1>());
  }();
  std::array<double, kPlaces + 1> largest{};
  for (std::size_t axis = 0; axis < axes.size(); ++axis) {
    std::array<double, kPlaces + 1> size{};
    for (std::size_t i = 0; i <= kPlaces; ++i) {
      size[i] = std::abs(axes[axis].at(kWeights[i]));
      largest[i] = std::max(largest[i], size[i]);
    }
    for (std::size_t i = 0; i <= kPlaces; ++i) {
      const bool is_top = i > 0 && i < kPlaces && size[i] >= size[i - 1] && size[i] >= size[i + 1];
      const double most = is_top ? vertex(size[i - 1], size[i], size[i + 1]) : size[i];
      watched.peak_rad[axis] = std::max(watched.peak_rad[axis], most);
      const double t_s = piece.from_s + static_cast<double>(i) / kPlaces * piece.length_s;
      if (t_s >= duration_s_ - kLastSeconds)
        watched.residual_rad[axis] = std::max(watched.residual_rad[axis], most);
    }
  }
  const double tolerance = settling_.tolerance_rad;
  watched.is_outside = largest[kPlaces] > tolerance;
  for (std::size_t i = kPlaces; i-- > 0;) {
    if (!(largest[i] > tolerance)) continue;
    // Outside here and inside from the next place on, or outside there too.
    double low = static_cast<double>(i) / kPlaces, high = static_cast<double>(i + 1) / kPlaces;
    const auto is_out = [&](double s) {
      const QuinticWeights weights(s);
      return std::any_of(axes.begin(), axes.end(),
                         [&](const Quintic& axis) { return std::abs(axis.at(weights)) > tolerance; });
    };
    if (largest[i + 1] > tolerance) {
      low = high;
    } else {
      for (int k = 0; k < 50; ++k) {
        const double middle = 0.5 * (low + high);
        (is_out(middle) ? low : high) = middle;
      }
    }
    watched.outside_until_s = piece.from_s + low * piece.length_s;
    break;
  }
}

// Angle less the final one: the command's and the hub's own small rotation.
Quintic StructureMeter::hub_error(const StructurePiece& piece) const {
  const Index p = piece.plant;
  const auto about_axis = [&](const double* values) {
    return system_->plant.axis.dot(Eigen::Map<const Eigen::Vector3d>(values + 3));
  };
  const SlewState from = system_->command.at(piece.from_s),
                  to = system_->command.at(piece.from_s + piece.length_s);
  return {piece.length_s,
          from.angle_rad - angle_rad_ + about_axis(piece.y0),
          from.rate_rad_s + about_axis(piece.y0 + p),
          from.acceleration_rad_s2 + about_axis(piece.rate0 + p),
          to.angle_rad - angle_rad_ + about_axis(piece.y1),
          to.rate_rad_s + about_axis(piece.y1 + p),
          to.acceleration_rad_s2 + about_axis(piece.rate1 + p)};
}

void StructureMeter::step(const StructurePiece& piece, StructureLoop& loop) {
  const Index p = piece.plant;
  using ConstVector = Eigen::Map<const Eigen::VectorXd>;
  const auto of = [&](const auto& row, double of_hub, Index axis) {
    const auto along = [&](const double* values) {
      double sum = row.dot(ConstVector(values, p));
      if (of_hub != 0) sum += values[3 + axis];
      return sum;
    };
    return Quintic(piece.length_s, along(piece.y0), along(piece.y0 + p), along(piece.rate0 + p),
                   along(piece.y1), along(piece.y1 + p), along(piece.rate1 + p));
  };
  const auto axes_of = [&](double of_hub) {
    return std::array<Quintic, 3>{of(system_->antenna.row(0), of_hub, 0),
                                  of(system_->antenna.row(1), of_hub, 1),
                                  of(system_->antenna.row(2), of_hub, 2)};
  };
  const auto relative = axes_of(0);
  watch(pointing_, axes_of(1), piece);
  watch(relative_, relative, piece);
  watch(hub_, std::array{hub_error(piece)}, piece);
  const double turned = std::hypot(relative[0].at(1), relative[1].at(1), relative[2].at(1));
  if (turned > farthest_rad_) {
    farthest_rad_ = turned;
    shape_ = ConstVector(piece.y1, p);
    shape_s_ = piece.from_s + piece.length_s;
  }

  if (scratch_.size() == 0) scratch_ = Eigen::VectorXd::Zero(loop.size());
  const auto rate_at = [&](double t_s, const double* y) {
    return system_->command.at(t_s).rate_rad_s +
           system_->plant.axis.dot(Eigen::Map<const Eigen::Vector3d>(y + p + 3));
  };
  for (const auto& [s, weight] : kGauss) {
    const double t_s = piece.from_s + s * piece.length_s;
    piece.state_at(s, scratch_.data());
    peak_rate_rad_s_ = std::max(peak_rate_rad_s_, std::abs(rate_at(t_s, scratch_.data())));
    impulse_N_m_s_ += weight * piece.length_s * std::abs(system_->command.torque_N_m(t_s));
    if (!system_->controller) continue;
    const Eigen::VectorXd& u = loop.controls(t_s, scratch_.data());
    for (std::size_t i = 0; i < effort_.size(); ++i) {
      const double one = u[static_cast<Index>(i)];
      effort_[i] += weight * piece.length_s * one * one;
    }
  }
}

AntennaRotation StructureMeter::rotation(const Watched& watched) const {
  AntennaRotation out{watched.peak_rad, watched.residual_rad, std::nullopt};
  const double origin = settling_.from_arrival ? system_->command.arrival_s() : 0;
  if (!watched.is_outside) out.settling_s = watched.outside_until_s - origin;
  return out;
}

Metrics StructureMeter::finish(double t_s, const double* y) const {
  Metrics metrics;
  const Index p = system_->plant.size();
  const Eigen::Map<const Eigen::Vector3d> hub(y + 3), hub_rate(y + p + 3);
  const SlewState slew = system_->command.at(t_s);
  metrics.end_time_s = t_s;
  metrics.final_error_rad = slew.angle_rad - angle_rad_ + system_->plant.axis.dot(hub);
  metrics.residual_rate_rad_s = slew.rate_rad_s + system_->plant.axis.dot(hub_rate);
  metrics.peak_rate_rad_s = peak_rate_rad_s_;
  metrics.angular_impulse_N_m_s = impulse_N_m_s_;

  StructureMetrics& out = metrics.structure.emplace();
  out.command_arrival_s = system_->command.arrival_s();
  out.pointing = rotation(pointing_);
  out.relative = rotation(relative_);
  metrics.settling_time_s = rotation(settling_.quantity == StructureQuantity::pointing   ? pointing_
                                     : settling_.quantity == StructureQuantity::relative ? relative_
                                                                                         : hub_)
                                .settling_s;
  for (const auto& [name, is_torque] : groups_) out.efforts.push_back({name, is_torque, 0});
  double forces = 0;
  for (std::size_t i = 0; i < effort_.size(); ++i) {
    GroupEffort& group = out.efforts[group_of_[i]];
    group.effort += effort_[i];
    (group.is_torque ? metrics.control_effort_N2_m2_s : forces) += effort_[i];
  }
  metrics.control_effort_N2_s = forces;

  out.shape.t_s = shape_s_;
  out.shape.position_m = nodes_;
  out.shape.members = members_;
  const auto& structure = system_->elements.structure;
  const Eigen::VectorXd x = system_->plant.basis * shape_;
  for (std::size_t node = 0; node < nodes_.size(); ++node) {
    std::array<double, 3> moved{};
    for (std::size_t i = 0; i < 3; ++i)
      moved[i] = structure.relative(NodeMotion{node, i}.coordinate()).dot(x);
    out.shape.displacement_m.push_back(moved);
  }
  return metrics;
}

}  // namespace slew

#define EIGEN_NO_DEBUG  // the innermost loop of a plan
#include "server/guidance/profile_flight.hpp"

#include <algorithm>
#include <array>

#include "server/propagation/cooper_verner.hpp"

namespace slew {

namespace {

constexpr int kMostSize = 7 + 6 * static_cast<int>(ProfileFlight::kMostColumns);
using State = Eigen::Matrix<double, Eigen::Dynamic, 1, 0, kMostSize, 1>;
using Forcing = Eigen::Matrix<double, 3, Eigen::Dynamic, 0, 3, static_cast<int>(ProfileFlight::kMostColumns)>;

// What the controls do at one node of a step.
struct Push {
  Eigen::Vector3d torque;
  Forcing forcing;  // I^-1 B du/dp
};

}  // namespace

void ProfileFlight::fly(std::span<const double> parameters, double time_s, const RigidState& start,
                        std::span<const std::size_t> free, bool with_points) {
  const RigidManeuverPlant& plant = body_->plant;
  const auto columns = static_cast<Eigen::Index>(free.size()) + 1;
  const Eigen::Index time_column = columns - 1;
  points_.clear();
  consumption_ = 0;
  consumption_slope_.setZero(columns);

  std::vector<std::vector<Eigen::Index>> column_of(layout_.controls);
  for (std::size_t i = 0; i < layout_.controls; ++i)
    for (const std::size_t own : own_parameters(layout_, i)) {
      const auto found = std::find(free.begin(), free.end(), own);
      column_of[i].push_back(found == free.end() ? -1 : found - free.begin());
    }

  // At time t; with the weight of its node, what is consumed there is added up. At a switch, where u_i is
  // zero, |u_i| has the slope of the side on which the step lies: that of its middle.
  const auto push_at = [&](double t, double middle, double weight) {
    Push push{Eigen::Vector3d::Zero(), Forcing::Zero(3, columns)};
    for (std::size_t i = 0; i < layout_.controls; ++i) {
      const auto row = static_cast<Eigen::Index>(i);
      const ControlSlope u = profile_slope(layout_, parameters, i, t);
      const double bound = u.control < 0 ? -plant.least_control[row] : plant.most_control[row];
      push.torque += bound * u.control * plant.influence_N_m.col(row);
      const double price = weight * bound * plant.consumption(row);
      const bool is_zero = std::abs(u.control) < 1e-12;
      const double side = is_zero ? profile_control(layout_, parameters, i, middle) : u.control;
      const double sign = side < 0 ? -1 : 1;
      consumption_ += time_s * price * std::abs(u.control);
      consumption_slope_[time_column] += price * std::abs(u.control);
      for (std::size_t k = 0; k < column_of[i].size(); ++k)
        if (const Eigen::Index column = column_of[i][k]; column >= 0) {
          push.forcing.col(column) += bound * u.slope[k] * body_->acceleration_rad_s2.col(row);
          consumption_slope_[column] += time_s * price * sign * u.slope[k];
        }
    }
    return push;
  };

  std::array<Push, 5> pushes;
  const auto slope = [&](int node, const State& x, State& dx) {
    const Push& push = pushes[static_cast<std::size_t>(node)];
    const Vector4<double> q = x.head<4>();
    const Eigen::Vector3d w = x.segment<3>(4);
    const RigidRate<double> rate = rigid_rate<double>(plant, body_->inverse, q, w, push.torque);
    const VariationalRate change = variational_rate(*body_, q, w);
    dx.resize(x.size());
    dx.head<4>() = time_s * rate.attitude_1_s;
    dx.segment<3>(4) = time_s * rate.acceleration_rad_s2;
    for (Eigen::Index column = 0; column < columns; ++column) {
      const auto y = x.segment<6>(7 + 6 * column);
      auto dy = dx.segment<6>(7 + 6 * column);
      dy.head<3>() = time_s * (change.turn * y.tail<3>());
      dy.tail<3>() = time_s * (change.rate * y.tail<3>() + push.forcing.col(column));
      if (!plant.is_free()) dy.tail<3>() += time_s * (change.attitude * y.head<3>());
    }
    auto by_time = dx.segment<6>(7 + 6 * time_column);
    by_time.head<3>() += change.turn * w;
    by_time.tail<3>() += rate.acceleration_rad_s2;
  };

  State x = State::Zero(7 + 6 * columns);
  x.head<4>() = start.attitude;
  x.segment<3>(4) = start.rate_rad_s;
  const auto keep = [&](double t) {
    ProfilePoint point;
    point.t = t;
    point.attitude = x.head<4>();
    point.rate_rad_s = x.segment<3>(4);
    point.sensitivity = Eigen::Map<const Eigen::Matrix<double, 6, Eigen::Dynamic>>(x.data() + 7, 6, columns);
    points_.push_back(std::move(point));
  };
  const std::vector<double> grid = profile_grid(layout_, parameters);
  for (std::size_t k = 1; k < grid.size(); ++k) {
    const double from = grid[k - 1], h = grid[k] - from;
    for (std::size_t node = 0; node < pushes.size(); ++node)
      pushes[node] = push_at(from + kLobattoNodes[node] * h, from + 0.5 * h, kLobattoWeights[node] * h);
    cooper_verner_step(slope, h, x);
    if (with_points && k + 1 < grid.size()) keep(grid[k]);
  }
  keep(1);
}

}  // namespace slew

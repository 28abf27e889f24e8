#include "server/actuator/thruster_allocation.hpp"

namespace slew {
namespace {

std::variant<LeastForce, LeastThrust> prepare(std::span<const Thruster> thrusters, AllocationMethod method) {
  if (method == AllocationMethod::linear_programme) return LeastThrust(torque_matrix_m(thrusters));
  return LeastForce(torque_matrix_m(thrusters), force_matrix(thrusters));
}

}  // namespace

ThrusterAllocation::ThrusterAllocation(std::span<const Thruster> thrusters, AllocationMethod method)
    : method_(prepare(thrusters, method)) {}

void ThrusterAllocation::allocate(const Eigen::Vector3d& torque_N_m, std::span<double> thrust_N) const {
  std::visit([&](const auto& method) { method.allocate(torque_N_m, thrust_N); }, method_);
}

}  // namespace slew

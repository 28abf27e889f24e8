#pragma once
#include <span>
#include "server/actuator/thruster_set.hpp"
namespace slew {
class ThrusterAllocation {
 public:
  ThrusterAllocation(std::span<const Thruster>, AllocationMethod) {}
  void allocate(const Eigen::Vector3d&, std::span<double>) const {}
};
}  // namespace slew

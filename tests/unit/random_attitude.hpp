// Attitudes, rates and bodies that no test would think of; the same ones in every run.
#pragma once

#include <Eigen/Core>
#include <random>

struct RandomAttitude {
  std::mt19937_64 engine{1998};

  double between(double low, double high) {
    return low + (high - low) * static_cast<double>(engine() >> 11) * 0x1p-53;
  }
  Eigen::Vector3d vector(double size) {
    return {between(-size, size), between(-size, size), between(-size, size)};
  }
  /// Full, positive definite.
  Eigen::Matrix3d inertia_kg_m2() {
    Eigen::Matrix3d root;
    for (int i = 0; i < 3; ++i) root.col(i) = vector(5);
    return root * root.transpose() + 80 * Eigen::Matrix3d::Identity();
  }
};

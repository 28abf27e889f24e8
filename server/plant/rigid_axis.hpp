// Rigid spacecraft about one axis: I theta'' = N u + d (Agrawal & Bang 1995, Eq. 1).
#pragma once

namespace slew {

struct RigidAxisParameters {
  double inertia_kg_m2 = 1;
};

}  // namespace slew

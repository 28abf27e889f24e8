// ARKODE's diagonally implicit Runge-Kutta solver with a dense Jacobian for one run, and its state: for what
// is stiff and yet has to begin anew at every boundary without losing its order.
#pragma once

#include <cstdio>  // the next header wants FILE

#include <arkode/arkode_arkstep.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sunmatrix/sunmatrix_dense.h>

namespace slew {

/// Its own context, as the library asks of every thread; made per run, so that nothing is shared.
struct DirkSolver {
  SUNContext context = nullptr;
  N_Vector state = nullptr;
  SUNMatrix matrix = nullptr;
  SUNLinearSolver linear = nullptr;
  void* memory = nullptr;

  /// Kvaerno's method of order 5, which is L-stable and stiffly accurate. `self` is handed to both functions.
  DirkSolver(sunindextype size, ARKRhsFn slope, ARKLsJacFn jacobian, void* self);
  DirkSolver(const DirkSolver&) = delete;
  DirkSolver& operator=(const DirkSolver&) = delete;
  ~DirkSolver();

  double* values() { return NV_DATA_S(state); }
};

}  // namespace slew

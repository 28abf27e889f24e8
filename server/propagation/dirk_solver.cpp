#include "server/propagation/dirk_solver.hpp"

#include <new>

#include "server/propagation/dense_factors.hpp"
#include "server/propagation/erk_solver.hpp"

namespace slew {
DirkSolver::DirkSolver(sunindextype size, ARKRhsFn slope, ARKLsJacFn jacobian, void* self) {
  check_sundials(SUNContext_Create(nullptr, &context), "SUNContext_Create");
  state = N_VNew_Serial(size, context);
  if (!state) throw std::bad_alloc();
  N_VConst(0, state);
  matrix = SUNDenseMatrix(size, size, context);
  linear = dense_factors(size, context);
  memory = ARKStepCreate(nullptr, slope, 0, state, context);
  if (!matrix || !linear || !memory) throw std::bad_alloc();
  check_sundials(ARKStepSetUserData(memory, self), "ARKStepSetUserData");
  check_sundials(ARKStepSetTableNum(memory, ARKODE_KVAERNO_7_4_5, ARKODE_ERK_NONE), "ARKStepSetTableNum");
  check_sundials(ARKStepSetLinearSolver(memory, linear, matrix), "ARKStepSetLinearSolver");
  check_sundials(ARKStepSetJacFn(memory, jacobian), "ARKStepSetJacFn");
  // Slopes of stages are evaluated, not deduced from the stages: under a Jacobian that is not of this very
  // step ARKODE 5.4 deduces some that are wrong, and a flight drifts off by far more than its tolerance.
  check_sundials(ARKStepSetMaxNumSteps(memory, 10000000), "ARKStepSetMaxNumSteps");
}

DirkSolver::~DirkSolver() {
  if (memory) ARKStepFree(&memory);
  if (linear) SUNLinSolFree(linear);
  if (matrix) SUNMatDestroy(matrix);
  if (state) N_VDestroy(state);
  SUNContext_Free(&context);
}

}  // namespace slew

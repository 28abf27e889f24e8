#include "server/propagation/dirk_solver.hpp"

#include <Eigen/LU>
#include <new>

#include "server/propagation/erk_solver.hpp"

namespace slew {
namespace {

using Eigen::MatrixXd;
using Factors = Eigen::PartialPivLU<MatrixXd>;

Factors& factors_of(SUNLinearSolver solver) {
  return *static_cast<Factors*>(solver->content);
}

SUNLinearSolver_Type type_of(SUNLinearSolver) {
  return SUNLINEARSOLVER_DIRECT;
}

int factor(SUNLinearSolver solver, SUNMatrix matrix) {
  const sunindextype n = SUNDenseMatrix_Rows(matrix);
  factors_of(solver).compute(Eigen::Map<const MatrixXd>(SUNDenseMatrix_Data(matrix), n, n));
  return 0;
}

int solve(SUNLinearSolver solver, SUNMatrix, N_Vector x, N_Vector b, sunrealtype) {
  const sunindextype n = NV_LENGTH_S(x);
  Eigen::Map<Eigen::VectorXd>(NV_DATA_S(x), n) =
      factors_of(solver).solve(Eigen::Map<const Eigen::VectorXd>(NV_DATA_S(b), n));
  return 0;
}

int free_solver(SUNLinearSolver solver) {
  delete static_cast<Factors*>(solver->content);
  SUNLinSolFreeEmpty(solver);
  return 0;
}

/// Eigen's factors in place of SUNDIALS' own, which take a multiple of the time.
SUNLinearSolver eigen_solver(sunindextype size, SUNContext context) {
  SUNLinearSolver solver = SUNLinSolNewEmpty(context);
  if (!solver) return nullptr;
  solver->content = new Factors(size);
  solver->ops->gettype = type_of;
  solver->ops->setup = factor;
  solver->ops->solve = solve;
  solver->ops->free = free_solver;
  return solver;
}

}  // namespace

DirkSolver::DirkSolver(sunindextype size, ARKRhsFn slope, ARKLsJacFn jacobian, void* self) {
  check_sundials(SUNContext_Create(nullptr, &context), "SUNContext_Create");
  state = N_VNew_Serial(size, context);
  if (!state) throw std::bad_alloc();
  N_VConst(0, state);
  matrix = SUNDenseMatrix(size, size, context);
  linear = eigen_solver(size, context);
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

#include "server/propagation/dense_factors.hpp"

#include <nvector/nvector_serial.h>

#include <Eigen/LU>

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

}  // namespace

SUNLinearSolver dense_factors(sunindextype size, SUNContext context) {
  SUNLinearSolver solver = SUNLinSolNewEmpty(context);
  if (!solver) return nullptr;
  solver->content = new Factors(size);
  solver->ops->gettype = type_of;
  solver->ops->setup = factor;
  solver->ops->solve = solve;
  solver->ops->free = free_solver;
  return solver;
}

}  // namespace slew

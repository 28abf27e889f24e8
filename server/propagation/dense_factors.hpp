// Eigen's factors of a dense matrix as a linear solver of SUNDIALS', whose own takes a multiple of the time.
#pragma once

#include <cstdio>  // the next header wants FILE

#include <sundials/sundials_context.h>
#include <sundials/sundials_linearsolver.h>
#include <sunmatrix/sunmatrix_dense.h>

namespace slew {

/// To be freed by SUNLinSolFree; null without memory.
SUNLinearSolver dense_factors(sunindextype size, SUNContext context);

}  // namespace slew

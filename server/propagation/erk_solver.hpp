// ARKODE's explicit Runge-Kutta solver for one run, and its state.
#pragma once

#include <cstdio>  // the next header wants FILE

#include <arkode/arkode_butcher_erk.h>
#include <arkode/arkode_erkstep.h>
#include <nvector/nvector_serial.h>
#include <sundials/sundials_context.h>

namespace slew {

/// Throws std::runtime_error for what a SUNDIALS function gives when it fails.
void check_sundials(int flag, const char* what);

/// Its own context, as the library asks of every thread; made per run, so that nothing is shared. Whoever
/// uses it makes `state` and `memory`; it frees them.
struct ErkSolver {
  SUNContext context = nullptr;
  N_Vector state = nullptr;
  void* memory = nullptr;

  ErkSolver();
  ErkSolver(const ErkSolver&) = delete;
  ErkSolver& operator=(const ErkSolver&) = delete;
  ~ErkSolver();
};

}  // namespace slew

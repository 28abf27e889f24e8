#include "server/propagation/erk_solver.hpp"

#include <stdexcept>
#include <string>

namespace slew {

void check_sundials(int flag, const char* what) {
  if (flag < 0) throw std::runtime_error(std::string("SUNDIALS: ") + what + " gave " + std::to_string(flag));
}

ErkSolver::ErkSolver() {
  check_sundials(SUNContext_Create(nullptr, &context), "SUNContext_Create");
}

ErkSolver::~ErkSolver() {
  if (memory) ERKStepFree(&memory);
  if (state) N_VDestroy(state);
  SUNContext_Free(&context);
}

}  // namespace slew

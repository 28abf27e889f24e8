#include "server/simulation/axis_dynamics.hpp"

namespace slew {

// Halves are let go when their ends and the bound on the jerk leave no room for a larger rate.
template <typename Arc>
double SmoothPiece<Arc>::searched_peak(double at_ends) const {
  constexpr double kAccuracy = 1e-10;
  struct Part {
    double a, b, rate_a, rate_b;
  };
  std::array<Part, 128> parts;
  std::size_t count = 1;
  parts[0] = {from_, from_ + h_, std::abs(begin_.rate_rad_s), std::abs(end_.rate_rad_s)};
  double peak = at_ends;
  while (count > 0) {
    const Part part = parts[--count];
    const double width = part.b - part.a;
    const double most =
        std::max(part.rate_a, part.rate_b) + 0.125 * arc_.jerk_bound(part.a, part.b) * width * width;
    if (most <= peak * (1 + kAccuracy) || count + 2 > parts.size()) continue;
    const double middle = 0.5 * (part.a + part.b);
    const double rate = std::abs(arc_.rate_at(middle));
    peak = std::max(peak, rate);
    parts[count++] = {part.a, middle, part.rate_a, rate};
    parts[count++] = {middle, part.b, rate, part.rate_b};
  }
  return peak;
}

template class SmoothPiece<ModalArc>;
template class SmoothPiece<TaylorMotion>;

}  // namespace slew

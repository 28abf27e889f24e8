#include "server/guidance/shaped_controls.hpp"

namespace slew {

ControlHistory shaped_controls(const ControlHistory& history, std::span<const Impulse> impulses) {
  ControlHistory out = history;
  out.time_s = out.on_off.end_s = history.time_s + impulses.back().time_s;
  for (std::size_t i = 0; i < history.on_off.controls.size(); ++i) {
    const std::vector<double>& times_s = history.on_off.switch_times_s[i];
    const std::vector<double>& values = history.on_off.controls[i];
    std::vector<HeldCommand> pieces;
    for (std::size_t k = 0; k < values.size(); ++k) {
      const double from_s = k == 0 ? 0 : times_s[k - 1],
                   to_s = k < times_s.size() ? times_s[k] : history.time_s;
      if (from_s < to_s) pieces.push_back({from_s, to_s, values[k]});
    }
    // Where nothing is left of it, a control is off.
    std::vector<double>& out_values = out.on_off.controls[i];
    std::vector<double>& out_times_s = out.on_off.switch_times_s[i];
    out_values.clear();
    out_times_s.clear();
    double until_s = 0;
    const auto append = [&](double from_s, double value) {
      if (!out_values.empty()) out_times_s.push_back(from_s);
      out_values.push_back(value);
    };
    for (const HeldCommand& piece : shaped(pieces, impulses)) {
      if (piece.from_s > until_s) append(until_s, 0);
      append(piece.from_s, piece.value);
      until_s = piece.to_s;
    }
    if (out_values.empty() || until_s < out.time_s) append(until_s, 0);
  }
  return out;
}

}  // namespace slew

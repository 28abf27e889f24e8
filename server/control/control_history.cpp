#include "server/control/control_history.hpp"

#include <algorithm>

namespace slew {

std::size_t OnOffProgram::switches() const {
  std::size_t count = 0;
  for (const std::vector<double>& times : switch_times_s) count += times.size();
  return count;
}

double control_of(const ControlHistory& history, std::size_t i, double least, double most, double t_s) {
  if (!(t_s >= 0 && t_s < history.time_s)) return 0;
  if (history.family == ProfileFamily::on_off) {
    const std::vector<double>& times = history.on_off.switch_times_s[i];
    const auto passed = std::upper_bound(times.begin(), times.end(), t_s) - times.begin();
    return history.on_off.controls[i][static_cast<std::size_t>(passed)];
  }
  const double part = profile_control(history.layout, history.parameters, i, t_s / history.time_s);
  return part < 0 ? -part * least : part * most;
}

std::vector<double> breaks_of(const ControlHistory& history) {
  std::vector<double> times = {0};
  if (history.family == ProfileFamily::on_off) {
    for (const auto& of_control : history.on_off.switch_times_s)
      times.insert(times.end(), of_control.begin(), of_control.end());
  } else {
    const ProfileLayout& layout = history.layout;
    const std::vector<double>& parameters = history.parameters;
    times.push_back(0.5 * history.time_s);
    for (std::size_t i = 0; i < layout.controls; ++i) {
      std::vector<double> parts;
      if (history.family == ProfileFamily::impulses) {
        const double t1 = parameters[layout.t1(i)];
        parts = {t1, 2 * t1, 1 - 2 * t1, 1 - t1};
      } else {
        const double rise = parameters[layout.rise()];
        parts = {rise, 1 - rise};
        for (int j = 0; j < layout.switches[i]; ++j)
          parts.push_back(parameters[layout.first_switch(i) + static_cast<std::size_t>(j)]);
      }
      for (const double t : parts) times.push_back(std::clamp(t, 0.0, 1.0) * history.time_s);
    }
  }
  times.push_back(history.time_s);
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}

}  // namespace slew

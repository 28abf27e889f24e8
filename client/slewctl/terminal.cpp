#include "client/slewctl/terminal.hpp"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

namespace slew::ctl {
namespace {

// Characters, not bytes.
std::size_t width_of(const std::string& text) {
  return static_cast<std::size_t>(std::count_if(
      text.begin(), text.end(), [](char c) { return (static_cast<unsigned char>(c) & 0xC0) != 0x80; }));
}

bool is_number(const std::string& text) {
  if (text.empty() || text == "-") return true;
  char* end = nullptr;
  std::strtod(text.c_str(), &end);
  return *end == '\0';
}

}  // namespace

std::string table(const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> widths;
  std::vector<bool> numeric;
  for (std::size_t row = 0; row < rows.size(); ++row)
    for (std::size_t column = 0; column < rows[row].size(); ++column) {
      if (column == widths.size()) {
        widths.push_back(0);
        numeric.push_back(true);
      }
      widths[column] = std::max(widths[column], width_of(rows[row][column]));
      if (row > 0 && !is_number(rows[row][column])) numeric[column] = false;
    }
  std::string text;
  for (const auto& row : rows) {
    std::string line;
    for (std::size_t column = 0; column < row.size(); ++column) {
      const std::string padding(widths[column] - width_of(row[column]), ' ');
      if (column > 0) line += "  ";
      line += numeric[column] ? padding + row[column] : row[column] + padding;
    }
    line.erase(line.find_last_not_of(' ') + 1);
    text += line + "\n";
  }
  return text;
}

std::string number(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string bar(double fraction, std::size_t width) {
  const auto filled =
      static_cast<std::size_t>(std::lround(std::clamp(fraction, 0.0, 1.0) * static_cast<double>(width)));
  std::string text = "[";
  for (std::size_t i = 0; i < width; ++i) text += i < filled ? "█" : "·";
  return text + "]";
}

Progress::Progress(bool quiet) : quiet_(quiet), is_terminal_(isatty(STDERR_FILENO)) {}

Progress::~Progress() {
  finish();
}

void Progress::show(const slew_v1_Experiment& status) {
  if (quiet_) return;
  const std::string phase(wire::phase_name(status.phase));
  char times[80];
  if (status.phase == slew_v1_PLANNING)
    std::snprintf(times, sizeof times, "%.0f %%", 100 * status.progress);
  else
    std::snprintf(times, sizeof times, "t = %.3f of %.6g s", status.t_sim_s, status.duration_s);
  if (is_terminal_) {
    std::fprintf(stderr, "\r\x1b[K%s %-9s %s", bar(status.progress, 30).c_str(), phase.c_str(), times);
    std::fflush(stderr);
    has_drawn_ = true;
    return;
  }
  // A log wants few lines: a phase, or another tenth.
  if (status.phase == phase_ && status.progress < shown_progress_ + 0.1) return;
  phase_ = status.phase;
  shown_progress_ = status.progress;
  std::fprintf(stderr, "%s, %s\n", phase.c_str(), times);
}

void Progress::finish() {
  if (has_drawn_) std::fputs("\r\x1b[K", stderr);
  has_drawn_ = false;
}

}  // namespace slew::ctl

// What people look at: tables, a progress bar, numbers.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "idl/wire/phase.hpp"

namespace slew::ctl {

/// Rows of cells in aligned columns; the first row is the heading. Columns of numbers are set to the right.
std::string table(const std::vector<std::vector<std::string>>& rows);

/// Six significant digits, without an exponent where that is readable.
std::string number(double value);

/// 12 of 20 characters filled at 0.6.
std::string bar(double fraction, std::size_t width);

/// A moving bar on a terminal, a line now and then elsewhere; on standard error.
class Progress {
 public:
  explicit Progress(bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void show(const slew_v1_Experiment& status);
  void finish();

 private:
  bool quiet_;
  bool is_terminal_;
  bool has_drawn_ = false;
  wire::Phase phase_ = slew_v1_RECEIVED;
  double shown_progress_ = -1;
};

}  // namespace slew::ctl

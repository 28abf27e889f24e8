// What was asked for on the command line.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

namespace slew::ctl {

enum class Command {
  run,
  submit,
  result,
  show,
  list,
  history,
  series,
  watch,
  cancel,
  pause,
  resume,
  step,
  rate,
  presets,
  schema,
  validate,
  describe,
  model,
  plan,
  compare,
  server,
  doctor,
  plot,
  export_series,
};

struct Options {
  Command command{};
  // everywhere
  std::uint32_t domain = 1;
  std::string dds_profile;  ///< path
  std::string client_id = "slewctl";
  bool json = false;
  bool quiet = false;
  double connect_s = 6;  ///< how long to look for a server: a lost announcement is repeated after 4 s
  // requests
  std::string file;
  std::string preset;
  std::vector<std::string> set;
  bool verify = false;
  std::string request_id;  ///< empty: a new one
  std::optional<double> timeout_s;
  // experiments
  std::vector<std::string> ids;
  bool all = false;
  double value = 0;
  std::int64_t limit = 20;
  std::int64_t offset = 0;
  std::string phase;
  // series and pictures
  std::vector<std::string> channels;
  std::optional<double> from_s;
  std::optional<double> to_s;
  std::int64_t max_samples = 0;
  std::string hdf5;
  std::string cube;    ///< file of a picture of the control cube
  std::string output;  ///< a picture's or a table's file; "-": the terminal
  // watch
  bool csv = false;
  double rate_hz = 10;
  std::optional<double> for_s;
  // presets, schema
  std::string name;
};

/// Fills the options. Returns an exit code when there is nothing more to do (help, version, bad usage).
std::optional<int> parse_command_line(int argc, char** argv, Options& options);

}  // namespace slew::ctl

// The series of finished experiments, one HDF5 file each: written beside, made durable, then renamed, so that
// a file under its final name is whole.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "idl/wire/id.hpp"
#include "server/service/sample_store.hpp"
#include "server/simulation/run.hpp"

namespace slew::service {

/// What to read back: channels by name (all when empty) and a span of simulated time, thinned evenly to at
/// most `max_samples` (0: all).
struct SeriesSelection {
  std::vector<std::string> channels;
  double from_s = -1e300;
  double to_s = 1e300;
  std::size_t max_samples = 0;
};

struct SeriesColumn {
  std::string name;
  std::string unit;
  std::vector<double> values;
};

struct Series {
  std::vector<double> t_s;
  std::vector<SeriesColumn> columns;
};

/// Safe to use from several threads.
class Archive {
 public:
  /// Makes the directory and removes what an interrupted write left. Throws std::runtime_error.
  explicit Archive(std::filesystem::path directory);

  /// Durable when it returns. Throws std::runtime_error, e.g. when the disk is full.
  void write(const wire::Id& experiment, const ChannelTable& channels, const SampleStore& samples) const;

  /// Empty when there is no such file. Throws std::invalid_argument for an unknown channel and
  /// std::runtime_error for a damaged file.
  std::optional<Series> read(const wire::Id& experiment, const SeriesSelection& selection) const;

  void remove(const wire::Id& experiment) const;
  std::filesystem::path path(const wire::Id& experiment) const;

 private:
  std::filesystem::path directory_;
};

}  // namespace slew::service

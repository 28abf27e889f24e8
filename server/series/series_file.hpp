// The HDF5 form of a recorded series: `time`, and a dataset for each channel in the groups `state` and
// `thrusters`, with `unit`, `frame` and `description` as attributes. Opens in h5py, Octave, MATLAB and Julia.
//
// Behind the end of what HDF5 looks at stands a seal over all bytes before it. A file whose seal does not fit
// is not given to the HDF5 library, which trusts what it reads.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "server/simulation/run.hpp"

namespace slew {

/// What to read: channels by name (all when empty) and a span of simulated time, thinned evenly to at most
/// `max_samples` (0: all).
struct SeriesSelection {
  std::vector<std::string> channels;
  double from_s = -1e300;
  double to_s = 1e300;
  std::size_t max_samples = 0;
};

struct SeriesColumn {
  std::string group;  ///< "state" or "thrusters"
  Channel channel;
  std::vector<double> values;
};

struct Series {
  std::vector<double> t_s;
  std::vector<SeriesColumn> columns;
};

/// Column 0 is the time, s; then come the channels, those of the state first.
using ColumnSource = std::function<std::vector<double>(std::size_t)>;

/// The file as it will stand on the disk, made in memory: nothing of HDF5 is locked while the disk works.
/// Safe to call from several threads. Throws std::runtime_error.
std::vector<char> series_image(const ChannelTable& channels, const ColumnSource& column);

/// Safe to call from several threads. Throws std::invalid_argument for an unknown channel and
/// std::runtime_error for a damaged file.
Series read_series(const std::filesystem::path& path, const SeriesSelection& selection);

}  // namespace slew

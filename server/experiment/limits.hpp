// The bounds of the service, as code sees them. The numbers stand in schemas/limits.schema.json.
#pragma once

#include <cstddef>

namespace slew {

struct Limits {
  std::size_t max_request_bytes;
  std::size_t max_nesting_depth;
  std::size_t max_items;
  std::size_t max_violations;
  double max_steps;
  double max_archived_rows;
  std::size_t max_frame_coordinates;
  double max_shaped_firings;
  double max_shaped_controls;
  std::size_t max_queued_experiments;
  double max_paced_load;
  double lossless_patience_s;
  std::size_t retained_experiments;
  double retention_s;
  double max_rate;
  double min_mode_frequency_hz;
  double max_mode_frequency_hz;
};

const Limits& limits();

}  // namespace slew

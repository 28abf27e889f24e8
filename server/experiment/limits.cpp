#include "server/experiment/limits.hpp"

#include <nlohmann/json.hpp>

#include "server/experiment/schema.hpp"

namespace slew {

const Limits& limits() {
  static const Limits values = [] {
    const nlohmann::json& schema = schema_document("limits");
    const auto number = [&](const char* name) {
      return schema.at("properties").at(name).at("const").get<double>();
    };
    const auto bound = [&](const char* name, const char* side) {
      return schema.at("definitions").at(name).at(side).get<double>();
    };
    const auto count = [&](const char* name) { return static_cast<std::size_t>(number(name)); };
    return Limits{.max_request_bytes = count("max_request_bytes"),
                  .max_nesting_depth = count("max_nesting_depth"),
                  .max_items = count("max_items"),
                  .max_violations = count("max_violations"),
                  .max_steps = number("max_steps"),
                  .max_archived_rows = number("max_archived_rows"),
                  .max_frame_coordinates = count("max_frame_coordinates"),
                  .max_shaped_firings = number("max_shaped_firings"),
                  .max_shaped_controls = number("max_shaped_controls"),
                  .max_queued_experiments = count("max_queued_experiments"),
                  .max_paced_load = number("max_paced_load"),
                  .lossless_patience_s = number("lossless_patience_s"),
                  .retained_experiments = count("retained_experiments"),
                  .retention_s = number("retention_s"),
                  .max_rate = bound("rate", "maximum"),
                  .min_mode_frequency_hz = bound("mode_frequency_hz", "minimum"),
                  .max_mode_frequency_hz = bound("mode_frequency_hz", "maximum")};
  }();
  return values;
}

}  // namespace slew

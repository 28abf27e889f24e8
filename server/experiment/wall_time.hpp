// Wall times in requests: UTC, in the form of RFC 3339.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace slew {

/// "2026-11-24T12:00:00Z", with up to nine decimals of a second, to nanoseconds since 1970. Empty when the
/// text is anything else, or no day of the calendar.
std::optional<std::int64_t> parse_utc(std::string_view text);

}  // namespace slew

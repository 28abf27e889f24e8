// What is to go wrong in a program under test: written by the test, read by the interposed system calls, in
// memory that both have mapped.
#pragma once

#include <atomic>
#include <cstdint>

namespace slew::test {

enum class Fault : std::int32_t {
  none,
  disk_full,  ///< nothing more can be written
  disk_read_only,
  io_error_once,  ///< at the n-th call
  slow_disk,      ///< it takes three seconds until something is on the disk
  no_memory,      ///< the n-th large piece asked for by a worker is not there
  hang,           ///< whoever flies does not come back
};

struct FaultPlan {
  std::atomic<Fault> fault{Fault::none};
  std::atomic<std::int64_t> nth{0};       ///< from 1
  std::atomic<std::int64_t> calls{0};     ///< counted since the test set it to 0
  std::atomic<std::int64_t> injected{0};  ///< how often something went wrong
  std::atomic<std::int64_t> clock_offset_ns{0};
  char under[256] = {};  ///< only files below this directory
};

/// The environment variable that names the mapped file.
inline constexpr const char* kFaultPlan = "SLEW_FAULT_PLAN";

}  // namespace slew::test

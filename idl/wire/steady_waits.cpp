// Cyclone DDS 0.10 waits for a span of time by adding it to the wall clock. Set that clock back by an hour
// and its threads sleep an hour longer: no heartbeat, no discovery. A program that links the wire waits for
// the same span by the monotonic clock, which nobody sets.
#include <pthread.h>
#include <time.h>

#include <algorithm>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define SLEW_WAITS_ARE_WATCHED  // by a sanitizer, which has put its own in this place
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define SLEW_WAITS_ARE_WATCHED
#endif
#endif

namespace slew::wire {

// Named by domain.cpp, so that this file is linked.
extern const bool kSteadyWaits;
#ifdef SLEW_WAITS_ARE_WATCHED
const bool kSteadyWaits = false;
#else
const bool kSteadyWaits = true;
#endif

}  // namespace slew::wire

#ifndef SLEW_WAITS_ARE_WATCHED
extern "C" int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex,
                                      const timespec* until) {
  timespec wall{}, steady{};
  clock_gettime(CLOCK_REALTIME, &wall);
  clock_gettime(CLOCK_MONOTONIC, &steady);
  const auto ns = [](const timespec& time) { return time.tv_sec * 1'000'000'000L + time.tv_nsec; };
  // "Never" is the largest number there is, or nearly.
  constexpr long kLongest_s = 1'000'000'000;
  const bool is_never = until->tv_sec - wall.tv_sec > kLongest_s;
  const long end_ns =
      ns(steady) + (is_never ? kLongest_s * 1'000'000'000L : std::max(0L, ns(*until) - ns(wall)));
  const timespec end{end_ns / 1'000'000'000L, end_ns % 1'000'000'000L};
  return pthread_cond_clockwait(condition, mutex, CLOCK_MONOTONIC, &end);
}
#endif

// The system that a program under test gets by LD_PRELOAD: files below one directory that refuse, memory that
// is not there, a wall clock that is set, a thread that does not come back. Without a plan it changes
// nothing.
#include <dlfcn.h>
#include <errno.h>
#include <fcntl.h>
#include <pthread.h>
#include <stdarg.h>
#include <sys/mman.h>
#include <sys/prctl.h>
#include <sys/time.h>
#include <time.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>

#include "tests/faults/fault_plan.hpp"

extern "C" void* __libc_malloc(size_t);

namespace {

using slew::test::Fault;
using slew::test::FaultPlan;

FaultPlan* plan = nullptr;
constexpr int kDescriptors = 4096;
std::atomic<bool> is_watched[kDescriptors];

template <typename Function>
Function real(Function, const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}
#define REAL(name) static const auto next = real(&::name, #name)

__attribute__((constructor)) void map_the_plan() {
  const char* file = std::getenv(slew::test::kFaultPlan);
  if (!file) return;
  const int fd = real(&::open, "open")(file, O_RDWR | O_CLOEXEC);
  if (fd < 0) return;
  void* memory = mmap(nullptr, sizeof(FaultPlan), PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0);
  if (memory != MAP_FAILED) plan = static_cast<FaultPlan*>(memory);
}

bool is_below(const char* path) {
  return plan && path && plan->under[0] && std::strncmp(path, plan->under, std::strlen(plan->under)) == 0;
}

void watch(int fd, bool yes) {
  if (fd >= 0 && fd < kDescriptors) is_watched[fd] = yes;
}

bool watched(int fd) {
  return plan && fd >= 0 && fd < kDescriptors && is_watched[fd];
}

bool is_the_nth() {
  if (++plan->calls != plan->nth) return false;
  ++plan->injected;
  return true;
}

// What is wrong with a call on a watched file; 0: nothing.
int wrong_with(bool writes, bool needs_room) {
  switch (plan->fault.load()) {
    case Fault::disk_full:
      if (!needs_room) return 0;
      ++plan->injected;
      return ENOSPC;
    case Fault::disk_read_only:
      if (!writes) return 0;
      ++plan->injected;
      return EROFS;
    case Fault::io_error_once:
      return is_the_nth() ? EIO : 0;
    default:
      ++plan->calls;
      return 0;
  }
}

bool thread_is_named(const char* beginning) {
  char name[16] = {};
  prctl(PR_GET_NAME, name);
  return std::strncmp(name, beginning, std::strlen(beginning)) == 0;
}

template <typename Result>
Result failed(int why) {
  errno = why;
  return static_cast<Result>(-1);
}

template <typename Call>
int opened(const char* path, int flags, Call&& call) {
  if (is_below(path)) {
    const bool writes = (flags & (O_WRONLY | O_RDWR | O_CREAT)) != 0;
    const bool needs_room = (flags & O_CREAT) && access(path, F_OK) != 0;
    if (const int why = wrong_with(writes, needs_room)) return failed<int>(why);
  }
  const int fd = call();
  watch(fd, is_below(path));
  return fd;
}

// A disk that runs full takes a part of the last large piece.
size_t taken(size_t count) {
  return plan->fault == Fault::disk_full && count > 4096 ? count / 2 : count;
}

template <typename Call>
ssize_t written(int fd, size_t count, Call&& call) {
  if (!watched(fd)) return call(count);
  const size_t part = taken(count);
  if (part == count)
    if (const int why = wrong_with(true, true)) return failed<ssize_t>(why);
  return call(part);
}

template <typename Call>
auto on_file(int fd, bool writes, bool needs_room, Call&& call) -> decltype(call()) {
  if (watched(fd))
    if (const int why = wrong_with(writes, needs_room)) return failed<decltype(call())>(why);
  return call();
}

// Three seconds pass before it is on the disk.
template <typename Call>
int synced(int fd, Call&& call) {
  if (watched(fd) && plan->fault == Fault::slow_disk) {
    ++plan->injected;
    usleep(3000000);
  }
  return on_file(fd, false, false, call);
}

template <typename Call>
int on_path(const char* path, bool needs_room, Call&& call) {
  if (is_below(path))
    if (const int why = wrong_with(true, needs_room)) return failed<int>(why);
  return call();
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = va_arg(list, mode_t);
  va_end(list);
  REAL(open);
  return opened(path, flags, [&] { return next(path, flags, mode); });
}
int open64(const char* path, int flags, ...) {
  va_list list;
  va_start(list, flags);
  const mode_t mode = va_arg(list, mode_t);
  va_end(list);
  REAL(open64);
  return opened(path, flags, [&] { return next(path, flags, mode); });
}
int close(int fd) {
  REAL(close);
  watch(fd, false);
  return next(fd);
}
ssize_t write(int fd, const void* bytes, size_t count) {
  REAL(write);
  return written(fd, count, [&](size_t part) { return next(fd, bytes, part); });
}
ssize_t pwrite(int fd, const void* bytes, size_t count, off_t at) {
  REAL(pwrite);
  return written(fd, count, [&](size_t part) { return next(fd, bytes, part, at); });
}
ssize_t pwrite64(int fd, const void* bytes, size_t count, off64_t at) {
  REAL(pwrite64);
  return written(fd, count, [&](size_t part) { return next(fd, bytes, part, at); });
}
ssize_t read(int fd, void* bytes, size_t count) {
  REAL(read);
  return on_file(fd, false, false, [&] { return next(fd, bytes, count); });
}
ssize_t pread(int fd, void* bytes, size_t count, off_t at) {
  REAL(pread);
  return on_file(fd, false, false, [&] { return next(fd, bytes, count, at); });
}
ssize_t pread64(int fd, void* bytes, size_t count, off64_t at) {
  REAL(pread64);
  return on_file(fd, false, false, [&] { return next(fd, bytes, count, at); });
}
int fsync(int fd) {
  REAL(fsync);
  return synced(fd, [&] { return next(fd); });
}
int fdatasync(int fd) {
  REAL(fdatasync);
  return synced(fd, [&] { return next(fd); });
}
int ftruncate(int fd, off_t length) noexcept {
  REAL(ftruncate);
  return on_file(fd, true, length > 0, [&] { return next(fd, length); });
}
int ftruncate64(int fd, off64_t length) noexcept {
  REAL(ftruncate64);
  return on_file(fd, true, length > 0, [&] { return next(fd, length); });
}
// These tell by their result, not by errno.
int posix_fallocate(int fd, off_t begin, off_t length) {
  REAL(posix_fallocate);
  if (watched(fd))
    if (const int why = wrong_with(true, true)) return why;
  return next(fd, begin, length);
}
int rename(const char* from, const char* to) noexcept {
  REAL(rename);
  return on_path(from, false, [&] { return next(from, to); });
}
int unlink(const char* path) noexcept {
  REAL(unlink);
  return on_path(path, false, [&] { return next(path); });
}
int mkdir(const char* path, mode_t mode) noexcept {
  REAL(mkdir);
  return on_path(path, true, [&] { return next(path, mode); });
}

// Large pieces only: those are an experiment's samples, tables and rings.
void* malloc(size_t count) noexcept {
  constexpr size_t kLarge = 1024;
  if (plan && count >= kLarge && plan->fault == Fault::no_memory && thread_is_named("worker-") &&
      is_the_nth()) {
    errno = ENOMEM;
    return nullptr;
  }
  return __libc_malloc(count);
}

int clock_gettime(clockid_t id, timespec* time) noexcept {
  REAL(clock_gettime);
  const int code = next(id, time);
  if (!plan || code != 0) return code;
  const std::int64_t offset_ns = plan->clock_offset_ns;
  if (id == CLOCK_REALTIME && offset_ns != 0) time->tv_sec += offset_ns / 1'000'000'000;
  return code;
}
int gettimeofday(timeval* time, void*) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  time->tv_sec = now.tv_sec;
  time->tv_usec = now.tv_nsec / 1000;
  return 0;
}
time_t time(time_t* into) noexcept {
  timespec now{};
  clock_gettime(CLOCK_REALTIME, &now);
  if (into) *into = now.tv_sec;
  return now.tv_sec;
}

// The digest is what every step of every run goes through.
int XXH3_128bits_update(void* state, const void* bytes, size_t count) {
  using Update = int (*)(void*, const void*, size_t);
  static const auto next = reinterpret_cast<Update>(dlsym(RTLD_NEXT, "XXH3_128bits_update"));
  if (plan && plan->fault == Fault::hang && (thread_is_named("worker-") || thread_is_named("pacer-"))) {
    ++plan->injected;
    while (plan->fault == Fault::hang) usleep(10000);
  }
  return next(state, bytes, count);
}

// The kernel would wait by a clock that it knows has been set; here it is looked at again and again.
int pthread_cond_timedwait(pthread_cond_t* condition, pthread_mutex_t* mutex, const timespec* until) {
  using Wait = int (*)(pthread_cond_t*, pthread_mutex_t*, clockid_t, const timespec*);
  static const auto wait = reinterpret_cast<Wait>(dlsym(RTLD_NEXT, "pthread_cond_clockwait"));
  const auto ns = [](const timespec& time) { return time.tv_sec * 1'000'000'000L + time.tv_nsec; };
  while (true) {
    timespec wall{}, slice{};
    clock_gettime(CLOCK_REALTIME, &wall);
    const long left_ns = ns(*until) - ns(wall);
    if (left_ns <= 0) return ETIMEDOUT;
    static const auto real_clock = real(&::clock_gettime, "clock_gettime");
    real_clock(CLOCK_MONOTONIC, &slice);
    const long end_ns = ns(slice) + std::min(left_ns, 50'000'000L);
    slice = {end_ns / 1'000'000'000L, end_ns % 1'000'000'000L};
    const int code = wait(condition, mutex, CLOCK_MONOTONIC, &slice);
    if (code != ETIMEDOUT) return code;
  }
}

}  // extern "C"

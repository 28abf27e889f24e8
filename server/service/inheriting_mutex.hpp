// A mutex whose holder runs at the priority of whoever waits for it: a thread of the default policy that
// holds what a pacer needs cannot be kept off its processor meanwhile.
#pragma once

#include <pthread.h>

#include <mutex>
#include <system_error>

namespace slew::service {

/// Usable with std::condition_variable, which wants std::mutex itself: the handle behind it is made anew.
class InheritingMutex : public std::mutex {
 public:
  InheritingMutex() {
    pthread_mutexattr_t attributes;
    pthread_mutexattr_init(&attributes);
    pthread_mutexattr_setprotocol(&attributes, PTHREAD_PRIO_INHERIT);
    pthread_mutex_destroy(native_handle());
    const int error = pthread_mutex_init(native_handle(), &attributes);
    pthread_mutexattr_destroy(&attributes);
    if (error != 0)
      throw std::system_error(error, std::generic_category(), "a mutex with priority inheritance");
  }
};

}  // namespace slew::service

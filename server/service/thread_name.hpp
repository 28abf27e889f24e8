// Names for threads, as top and gdb show them.
#pragma once

#include <pthread.h>

#include <string>

namespace slew::service {

inline void name_this_thread(const std::string& name) {
  pthread_setname_np(pthread_self(), name.substr(0, 15).c_str());
}

}  // namespace slew::service

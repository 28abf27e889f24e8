// A DDS domain id of one's own while a test runs, so that tests run beside each other: 1 to 99, handed out by
// file locks.
#pragma once

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <chrono>
#include <stdexcept>
#include <string>
#include <thread>

namespace slew::test {

class DomainLease {
 public:
  DomainLease() {
    const std::string directory = "/tmp/slewd-test-domains." + std::to_string(getuid());
    mkdir(directory.c_str(), 0700);
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::minutes(5);
    while (std::chrono::steady_clock::now() < deadline) {
      // Start at a different place in every process: fewer collisions.
      for (int i = 0; i < 99; ++i) {
        const int domain = 1 + (static_cast<int>(getpid()) + i) % 99;
        const int fd =
            open((directory + "/" + std::to_string(domain)).c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0600);
        if (fd < 0) continue;
        if (flock(fd, LOCK_EX | LOCK_NB) == 0) {
          fd_ = fd;
          domain_ = static_cast<std::uint32_t>(domain);
          return;
        }
        close(fd);
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
    throw std::runtime_error("no free DDS domain within 5 min");
  }
  DomainLease(const DomainLease&) = delete;
  DomainLease& operator=(const DomainLease&) = delete;
  ~DomainLease() { close(fd_); }

  std::uint32_t domain() const { return domain_; }

 private:
  int fd_ = -1;
  std::uint32_t domain_ = 0;
};

}  // namespace slew::test

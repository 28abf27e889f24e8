#include "server/service/black_box.hpp"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <stdexcept>

namespace slew::service {

BlackBox::BlackBox(const std::filesystem::path& file) {
  constexpr std::size_t bytes = kSeats * sizeof(wire::Id);
  const int fd = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0640);
  // Its blocks are there before they are mapped: a full disk should be told here, not by SIGBUS.
  void* memory = fd >= 0 && ::posix_fallocate(fd, 0, bytes) == 0
                     ? ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd, 0)
                     : MAP_FAILED;
  if (fd >= 0) ::close(fd);
  if (memory == MAP_FAILED)
    throw std::runtime_error("the file " + file.string() + " cannot be written (is the disk full?)");
  seats_ = static_cast<wire::Id*>(memory);
  std::copy_if(seats_, seats_ + kSeats, std::back_inserter(suspects_),
               [](const wire::Id& id) { return !id.is_zero(); });
  std::fill(seats_, seats_ + kSeats, wire::Id{});
}

BlackBox::~BlackBox() {
  std::fill(seats_, seats_ + kSeats, wire::Id{});
  ::munmap(seats_, kSeats * sizeof(wire::Id));
}

BlackBox::Seat BlackBox::seat() {
  // More threads than seats: the last one is shared, and tells of one of them.
  return Seat(seats_ + std::min(given_.fetch_add(1), kSeats - 1));
}

}  // namespace slew::service

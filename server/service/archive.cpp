#include "server/service/archive.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <stdexcept>

namespace slew::service {
namespace {

class Descriptor {
 public:
  explicit Descriptor(int fd) : fd_(fd) {}
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  ~Descriptor() {
    if (fd_ >= 0) ::close(fd_);
  }
  int get() const { return fd_; }

 private:
  int fd_;
};

[[noreturn]] void fail(const std::string& what) {
  throw std::runtime_error(what + ": " + std::strerror(errno));
}

void write_durably(const std::filesystem::path& path, const std::vector<char>& bytes) {
  const std::string temporary = path.string() + ".tmp";
  // What a full disk did not take whole would go on filling it.
  struct Leftover {
    const std::string& path;
    ~Leftover() { ::unlink(path.c_str()); }
  } const leftover{temporary};
  {
    const Descriptor file(::open(temporary.c_str(), O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0640));
    if (file.get() < 0) fail("the archive could not be written");
    for (std::size_t done = 0; done < bytes.size();) {
      const ssize_t count = ::write(file.get(), bytes.data() + done, bytes.size() - done);
      if (count < 0 && errno == EINTR) continue;
      if (count < 0) fail("the archive could not be written");
      done += static_cast<std::size_t>(count);
    }
    if (::fdatasync(file.get()) != 0) fail("the archive could not be made durable");
  }
  if (::rename(temporary.c_str(), path.c_str()) != 0) fail("the archive could not be renamed");
  const Descriptor directory(::open(path.parent_path().c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  if (directory.get() < 0 || ::fsync(directory.get()) != 0) fail("the archive could not be made durable");
}

}  // namespace

Archive::Archive(std::filesystem::path directory) : directory_(std::move(directory)) {
  std::filesystem::create_directories(directory_);
  for (const auto& entry : std::filesystem::directory_iterator(directory_))
    if (entry.path().extension() == ".tmp") std::filesystem::remove(entry.path());
}

std::filesystem::path Archive::path(const wire::Id& experiment) const {
  return directory_ / (experiment.hex() + ".h5");
}

void Archive::write(const wire::Id& experiment, const ChannelTable& channels,
                    const SampleStore& samples) const {
  write_durably(path(experiment),
                series_image(channels, [&](std::size_t index) { return samples.column(index); }));
}

std::optional<Series> Archive::read(const wire::Id& experiment, const SeriesSelection& selection) const {
  const std::filesystem::path file = path(experiment);
  if (!std::filesystem::exists(file)) return std::nullopt;
  return read_series(file, selection);
}

// Experiments' ids begin with the time they were made at: names in order are oldest first.
std::size_t Archive::trim(std::uintmax_t most_bytes) const {
  struct File {
    std::filesystem::path path;
    std::uintmax_t bytes;
  };
  std::vector<File> files;
  std::uintmax_t total = 0;
  for (const auto& entry : std::filesystem::directory_iterator(directory_)) {
    std::error_code gone;
    const std::uintmax_t bytes = entry.file_size(gone);
    if (gone || entry.path().extension() != ".h5") continue;
    files.push_back({entry.path(), bytes});
    total += bytes;
  }
  std::sort(files.begin(), files.end(), [](const File& a, const File& b) { return a.path < b.path; });
  std::size_t removed = 0;
  for (const File& file : files) {
    if (total <= most_bytes) break;
    std::error_code ignored;
    std::filesystem::remove(file.path, ignored);
    total -= file.bytes;
    ++removed;
  }
  return removed;
}

void Archive::remove(const wire::Id& experiment) const {
  std::error_code ignored;
  std::filesystem::remove(path(experiment), ignored);
}

}  // namespace slew::service

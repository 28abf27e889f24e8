// The reader of archived series: any selection of a good file, and any bytes in the place of a file.
#include <unistd.h>

#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>

#include "server/series/series_file.hpp"

namespace {

using namespace slew;

class File {
 public:
  explicit File(const char* name) : path("/dev/shm/slewd-fuzz-" + std::to_string(getpid()) + name) {}
  ~File() { std::filesystem::remove(path); }
  void put(const char* bytes, std::size_t size) const {
    std::ofstream(path, std::ios::binary | std::ios::trunc).write(bytes, static_cast<std::streamsize>(size));
  }
  const std::filesystem::path path;
};

const File& good() {
  static const File file("good");
  static const bool is_written = [] {
    ChannelTable channels;
    channels.state = {{"angle_rad", "rad", "", ""}, {"rate_rad_s", "rad/s", "body", "rate"}};
    const auto image = series_image(channels, [](std::size_t column) {
      std::vector<double> values;
      for (int i = 0; i < 50; ++i) values.push_back(static_cast<double>(column + 1) * i);
      return values;
    });
    file.put(image.data(), image.size());
    return true;
  }();
  if (!is_written) std::abort();
  return file;
}

void read(const std::filesystem::path& path, const SeriesSelection& selection) {
  try {
    const Series series = read_series(path, selection);
    for (const SeriesColumn& column : series.columns)
      if (column.values.size() != series.t_s.size()) std::abort();
  } catch (const std::runtime_error&) {
  } catch (const std::invalid_argument&) {
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const File file("any");
  file.put(reinterpret_cast<const char*>(bytes), size);
  read(file.path, {});
  SeriesSelection selection;
  const auto number = [&] {
    double value = 0;
    const std::size_t count = std::min(size, sizeof value);
    std::memcpy(&value, bytes, count);
    bytes += count;
    size -= count;
    return value;
  };
  selection.from_s = number();
  selection.to_s = number();
  const double samples = number();
  selection.max_samples = samples > 0 && samples < 1e15 ? static_cast<std::size_t>(samples) : 0;
  if (size > 0) {
    const std::string name(reinterpret_cast<const char*>(bytes), size);
    selection.channels = {name.find("angle") != std::string::npos ? "angle_rad" : name};
  }
  read(good().path, selection);
  return 0;
}

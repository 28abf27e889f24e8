#include "server/series/series_file.hpp"

#include <hdf5.h>

#include <algorithm>
#include <mutex>
#include <stdexcept>

#include "server/series/seal.hpp"

namespace slew {
namespace {

// The serial HDF5 library is one per process and not safe for threads.
std::mutex& library() {
  static std::mutex mutex;
  return mutex;
}

class Handle {
 public:
  using Close = herr_t (*)(hid_t);
  Handle(hid_t id, Close close, const char* what) : id_(id), close_(close) {
    if (id < 0) throw std::runtime_error(std::string("HDF5 could not ") + what);
  }
  Handle(const Handle&) = delete;
  Handle& operator=(const Handle&) = delete;
  ~Handle() { close_(id_); }
  operator hid_t() const { return id_; }  // NOLINT(google-explicit-constructor): it is the C API's handle

 private:
  hid_t id_;
  Close close_;
};

void check(herr_t status, const char* what) {
  if (status < 0) throw std::runtime_error(std::string("HDF5 could not ") + what);
}

void quiet() {
  H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr);
}

void write_text_attribute(hid_t object, const char* name, const std::string& text) {
  const Handle type(H5Tcopy(H5T_C_S1), H5Tclose, "make a text type");
  check(H5Tset_size(type, std::max<std::size_t>(1, text.size())), "size a text");
  check(H5Tset_cset(type, H5T_CSET_UTF8), "set a character set");
  const Handle space(H5Screate(H5S_SCALAR), H5Sclose, "make a scalar");
  const Handle attribute(H5Acreate2(object, name, type, space, H5P_DEFAULT, H5P_DEFAULT), H5Aclose,
                         "make an attribute");
  check(H5Awrite(attribute, type, text.empty() ? " " : text.data()), "write an attribute");
}

std::string read_text_attribute(hid_t object, const char* name) {
  const Handle attribute(H5Aopen(object, name, H5P_DEFAULT), H5Aclose, "open an attribute");
  const Handle type(H5Aget_type(attribute), H5Tclose, "read a text type");
  std::string text(H5Tget_size(type), '\0');
  check(H5Aread(attribute, type, text.data()), "read an attribute");
  return text;
}

void write_column(hid_t file, const std::string& path, const Channel& channel,
                  const std::vector<double>& values) {
  const hsize_t rows = values.size();
  const Handle space(H5Screate_simple(1, &rows, nullptr), H5Sclose, "make a space");
  const Handle dataset(
      H5Dcreate2(file, path.c_str(), H5T_IEEE_F64LE, space, H5P_DEFAULT, H5P_DEFAULT, H5P_DEFAULT), H5Dclose,
      "make a dataset");
  check(H5Dwrite(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()),
        "write a dataset");
  write_text_attribute(dataset, "unit", channel.unit);
  write_text_attribute(dataset, "description", channel.description);
  write_text_attribute(dataset, "frame", channel.frame);
}

// Members keep the order of the channel table.
void make_group(hid_t file, const char* name) {
  const Handle properties(H5Pcreate(H5P_GROUP_CREATE), H5Pclose, "make a group property");
  check(H5Pset_link_creation_order(properties, H5P_CRT_ORDER_TRACKED | H5P_CRT_ORDER_INDEXED),
        "keep a group's order");
  const Handle group(H5Gcreate2(file, name, H5P_DEFAULT, properties, H5P_DEFAULT), H5Gclose, "make a group");
}

std::vector<double> read_column(hid_t dataset) {
  const Handle space(H5Dget_space(dataset), H5Sclose, "read a space");
  const hssize_t rows = H5Sget_simple_extent_npoints(space);
  if (rows < 0) throw std::runtime_error("HDF5 could not read a dataset's length");
  std::vector<double> values(static_cast<std::size_t>(rows));
  check(H5Dread(dataset, H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, values.data()), "read a dataset");
  return values;
}

std::vector<std::string> names_in(hid_t file, const char* group) {
  std::vector<std::string> names;
  if (H5Lexists(file, group, H5P_DEFAULT) <= 0) return names;
  const auto collect = [](hid_t, const char* name, const H5L_info_t*, void* into) -> herr_t {
    static_cast<std::vector<std::string>*>(into)->emplace_back(name);
    return 0;
  };
  check(
      H5Literate_by_name(file, group, H5_INDEX_CRT_ORDER, H5_ITER_INC, nullptr, collect, &names, H5P_DEFAULT),
      "list a group");
  return names;
}

// Indices of the rows wanted: inside the span, evenly thinned, first and last kept.
std::vector<std::size_t> rows_wanted(const std::vector<double>& t_s, const SeriesSelection& selection) {
  const auto first = std::lower_bound(t_s.begin(), t_s.end(), selection.from_s);
  const auto last = std::upper_bound(first, t_s.end(), selection.to_s);
  const auto offset = static_cast<std::size_t>(first - t_s.begin());
  const auto count = static_cast<std::size_t>(last - first);
  const std::size_t wanted =
      selection.max_samples == 0 ? count : std::min(count, std::max<std::size_t>(2, selection.max_samples));
  std::vector<std::size_t> rows(wanted);
  for (std::size_t i = 0; i < wanted; ++i)
    rows[i] = offset + (wanted == count ? i : (i * (count - 1) + (wanted - 1) / 2) / (wanted - 1));
  return rows;
}

std::vector<double> pick(const std::vector<double>& values, const std::vector<std::size_t>& rows) {
  std::vector<double> picked(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (rows[i] >= values.size()) throw std::runtime_error("a dataset is shorter than its time column");
    picked[i] = values[rows[i]];
  }
  return picked;
}

}  // namespace

std::vector<char> series_image(const ChannelTable& channels, const ColumnSource& column) {
  const std::lock_guard lock(library());
  quiet();
  const Handle access(H5Pcreate(H5P_FILE_ACCESS), H5Pclose, "make a file property");
  check(H5Pset_fapl_core(access, std::size_t{1} << 16, 0), "choose the memory driver");
  const Handle file(H5Fcreate("series", H5F_ACC_TRUNC, H5P_DEFAULT, access), H5Fclose, "make a file");
  write_column(file, "time", {"time", "s", "", "simulated time"}, column(0));
  std::size_t index = 1;
  make_group(file, "state");
  for (const Channel& channel : channels.state)
    write_column(file, "state/" + channel.name, channel, column(index++));
  make_group(file, "thrusters");
  for (const Channel& channel : channels.thrusters)
    write_column(file, "thrusters/" + channel.name, channel, column(index++));
  check(H5Fflush(file, H5F_SCOPE_GLOBAL), "flush a file");
  const ssize_t size = H5Fget_file_image(file, nullptr, 0);
  if (size <= 0) throw std::runtime_error("HDF5 could not give the file's image");
  std::vector<char> bytes(static_cast<std::size_t>(size));
  if (H5Fget_file_image(file, bytes.data(), bytes.size()) != size)
    throw std::runtime_error("HDF5 could not give the file's image");
  seal(bytes);
  return bytes;
}

Series read_series(const std::filesystem::path& path, const SeriesSelection& selection) {
  if (!is_sealed(path)) throw std::runtime_error("the series is damaged: it is not what was written");
  const std::lock_guard lock(library());
  quiet();
  const Handle file(H5Fopen(path.c_str(), H5F_ACC_RDONLY, H5P_DEFAULT), H5Fclose, "open the series");
  Series series;
  std::vector<std::size_t> rows;
  {
    const Handle time(H5Dopen2(file, "time", H5P_DEFAULT), H5Dclose, "open the time");
    const std::vector<double> t_s = read_column(time);
    rows = rows_wanted(t_s, selection);
    series.t_s = pick(t_s, rows);
  }
  std::vector<std::string> known;
  for (const char* group : {"state", "thrusters"})
    for (const std::string& name : names_in(file, group)) {
      known.push_back(name);
      const auto& asked = selection.channels;
      if (!asked.empty() && std::find(asked.begin(), asked.end(), name) == asked.end()) continue;
      const Handle dataset(H5Dopen2(file, (std::string(group) + "/" + name).c_str(), H5P_DEFAULT), H5Dclose,
                           "open a dataset");
      series.columns.push_back(
          {group,
           {name, read_text_attribute(dataset, "unit"), read_text_attribute(dataset, "frame"),
            read_text_attribute(dataset, "description")},
           pick(read_column(dataset), rows)});
    }
  for (const std::string& name : selection.channels)
    if (std::find(known.begin(), known.end(), name) == known.end()) {
      std::string sentence = "there is no channel '" + name + "'; there are";
      for (const std::string& other : known) sentence += " " + other;
      throw std::invalid_argument(sentence);
    }
  return series;
}

}  // namespace slew

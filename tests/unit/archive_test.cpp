// What goes into the archive comes out of it, whole or thinned.
#include "server/service/archive.hpp"

#include <gtest/gtest.h>

#include <array>
#include <fstream>

#include "server/simulation/axis_channels.hpp"
#include "tests/service/process.hpp"

namespace {

using namespace slew;
using namespace slew::service;

SampleStore samples(std::size_t rows) {
  SampleStore store(kAxisStateChannels + kAxisThrusterChannels);
  for (std::size_t i = 0; i < rows; ++i) {
    const double t_s = 0.1 * static_cast<double>(i);
    store.push(t_s, std::array{t_s, 2 * t_s, 3 * t_s, 4 * t_s}, std::array{5 * t_s, 0.0, 0.0, 0.0, 0.0});
  }
  return store;
}

TEST(Archive, GivesBackWhatItTook) {
  const test::TemporaryDirectory directory;
  const Archive archive(directory.path());
  const auto id = wire::Id::make();
  archive.write(id, axis_channels(), samples(1000));
  const auto series = archive.read(id, {});
  ASSERT_TRUE(series);
  ASSERT_EQ(series->t_s.size(), 1000u);
  ASSERT_EQ(series->columns.size(), 9u);
  EXPECT_EQ(series->columns[0].channel.name, "angle_rad");  // in the order of the channel table
  EXPECT_EQ(series->columns[4].channel.name, "torque_N_m");
  EXPECT_EQ(series->columns[4].channel.unit, "N m");
  for (std::size_t i = 0; i < 1000; ++i) EXPECT_EQ(series->columns[4].values[i], 5 * series->t_s[i]);
  EXPECT_FALSE(archive.read(wire::Id::make(), {}));
}

TEST(Archive, SelectsAndThins) {
  const test::TemporaryDirectory directory;
  const Archive archive(directory.path());
  const auto id = wire::Id::make();
  archive.write(id, axis_channels(), samples(1000));
  SeriesSelection selection;
  selection.channels = {"rate_rad_s"};
  selection.from_s = 10;
  selection.to_s = 20;
  selection.max_samples = 11;
  const auto series = archive.read(id, selection);
  ASSERT_EQ(series->columns.size(), 1u);
  ASSERT_EQ(series->t_s.size(), 11u);
  EXPECT_DOUBLE_EQ(series->t_s.front(), 10);
  EXPECT_DOUBLE_EQ(series->t_s.back(), 20);
  selection.channels = {"no_such"};
  EXPECT_THROW(archive.read(id, selection), std::invalid_argument);
}

TEST(Archive, ADamagedFileIsAnErrorAndNoCrash) {
  const test::TemporaryDirectory directory;
  const Archive archive(directory.path());
  const auto id = wire::Id::make();
  archive.write(id, axis_channels(), samples(100));
  const auto size = std::filesystem::file_size(archive.path(id));
  for (const std::uintmax_t left : {size / 2, std::uintmax_t{100}, std::uintmax_t{0}}) {
    std::filesystem::resize_file(archive.path(id), left);
    EXPECT_THROW(archive.read(id, {}), std::runtime_error) << left;
  }
}

TEST(Archive, TrimsTheOldest) {
  const test::TemporaryDirectory directory;
  const Archive archive(directory.path());
  std::vector<wire::Id> ids;
  for (int i = 0; i < 5; ++i) {
    ids.push_back(wire::Id::make());
    archive.write(ids.back(), axis_channels(), samples(100));
  }
  const auto size = std::filesystem::file_size(archive.path(ids[0]));
  EXPECT_EQ(archive.trim(5 * size), 0u);
  EXPECT_EQ(archive.trim(2 * size + size / 2), 3u);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_EQ(archive.read(ids[i], {}).has_value(), i >= 3) << i;
}

TEST(Archive, RemovesWhatAnInterruptedWriteLeft) {
  const test::TemporaryDirectory directory;
  std::ofstream(directory.path() / "x.h5.tmp") << "half";
  const Archive archive(directory.path());
  EXPECT_TRUE(std::filesystem::is_empty(directory.path()));
}

}  // namespace

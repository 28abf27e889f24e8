// What is kept, for how long, and what is said of what is not.
#include <gtest/gtest.h>

#include <chrono>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";

// Making room is the first thing a server does.
TEST(Retention, WhatIsTooOldIsGoneWithItsSeries) {
  ServerUnderTest server({"--keep-days", "0.00003"});  // 2.6 s
  const std::string id = server.document({"run", "--preset", kPreset}).at("experiment_id");
  EXPECT_EQ(server.ctl({"series", id}).exit_code, 0);
  server.stop();
  std::this_thread::sleep_for(std::chrono::milliseconds(2700));
  server.start();
  for (int i = 0; i < 100 && server.ctl({"result", id}).exit_code == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(server.ctl({"result", id}).exit_code, 2);
  EXPECT_EQ(server.document({"history"}).at("total"), 0);
  EXPECT_TRUE(std::filesystem::is_empty(server.state() / "series"));
}

TEST(Retention, TheOldestSeriesMakeRoomAndResultsStay) {
  ServerUnderTest server({"--keep-gib", "0.00003"});  // 32 KiB
  std::vector<std::string> ids;
  for (int i = 0; i < 4; ++i)
    ids.push_back(server.document({"run", "--preset", kPreset}).at("experiment_id"));
  server.stop();
  server.start();
  for (int i = 0; i < 100 && server.ctl({"series", ids.front()}).exit_code == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  const Finished gone = server.ctl({"series", ids.front()});
  EXPECT_EQ(gone.exit_code, 1);
  EXPECT_NE(gone.errors.find("room"), std::string::npos) << gone.errors;
  EXPECT_EQ(server.ctl({"series", ids.back()}).exit_code, 0);
  for (const std::string& id : ids) EXPECT_EQ(server.document({"result", id}).at("phase"), "completed");
}

// h5py reads what slewctl wrote and what the server keeps: the same numbers, with units.
TEST(Retention, SeriesOpenInH5py) {
  const ServerUnderTest server;
  const std::string id = server.document({"run", "--preset", kPreset}).at("experiment_id");
  const auto exported = server.state() / "exported.h5";
  const auto table = server.state() / "exported.csv";
  const json told = server.document({"export", id, "--hdf5", exported.string(), "--csv", table.string()});
  EXPECT_EQ(told.at("files").size(), 2u);
  const Finished read =
      run({"/usr/bin/python3", "-c", R"py(
import csv, sys, h5py
kept, exported = h5py.File(sys.argv[1]), h5py.File(sys.argv[2])
rows = list(csv.DictReader(open(sys.argv[3])))
text = lambda value: value.decode() if isinstance(value, bytes) else str(value)
assert len(kept["time"]) == len(rows) == 206, len(rows)
names = []
kept.visititems(lambda name, item: names.append(name) if isinstance(item, h5py.Dataset) else None)
assert "state/angle_rad" in names and "thrusters/torque_N_m" in names, names
for name in names:
    assert (kept[name][:] == exported[name][:]).all(), name
    for attribute in ("unit", "description", "frame"):
        assert text(kept[name].attrs[attribute]) == text(exported[name].attrs[attribute]), (name, attribute)
assert text(exported["state/rate_rad_s"].attrs["unit"]) == "rad/s"
assert [float(row["angle_rad"]) for row in rows] == list(kept["state/angle_rad"][:])
)py",
           (server.state() / "series" / (id + ".h5")).string(), exported.string(), table.string()});
  EXPECT_EQ(read.exit_code, 0) << read.errors;
}

}  // namespace

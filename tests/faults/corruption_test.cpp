// Journal and archive tampered with, byte by byte, and files cut short: refused in words or read as far as
// they go, and never a crash. SLEW_EVERY_BYTE: of the journal too (minutes); without it a part of them.
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <iostream>
#include <random>
#include <sstream>

#include "server/service/archive.hpp"
#include "server/service/journal.hpp"
#include "tests/service/server_under_test.hpp"

namespace {

using namespace slew;
using namespace slew::test;
using nlohmann::json;

const std::string kPreset = "agrawal-bang-1995/rigid-single-sided";

std::string bytes_of(const std::filesystem::path& file) {
  std::ostringstream bytes;
  bytes << std::ifstream(file, std::ios::binary).rdbuf();
  return bytes.str();
}

void put(const std::filesystem::path& file, const std::string& bytes) {
  std::ofstream(file, std::ios::binary | std::ios::trunc) << bytes;
}

void set_byte(const std::filesystem::path& file, std::size_t at, char value) {
  std::fstream stream(file, std::ios::binary | std::ios::in | std::ios::out);
  stream.seekp(static_cast<std::streamoff>(at));
  stream.put(value);
}

// ---- the archive
// --------------------------------------------------------------------------------------------

class ArchiveCorruption : public testing::Test {
 protected:
  ArchiveCorruption() : archive_(directory_.path()) {
    ChannelTable channels;
    channels.state = {{"angle_rad", "rad", "", "angle"}};
    channels.thrusters = {{"torque_N_m", "N m", "body", "torque"}};
    service::SampleStore samples(2);
    for (int i = 0; i < 40; ++i) {
      const double state[] = {1.0 * i}, thrusters[] = {2.0 * i};
      samples.push(0.1 * i, state, thrusters);
    }
    archive_.write(id_, channels, samples);
    file_ = archive_.path(id_);
    good_ = bytes_of(file_);
  }
  TemporaryDirectory directory_;
  service::Archive archive_;
  const wire::Id id_ = wire::Id::make();
  std::filesystem::path file_;
  std::string good_;
};

TEST_F(ArchiveCorruption, OfAnyByteIsToldAndNeverRead) {
  ASSERT_EQ(archive_.read(id_, {})->t_s.size(), 40u);
  for (std::size_t at = 0; at < good_.size(); ++at) {
    set_byte(file_, at, static_cast<char>(good_[at] ^ (1 << (at % 8))));
    EXPECT_THROW(archive_.read(id_, {}), std::runtime_error) << at;
    set_byte(file_, at, good_[at]);
  }
  EXPECT_EQ(archive_.read(id_, {})->t_s.size(), 40u);
  std::cout << good_.size() << " bytes of a series\n";
}

TEST_F(ArchiveCorruption, OfAFileCutShortAnywhereIsTold) {
  for (std::size_t length = good_.size() - 1; length > 0; length -= std::min<std::size_t>(length, 7)) {
    std::filesystem::resize_file(file_, length);
    EXPECT_THROW(archive_.read(id_, {}), std::runtime_error) << length;
  }
  put(file_, "");
  EXPECT_THROW(archive_.read(id_, {}), std::runtime_error);
}

TEST(Corruption, OfASeriesIsToldToWhoAsksAndToNobodyElse) {
  const ServerUnderTest server;
  const std::string damaged = server.document({"run", "--preset", kPreset}).at("experiment_id");
  const std::string sound = server.document({"run", "--preset", kPreset}).at("experiment_id");
  const auto file = server.state() / "series" / (damaged + ".h5");
  set_byte(file, 3000, '\x5A');
  const Finished asked = server.ctl({"series", damaged});
  EXPECT_EQ(asked.exit_code, 1);
  EXPECT_NE(asked.errors.find("damaged"), std::string::npos) << asked.errors;
  EXPECT_EQ(server.ctl({"series", sound}).exit_code, 0);
  EXPECT_EQ(server.ctl({"result", damaged}).exit_code, 0);
}

// ---- the journal
// --------------------------------------------------------------------------------------------

service::JournalEntry entry(const std::string& request) {
  service::JournalEntry made;
  made.experiment_id = wire::Id::make();
  made.request_id = wire::Id::make();
  made.request = request;
  made.fingerprint = "f";
  made.accepted_unix_ns = 1;
  return made;
}

// Everything that is done with a journal; the sentence when it does not go.
std::string use(const std::filesystem::path& file) {
  std::string sentence;
  try {
    service::Journal journal(file);
    service::JournalReader reader(file);
    for (const auto& one : reader.unfinished()) reader.by_request(one.request_id);
    reader.page(10, 0);
    reader.by_prefix("0123");
    reader.count();
    journal.accept(entry("{}"), [&](const std::string& error) { sentence = error; });
    journal.flush();
  } catch (const service::JournalError& error) {
    sentence = error.what();
  }
  return sentence;
}

// In memory, so that a durable write costs nothing.
class JournalCorruption : public testing::Test {
 protected:
  JournalCorruption() {
    std::filesystem::create_directory(directory_);
    service::Journal journal(file_);
    for (int i = 0; i < 20; ++i) journal.accept(entry(std::string(300, 'r')), [](const std::string&) {});
    journal.flush();
    // As a killed server leaves it: most of it in the log.
    log_ = bytes_of(file_.string() + "-wal");
    file_only_ = bytes_of(file_);
  }
  ~JournalCorruption() override { std::filesystem::remove_all(directory_); }

  // How many of those tampered with said so.
  std::size_t tamper(const std::string& file, const std::string& log, bool in_log, std::size_t stride) {
    std::size_t told = 0, tried = 0;
    const std::string& victim = in_log ? log : file;
    for (std::size_t at = 0; at < victim.size(); at += at % 4096 < 128 ? 1 : stride) {
      put(file_, file);
      std::filesystem::remove(file_.string() + "-shm");
      log.empty() ? static_cast<void>(std::filesystem::remove(file_.string() + "-wal"))
                  : put(file_.string() + "-wal", log);
      set_byte(in_log ? file_.string() + "-wal" : file_.string(), at,
               static_cast<char>(victim[at] ^ (1 << (at % 8))));
      told += !use(file_).empty();
      ++tried;
    }
    std::cout << tried << " bytes of a " << (in_log ? "log" : "journal") << ", " << told << " noticed\n";
    return told;
  }

  const std::filesystem::path directory_ = "/dev/shm/slewd-corruption-" + std::to_string(getpid());
  const std::filesystem::path file_ = directory_ / "journal.sqlite";
  std::string log_, file_only_;
};

std::size_t stride() {
  return std::getenv("SLEW_EVERY_BYTE") ? 1 : 17;
}

TEST_F(JournalCorruption, OfTheFileIsToldOrHarmless) {
  { const service::Journal closes_it(file_); }
  const std::string whole = bytes_of(file_);
  ASSERT_TRUE(std::filesystem::remove(file_));
  put(file_, whole);
  ASSERT_EQ(use(file_), "");
  EXPECT_GT(tamper(whole, "", false, stride()), 20u);
}

// A record of the log that does not fit its checksum, and all after it, was never committed.
TEST_F(JournalCorruption, OfTheLogIsToldOrHarmless) {
  ASSERT_GT(log_.size(), 20000u);
  tamper(file_only_, log_, true, stride());
}

TEST_F(JournalCorruption, OfAFileCutShortIsToldOrHarmless) {
  { const service::Journal closes_it(file_); }
  const std::string whole = bytes_of(file_);
  std::size_t told = 0;
  for (std::size_t length = 0; length < whole.size(); length += 509) {
    put(file_, whole.substr(0, length));
    std::filesystem::remove(file_.string() + "-wal");
    std::filesystem::remove(file_.string() + "-shm");
    told += !use(file_).empty();
  }
  EXPECT_GT(told, 10u);
}

// The whole server on journals with random damage: it serves, or it says why it does not.
TEST(Corruption, OfAJournalLetsTheServerServeOrSayWhy) {
  ServerUnderTest server;
  for (int i = 0; i < 5; ++i) ASSERT_EQ(server.ctl({"run", "--preset", kPreset}).exit_code, 0);
  server.document({"submit", "--preset", kPreset, "--set", "timing.start=held"});
  server.kill();
  const auto journal = server.state() / "journal.sqlite", log = server.state() / "journal.sqlite-wal";
  const std::string killed = bytes_of(journal), good_log = bytes_of(log);
  server.start();
  ASSERT_EQ(server.stop(), 0);
  const std::string closed = bytes_of(journal);
  std::mt19937_64 random(8);
  int served = 0, said_why = 0;
  for (int i = 0; i < 16; ++i) {
    SCOPED_TRACE(i);
    const bool in_log = i % 2 == 1;
    put(journal, in_log ? killed : closed);
    put(log, in_log ? good_log : "");
    std::filesystem::remove(server.state() / "journal.sqlite-shm");
    const std::string& victim = in_log ? good_log : closed;
    for (int n = 0; n < 1 + 10 * i; ++n)
      set_byte(in_log ? log : journal, random() % victim.size(), static_cast<char>(random()));
    std::filesystem::resize_file(server.state() / "log", 0);
    Process process(server.command(), server.state() / "log");
    Process probe(server.ctl_command({"history", "--connect", "20"}), {});
    while (process.is_running() && probe.is_running())
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (process.is_running()) {
      ++served;
      const int code = server.ctl({"run", "--preset", kPreset}).exit_code;
      EXPECT_TRUE(code == 0 || code == 7 || code == 1) << code;
      process.signal(SIGTERM);
      const int end = process.wait(std::chrono::seconds(60));
      EXPECT_TRUE(end == 0 || end == 1) << end << server.log();
    } else {
      ++said_why;
      EXPECT_EQ(process.wait(std::chrono::seconds(1)), 1) << server.log();
      EXPECT_NE(server.log().find("slewd: the journal"), std::string::npos) << server.log();
    }
  }
  EXPECT_GT(served, 0);
  EXPECT_GT(said_why, 0);
  std::cout << served << " served, " << said_why << " said why not\n";
}

}  // namespace

// Queries and controls as a client may write them, over DDS, to the threads that answer them. Every one of
// them is answered, and every answer is JSON.
#include <spdlog/spdlog.h>
#include <unistd.h>

#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <nlohmann/json.hpp>

#include "idl/wire/text.hpp"
#include "server/service/intake.hpp"
#include "server/service/queries.hpp"

namespace {

using namespace slew;
using namespace slew::service;

// All of a server that listens, with one experiment of which nothing becomes.
class Listening {
 public:
  Listening()
      : domain_({1 + static_cast<std::uint32_t>(getpid()) % 99, profile()}),
        replies_(domain_),
        archive_(directory_ / "series"),
        admission_(1),
        journal_(directory_ / "journal.sqlite"),
        queries_(domain_, registry_, archive_, directory_ / "journal.sqlite"),
        intake_(domain_, registry_, journal_, directory_ / "journal.sqlite", admission_, budget_, replies_,
                {[](const FlightPointer&) {}, [](const FlightPointer&, const Wishes&) {}}),
        query_(domain_),
        control_(domain_),
        reply_(domain_),
        answer_(domain_) {
    JournalEntry entry;
    entry.experiment_id = *wire::Id::parse("0123456789abcdef0123456789abcdef");
    entry.request_id = *wire::Id::parse("fedcba9876543210fedcba9876543210");
    entry.request = R"({"preset":"agrawal-bang-1995/rigid-single-sided"})";
    registry_.add(std::make_shared<Flight>(entry, std::get<Prepared>(prepare(entry.request)), &budget_));
    journal_.accept(entry, [](const std::string&) {});
    JournalEntry ended = entry;
    ended.experiment_id = wire::Id::make();
    ended.request_id = wire::Id::make();
    journal_.accept(ended, [](const std::string&) {});
    ended.ended_unix_ns = 1;
    ended.phase = slew_v1_COMPLETED;
    ended.result = "{}";
    journal_.finish(ended, [](const std::string&) {});
    journal_.flush();
    while (query_.matched() == 0 || control_.matched() == 0 || reply_.matched() == 0 ||
           answer_.matched() == 0)
      usleep(1000);
  }

  void query(const std::string& kind, const std::string& arguments) {
    slew_v1_Query query{};
    const auto id = wire::Id::make();
    id.store(query.request_id);
    wire::store(kind, query.kind);
    query.json = wire::borrowed(arguments);
    query_.write(query);
    std::string text;
    std::uint32_t heard = 0, pages = 1;
    await([&] {
      answer_.take([&](const slew_v1_Answer& page, const dds_sample_info_t& info) {
        if (!info.valid_data || wire::Id::from(page.request_id) != id) return;
        if (page.page != heard++) std::abort();
        pages = page.pages;
        text += wire::view(page.json);
      });
      return heard == pages;
    });
    query_.unregister(query);
    if (nlohmann::json::parse(text, nullptr, false).is_discarded()) std::abort();
  }

  void control(const std::uint8_t* bytes, std::size_t size) {
    slew_v1_Control control{};
    const auto id = wire::Id::make();
    id.store(control.request_id);
    wire::Id::parse("0123456789abcdef0123456789abcdef")->store(control.experiment_id);
    if (size > 8 && bytes[8] & 1) std::memcpy(control.experiment_id, bytes, std::min<std::size_t>(size, 16));
    if (size > 9) control.action = static_cast<slew_v1_Action>(bytes[9] % 5);
    std::memcpy(&control.value, bytes, std::min(size, sizeof control.value));
    wire::store({reinterpret_cast<const char*>(bytes), size}, control.client_id);
    wire::store({reinterpret_cast<const char*>(bytes), size}, control.sender);
    control_.write(control);
    bool is_answered = false;
    await([&] {
      reply_.take([&](const slew_v1_Reply& said, const dds_sample_info_t& info) {
        if (!info.valid_data || wire::Id::from(said.request_id) != id) return;
        if (nlohmann::json::parse(wire::view(said.json), nullptr, false).is_discarded()) std::abort();
        is_answered = true;
      });
      return is_answered;
    });
    control_.unregister(control);
    replies_.forget(100, std::chrono::hours(1));
  }

 private:
  // Nobody else's: the process is alone in its domain.
  static std::string profile() {
    return "<CycloneDDS><Domain id=\"any\"><General><Interfaces><NetworkInterface name=\"lo\"/></Interfaces>"
           "<AllowMulticast>false</AllowMulticast></General><Discovery><ParticipantIndex>none</"
           "ParticipantIndex>"
           "</Discovery></Domain></CycloneDDS>";
  }
  template <typename Done>
  void await(Done&& done) {
    for (const auto until = Monotonic::now() + std::chrono::seconds(15); Monotonic::now() < until;) {
      if (done()) return;
      usleep(50);
    }
    std::abort();  // silence
  }

  struct Directory {
    Directory() : path(std::filesystem::temp_directory_path() / ("slewd-fuzz-" + std::to_string(getpid()))) {
      std::filesystem::create_directories(path);
    }
    ~Directory() { std::filesystem::remove_all(path); }
    std::filesystem::path operator/(const char* name) const { return path / name; }
    std::filesystem::path path;
  };

  Directory directory_;
  wire::Domain domain_;
  Registry registry_;
  Replies replies_;
  Archive archive_;
  Admission admission_;
  SampleBudget budget_{std::size_t{1} << 20};
  Journal journal_;
  Queries queries_;
  Intake intake_;
  wire::Writer<slew_v1_Query> query_;
  wire::Writer<slew_v1_Control> control_;
  wire::Reader<slew_v1_Reply> reply_;
  wire::Reader<slew_v1_Answer> answer_;
};

}  // namespace

// The first octet chooses what is written.
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static const bool is_quiet = (spdlog::set_level(spdlog::level::off), true);
  static Listening listening;
  if (!is_quiet || size == 0) return 0;
  static constexpr const char* kKinds[] = {"list", "history", "show", "result", "series", "describe"};
  const std::uint8_t choice = *bytes++;
  --size;
  const std::string text(reinterpret_cast<const char*>(bytes), size);
  if (choice % 8 == 7)
    listening.control(bytes, size);
  else if (choice % 8 == 6)
    listening.query(text.substr(0, 31), text);
  else
    listening.query(kKinds[choice % 8], text.substr(0, text.find('\0')));
  return 0;
}

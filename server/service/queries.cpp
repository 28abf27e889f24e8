#include "server/service/queries.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <cctype>
#include <nlohmann/json.hpp>

#include "idl/wire/text.hpp"
#include "server/experiment/experiment.hpp"
#include "server/service/replies.hpp"
#include "server/service/thread_name.hpp"

namespace slew::service {
namespace {

using nlohmann::json;

constexpr std::size_t kPage = std::size_t{64} << 10;
constexpr std::size_t kLargestQuery = std::size_t{1} << 20;
constexpr std::size_t kLargestPage = 1000;

std::string text_of(const json& document) {
  return document.dump(-1, ' ', false, json::error_handler_t::replace);
}

json entry_document(const JournalEntry& entry) {
  return {{"experiment_id", entry.experiment_id.hex()},
          {"request_id", entry.request_id.hex()},
          {"client_id", entry.client_id},
          {"sender", entry.sender},
          {"label", entry.label},
          {"preset", entry.preset},
          {"timing_mode", entry.timing_mode},
          {"phase", wire::phase_name(entry.phase)},
          {"t_sim_s", entry.t_sim_s},
          {"duration_s", entry.duration_s},
          {"progress", entry.phase == slew_v1_COMPLETED ? 1.0
                       : entry.duration_s > 0           ? std::min(1.0, entry.t_sim_s / entry.duration_s)
                                                        : 0.0},
          {"accepted_unix_ns", entry.accepted_unix_ns},
          {"started_unix_ns", entry.started_unix_ns},
          {"ended_unix_ns", entry.ended_unix_ns}};
}

// What the journal will say of a flight once it has ended, with what is known now.
JournalEntry current(const Flight& flight) {
  JournalEntry entry = flight.entry();
  entry.phase = flight.phase();
  entry.t_sim_s = flight.t_sim_s();
  entry.started_unix_ns = flight.started_unix_ns();
  entry.ended_unix_ns = flight.ended_unix_ns();
  return entry;
}

// A refusal on its way to the answer.
struct Refusal {
  Saying saying;
};

[[noreturn]] void refuse(std::string code, std::string sentence) {
  throw Refusal{{std::move(code), std::move(sentence)}};
}

template <typename T>
T argument(const json& arguments, const char* name, T otherwise) {
  const auto place = arguments.find(name);
  if (place == arguments.end() || place->is_null()) return otherwise;
  try {
    return place->get<T>();
  } catch (const json::exception&) {
    refuse("invalid", std::string("the query's '") + name + "' is of the wrong type");
  }
}

std::size_t count_argument(const json& arguments, const char* name, std::int64_t otherwise,
                           std::size_t largest) {
  const auto value = argument<std::int64_t>(arguments, name, otherwise);
  if (value < 0) refuse("invalid", std::string("the query's '") + name + "' must not be negative");
  return std::min(static_cast<std::size_t>(value), largest);
}

std::optional<wire::Phase> phase_argument(const json& arguments) {
  const auto name = argument<std::string>(arguments, "phase", "");
  if (name.empty()) return std::nullopt;
  for (int phase = slew_v1_RECEIVED; phase <= slew_v1_EXPIRED; ++phase)
    if (wire::phase_name(static_cast<wire::Phase>(phase)) == name) return static_cast<wire::Phase>(phase);
  refuse("invalid", "there is no phase '" + name + "'");
}

}  // namespace

struct Queries::Answer {
  std::string code;
  std::string text;
};

Queries::Queries(const wire::Domain& domain, const Registry& registry, const Archive& archive,
                 const std::filesystem::path& journal)
    : registry_(registry),
      archive_(archive),
      journal_(journal),
      query_(domain),
      answer_(domain),
      waitset_(domain) {
  waitset_.attach(query_.entity());
  thread_ = std::thread([this] {
    name_this_thread("queries");
    serve();
  });
}

Queries::~Queries() {
  stopping_ = true;
  waitset_.wake();
  thread_.join();
}

void Queries::serve() {
  while (!stopping_) {
    waitset_.wait(std::chrono::milliseconds(500));
    query_.take([this](const slew_v1_Query& query, const dds_sample_info_t& sample) {
      if (!sample.valid_data || stopping_) return;
      const auto id = wire::Id::from(query.request_id);
      if (id.is_zero()) return;
      const std::string_view arguments = wire::view(query.json);
      if (arguments.size() > kLargestQuery) {
        send(id, {"invalid", Saying{"invalid", "the query is larger than 1 MiB"}.json()});
        return;
      }
      send(id, answer(std::string(wire::view(query.kind)), std::string(arguments)));
    });
  }
}

Queries::Answer Queries::answer(const std::string& kind, const std::string& text) try {
  const json arguments = text.empty() ? json::object() : json::parse(text, nullptr, false);
  if (!arguments.is_object()) refuse("invalid", "a query's arguments must be a JSON object");
  if (kind == "list") return list(arguments);
  if (kind == "history") return history(arguments);
  if (kind == "show") return show(arguments);
  if (kind == "result") return result(arguments);
  if (kind == "series") return series(arguments);
  if (kind == "describe") return describe(arguments);
  refuse("invalid",
         "there is no query '" + kind + "'; there are list, history, show, result, series, describe");
} catch (const Refusal& refusal) {
  return {refusal.saying.code, refusal.saying.json()};
} catch (const std::exception& error) {
  spdlog::error("query {}: {}", kind, error.what());
  return {"unavailable", Saying{"unavailable", error.what()}.json()};
}

Queries::Answer Queries::list(const json& arguments) {
  std::size_t total = 0;
  json listed = json::array();
  for (const FlightPointer& flight :
       registry_.page(phase_argument(arguments), count_argument(arguments, "limit", 100, kLargestPage),
                      count_argument(arguments, "offset", 0, SIZE_MAX), total))
    listed.push_back(entry_document(current(*flight)));
  return {"ok", text_of({{"experiments", std::move(listed)}, {"total", total}})};
}

Queries::Answer Queries::history(const json& arguments) {
  json listed = json::array();
  for (JournalEntry& entry : journal_.page(count_argument(arguments, "limit", 100, kLargestPage),
                                           count_argument(arguments, "offset", 0, INT64_MAX))) {
    // The journal knows the beginning and the end; in between the flight itself knows better.
    if (entry.ended_unix_ns == 0)
      if (const auto flight = registry_.by_experiment(entry.experiment_id)) entry = current(*flight);
    listed.push_back(entry_document(entry));
  }
  return {"ok", text_of({{"experiments", std::move(listed)}, {"total", journal_.count()}})};
}

JournalEntry Queries::find(const json& arguments) {
  std::string digits;
  for (const char c : argument<std::string>(arguments, "id", ""))
    if (c != '-') digits.push_back(static_cast<char>(std::tolower(static_cast<unsigned char>(c))));
  if (digits.size() < 4 || digits.size() > 32 ||
      digits.find_first_not_of("0123456789abcdef") != std::string::npos)
    refuse("invalid", "'id' must be 4 to 32 hexadecimal digits");
  Found found = journal_.by_prefix(digits);
  if (found.matches == 0) refuse("not_found", "no experiment and no request begins with " + digits);
  if (found.matches > 1) refuse("ambiguous", "more than one experiment or request begins with " + digits);
  return std::move(*found.entry);
}

Queries::Answer Queries::show(const json& arguments) {
  JournalEntry entry = find(arguments);
  const std::string request = entry.request;
  if (entry.ended_unix_ns == 0)
    if (const auto flight = registry_.by_experiment(entry.experiment_id)) entry = current(*flight);
  json document = entry_document(entry);
  const auto outcome = prepare(request);
  if (const auto* prepared = std::get_if<Prepared>(&outcome)) {
    document["request"] = json::parse(prepared->resolved);
    document["warnings"] = prepared->warnings;
  } else {
    document["request"] = json::parse(request, nullptr, false);
    document["warnings"] = json::array({"this version of the server would not accept the request any more"});
  }
  return {"ok", text_of(document)};
}

Queries::Answer Queries::result(const json& arguments) {
  JournalEntry entry = find(arguments);
  if (entry.ended_unix_ns == 0)
    refuse("not_finished", "experiment " + entry.experiment_id.hex() + " has not ended yet");
  return {"ok", std::move(entry.result)};
}

Queries::Answer Queries::series(const json& arguments) {
  const JournalEntry entry = find(arguments);
  if (entry.ended_unix_ns == 0)
    refuse("not_finished", "experiment " + entry.experiment_id.hex() + " has not ended yet");
  SeriesSelection selection;
  selection.channels = argument<std::vector<std::string>>(arguments, "channels", {});
  selection.from_s = argument<double>(arguments, "from_s", selection.from_s);
  selection.to_s = argument<double>(arguments, "to_s", selection.to_s);
  selection.max_samples = count_argument(arguments, "max_samples", 0, SIZE_MAX);
  std::optional<Series> series;
  try {
    series = archive_.read(entry.experiment_id, selection);
  } catch (const std::invalid_argument& error) {
    refuse("invalid", error.what());
  }
  if (!series)
    refuse("unavailable", "experiment " + entry.experiment_id.hex() +
                              " has no archived series (none was recorded, or it was removed to make room)");
  json channels = json::array();
  json columns = json::object();
  for (SeriesColumn& column : series->columns) {
    const Channel& channel = column.channel;
    channels.push_back({{"name", channel.name},
                        {"unit", channel.unit},
                        {"frame", channel.frame},
                        {"description", channel.description},
                        {"group", column.group}});
    columns[channel.name] = std::move(column.values);
  }
  return {"ok", text_of({{"experiment_id", entry.experiment_id.hex()},
                         {"channels", std::move(channels)},
                         {"t_s", std::move(series->t_s)},
                         {"columns", std::move(columns)}})};
}

Queries::Answer Queries::describe(const json& arguments) {
  const auto request = arguments.find("request");
  if (request == arguments.end()) refuse("invalid", "describe needs a 'request'");
  const auto outcome = prepare(text_of(*request));
  if (const auto* rejection = std::get_if<Rejection>(&outcome))
    throw Refusal{{rejection->code, rejection->sentence, rejection->violations}};
  return {"ok", text_of(slew::describe(std::get<Prepared>(outcome)))};
}

// Cut where a UTF-8 character begins, so that every page is text by itself.
void Queries::send(const wire::Id& request_id, const Answer& answer) {
  std::vector<std::string> pages;
  for (std::size_t begin = 0; begin < answer.text.size();) {
    std::size_t end = std::min(begin + kPage, answer.text.size());
    while (end < answer.text.size() && (static_cast<unsigned char>(answer.text[end]) & 0xC0) == 0x80) --end;
    pages.push_back(answer.text.substr(begin, end - begin));
    begin = end;
  }
  if (pages.empty()) pages.emplace_back();
  slew_v1_Answer page{};
  request_id.store(page.request_id);
  wire::store(answer.code, page.code);
  page.pages = static_cast<std::uint32_t>(pages.size());
  for (const std::string& text : pages) {
    page.json = wire::borrowed(text);
    // A client that does not read holds up the others for 2 s at most, then loses the rest.
    if (answer_.write(page) != DDS_RETCODE_OK) {
      spdlog::warn("an answer of {} pages was given up at page {}: its reader does not take it", page.pages,
                   page.page);
      break;
    }
    ++page.page;
  }
  answer_.unregister(page);
}

}  // namespace slew::service

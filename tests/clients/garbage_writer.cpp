// A client that makes no sense: random bytes, half requests, ids of zero, wrong kinds, on every topic a
// server reads. Every sample is well-formed DDS; nothing in it is meant.
#include <array>
#include <random>
#include <thread>

#include "idl/wire/id.hpp"
#include "idl/wire/text.hpp"
#include "idl/wire/writer.hpp"
#include "server/experiment/preset.hpp"
#include "tests/clients/arguments.hpp"

namespace {

using namespace slew;
using namespace slew::clients;
using nlohmann::json;

class Garbage {
 public:
  explicit Garbage(std::uint64_t seed) : random_(seed) {}

  std::uint64_t below(std::uint64_t bound) { return random_() % bound; }

  void fill(slew_v1_Id& id) {
    const bool is_zero = below(8) == 0;
    for (auto& octet : id) octet = is_zero ? 0 : static_cast<std::uint8_t>(below(256));
  }

  // No zero byte: on the wire a text ends there.
  std::string bytes(std::size_t most) {
    std::string text(below(most), ' ');
    for (char& c : text) c = static_cast<char>(1 + below(255));
    return text;
  }

  template <std::size_t size>
  void fill(char (&text)[size]) {
    wire::store(bytes(size - 1), text);
  }

  std::string text() {
    switch (below(6)) {
      case 0:
        return bytes(2000);
      case 1:
        return std::string(below(20000), '[');
      case 2:
        return "{\"preset\":\"" + std::string(below(200000), 'x') + "\"}";
      case 3: {
        static const std::array words{"null",       "1e999",          "NaN", "\"\"", "[]",
                                      "{\"id\":7}", "{\"limit\":-1}", "-0"};
        return words[below(words.size())];
      }
      default:
        return damaged_request();
    }
  }

  double value() {
    static const std::array values{0.0,
                                   -1.0,
                                   1e300,
                                   -1e300,
                                   1e-300,
                                   std::numeric_limits<double>::infinity(),
                                   std::numeric_limits<double>::quiet_NaN()};
    return values[below(values.size())];
  }

  std::string kind() {
    static const std::array kinds{"list", "history", "show", "result", "series", "describe", "destroy", ""};
    return kinds[below(kinds.size())];
  }

 private:
  // A valid one with a few bytes of something else.
  std::string damaged_request() {
    const auto& all = presets();
    std::string text = preset_document(all[below(all.size())].name)->dump();
    for (std::uint64_t n = 1 + below(4); n > 0; --n)
      text[below(text.size())] = static_cast<char>(1 + below(255));
    return text;
  }

  std::mt19937_64 random_;
};

}  // namespace

int main(int argc, char** argv) {
  Arguments arguments("Writes garbage on the topics that a server reads.");
  std::uint64_t seed = 1;
  std::size_t count = 1000;
  double per_second = 0;
  arguments.app.add_option("--seed", seed, "of the garbage")->capture_default_str();
  arguments.app.add_option("--count", count, "samples")->capture_default_str();
  arguments.app.add_option("--per-second", per_second, "samples a second; 0: as many as get through")
      ->capture_default_str();
  if (!arguments.parse(argc, argv)) return arguments.exit_code;
  try {
    const wire::Domain domain(arguments.domain());
    wire::Writer<slew_v1_Request> request(domain);
    wire::Writer<slew_v1_Control> control(domain);
    wire::Writer<slew_v1_Query> query(domain);
    const auto until = after(arguments.for_s), match = std::min(until, after(5));
    while (request.matched() == 0 || control.matched() == 0 || query.matched() == 0) {
      if (Clock::now() >= match) {
        std::fprintf(stderr, "no server, or not permitted\n");
        return kNoServer;
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(2));
    }
    Garbage garbage(seed);
    std::size_t sent = 0, refused = 0;
    const auto begin = Clock::now();
    for (; sent < count && Clock::now() < until; ++sent) {
      const std::string text = garbage.text();
      dds_return_t code = DDS_RETCODE_OK;
      switch (garbage.below(3)) {
        case 0: {
          slew_v1_Request sample{};
          garbage.fill(sample.request_id);
          garbage.fill(sample.client_id);
          garbage.fill(sample.sender);
          sample.json = wire::borrowed(text);
          code = request.write(sample);
          request.unregister(sample);
          break;
        }
        case 1: {
          slew_v1_Control sample{};
          garbage.fill(sample.request_id);
          garbage.fill(sample.experiment_id);
          garbage.fill(sample.client_id);
          garbage.fill(sample.sender);
          sample.action = static_cast<slew_v1_Action>(garbage.below(5));
          sample.value = garbage.value();
          code = control.write(sample);
          control.unregister(sample);
          break;
        }
        default: {
          slew_v1_Query sample{};
          garbage.fill(sample.request_id);
          garbage.fill(sample.client_id);
          wire::store(garbage.kind(), sample.kind);
          sample.json = wire::borrowed(text);
          code = query.write(sample);
          query.unregister(sample);
        }
      }
      refused += code != DDS_RETCODE_OK;
      if (per_second > 0) {
        const double ahead_s = static_cast<double>(sent) / per_second - seconds_since(begin);
        if (ahead_s > 0) std::this_thread::sleep_for(std::chrono::duration<double>(ahead_s));
      }
    }
    // Until all of it has arrived, so that what comes after it comes after it.
    request.wait_for_acknowledgements(DDS_SECS(5));
    control.wait_for_acknowledgements(DDS_SECS(5));
    query.wait_for_acknowledgements(DDS_SECS(5));
    arguments.report({{"sent", sent}, {"not_taken_in_time", refused}});
    return kAllWell;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return kNoServer;
  }
}

// The way of a request: parsed, validated, built, flown for ten steps, written up. Whatever comes in, it is
// refused with reasons or flown.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "server/experiment/experiment.hpp"

namespace {

class Ignore final : public slew::SampleSink {
  void sample(double, std::span<const double>, std::span<const double>) override {}
  void event(const slew::SwitchEvent&) override {}
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const auto outcome = slew::prepare({reinterpret_cast<const char*>(bytes), size});
  if (const auto* rejection = std::get_if<slew::Rejection>(&outcome)) {
    if (rejection->sentence.empty() || rejection->violations.empty()) std::abort();
    for (const auto& violation : rejection->violations) slew::to_json(violation).dump();
    return 0;
  }
  const auto& prepared = std::get<slew::Prepared>(outcome);
  const auto run = slew::make_run(prepared);
  Ignore ignore;
  run->advance(prepared.duration_s, 10, ignore);
  slew::result_document({"e", "r", "cancelled", std::nullopt, {}}, prepared, run.get(), std::nullopt).dump();
  return 0;
}

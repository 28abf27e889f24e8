#include "server/experiment/derived_structures.hpp"

#include <list>
#include <mutex>
#include <nlohmann/json.hpp>
#include <string>

#include "server/simulation/digest.hpp"

namespace slew {
namespace {

using nlohmann::json;

constexpr std::size_t kKept = 16;

/// All that a model and a design depend on. The command, its angle and its shaper do not change them.
std::string digest_of(const json& request) {
  json parts = {request.at("plant"),
                request.at("controller"),
                request.at("actuator"),
                request.at("estimator"),
                request.at("sensors").value("groups", json()),
                request.at("guidance").at("zero_order_loads"),
                request.at("simulation").at("duration_s"),
                request.at("simulation").at("relative_tolerance")};
  Digester digester;
  for (const char c : parts.dump()) digester.word(static_cast<unsigned char>(c));
  return digester.digest().hex();
}

struct Kept {
  std::mutex mutex;
  std::list<std::pair<std::string, std::shared_ptr<const StructureSystem>>> lately;  ///< the latest first
  std::size_t derived = 0;

  static Kept& all() {
    static Kept one;
    return one;
  }

  std::shared_ptr<const StructureSystem> find(const std::string& digest) {
    const std::lock_guard lock(mutex);
    for (auto place = lately.begin(); place != lately.end(); ++place)
      if (place->first == digest) {
        lately.splice(lately.begin(), lately, place);
        return place->second;
      }
    return nullptr;
  }
  void keep(const std::string& digest, std::shared_ptr<const StructureSystem> system) {
    const std::lock_guard lock(mutex);
    ++derived;
    lately.emplace_front(digest, std::move(system));
    if (lately.size() > kKept) lately.pop_back();
  }
};

}  // namespace

std::shared_ptr<const StructureSystem> derived_structure(const json& request,
                                                         const StructureSpecification& spec) try {
  const std::string digest = digest_of(request);
  if (const auto known = Kept::all().find(digest)) return with_command(*known, spec);
  auto system = build_structure_system(spec);
  Kept::all().keep(digest, system);
  return system;
} catch (const StructureFault&) {
  return nullptr;
}

std::size_t structures_derived() {
  const std::lock_guard lock(Kept::all().mutex);
  return Kept::all().derived;
}

}  // namespace slew

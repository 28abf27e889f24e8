#include "server/experiment/preset.hpp"

#include <map>
#include <nlohmann/json.hpp>

#include "schemas/embedded.hpp"

namespace slew {
namespace {

constexpr std::string_view kFolder = "presets/";
constexpr std::string_view kSuffix = ".json";

const std::map<std::string, nlohmann::json, std::less<>>& documents() {
  static const auto all = [] {
    std::map<std::string, nlohmann::json, std::less<>> found;
    for (const EmbeddedFile& file : embedded_files())
      if (file.name.starts_with(kFolder)) {
        const auto name = file.name.substr(kFolder.size());
        found.emplace(name.substr(0, name.size() - kSuffix.size()), nlohmann::json::parse(file.text));
      }
    return found;
  }();
  return all;
}

}  // namespace

const std::vector<Preset>& presets() {
  static const auto all = [] {
    std::vector<Preset> found;
    for (const auto& [name, document] : documents())
      found.push_back({name, document.at("summary"), document.at("source")});
    return found;
  }();
  return all;
}

const nlohmann::json* preset_document(std::string_view name) {
  const auto place = documents().find(name);
  return place == documents().end() ? nullptr : &place->second;
}

}  // namespace slew

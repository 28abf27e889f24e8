#include "server/service/plan_cache.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>
#include <vector>

#include "server/service/fingerprint.hpp"

namespace slew::service {
namespace {

namespace fs = std::filesystem;

// Of some kilobytes each. Beyond that the older half goes.
constexpr std::size_t kMostPlans = 4096;

std::vector<fs::directory_entry> oldest_first(const fs::path& directory) {
  std::vector<fs::directory_entry> files;
  std::error_code error;
  for (fs::directory_iterator file(directory, error), end; !error && file != end; file.increment(error))
    files.push_back(*file);
  std::sort(files.begin(), files.end(), [](const auto& a, const auto& b) {
    std::error_code ignored;
    return a.last_write_time(ignored) < b.last_write_time(ignored);
  });
  return files;
}

}  // namespace

PlanCache::PlanCache(fs::path directory) : directory_(std::move(directory)) {
  std::error_code error;
  fs::create_directories(directory_, error);
  if (error) spdlog::error("plans are not kept: {}: {}", directory_.string(), error.message());
  count_ = oldest_first(directory_).size();
}

fs::path PlanCache::file_of(const std::string& problem_text) const {
  return directory_ / (fingerprint_of(problem_text) + ".json");
}

std::optional<nlohmann::json> PlanCache::find(const std::string& problem_text) const {
  std::ifstream file(file_of(problem_text));
  if (!file) return std::nullopt;
  const auto kept = nlohmann::json::parse(file, nullptr, false);
  // The whole problem stands in the file: neither damage nor a digest that two problems share passes.
  if (!kept.is_object() || kept.value("problem", "") != problem_text || !kept.contains("plan"))
    return std::nullopt;
  const nlohmann::json& plan = kept.at("plan");
  if (fingerprint_of(plan.dump()) != kept.value("fingerprint", "")) return std::nullopt;
  return plan;
}

void PlanCache::keep(const std::string& problem_text, const nlohmann::json& plan) {
  if (count_ >= kMostPlans) {
    const auto files = oldest_first(directory_);
    std::error_code ignored;
    for (std::size_t i = 0; i < files.size() / 2; ++i) fs::remove(files[i], ignored);
    count_ = files.size() - files.size() / 2;
  }
  const fs::path place = file_of(problem_text), unfinished = place.string() + ".part";
  {
    std::ofstream file(unfinished);
    file << nlohmann::json{
        {"problem", problem_text}, {"plan", plan}, {"fingerprint", fingerprint_of(plan.dump())}};
    if (!file.flush()) spdlog::error("a plan is not kept: {} cannot be written", unfinished.string());
  }
  std::error_code error;
  fs::rename(unfinished, place, error);
  if (error)
    spdlog::error("a plan is not kept: {}: {}", place.string(), error.message());
  else
    ++count_;
}

}  // namespace slew::service

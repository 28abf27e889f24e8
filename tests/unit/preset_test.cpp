#include "server/experiment/preset.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "server/experiment/experiment.hpp"

namespace slew {
namespace {

using nlohmann::json;

TEST(Preset, EachCanBeFlownAsItIs) {
  ASSERT_GE(presets().size(), 10u);
  for (const Preset& preset : presets()) {
    SCOPED_TRACE(preset.name);
    const auto outcome = prepare(json({{"preset", preset.name}}).dump());
    ASSERT_TRUE(std::holds_alternative<Prepared>(outcome)) << std::get<Rejection>(outcome).sentence;
    EXPECT_EQ(std::get<Prepared>(outcome).preset, preset.name);
  }
}

TEST(Preset, EachSaysWhatItShowsAndByWhom) {
  for (const Preset& preset : presets()) {
    EXPECT_FALSE(preset.summary.empty()) << preset.name;
    EXPECT_FALSE(preset.source.empty()) << preset.name;
    // Names go where paths of --set and files go.
    EXPECT_EQ(preset.name.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789-/"), std::string::npos)
        << preset.name;
    EXPECT_EQ(std::count(preset.name.begin(), preset.name.end(), '/'), 1) << preset.name;
    EXPECT_EQ(preset_document(preset.name)->size(), 3u) << preset.name;
  }
  EXPECT_TRUE(std::is_sorted(presets().begin(), presets().end(),
                             [](const Preset& a, const Preset& b) { return a.name < b.name; }));
}

TEST(Preset, NamesAreNoPaths) {
  for (const char* name : {"../../etc/passwd", "/etc/passwd", "", "agrawal-bang-1995", "agrawal-bang-1995/",
                           "./agrawal-bang-1995/rigid-single-sided", "../limits.schema",
                           "agrawal-bang-1995/rigid-single-sided.json", "agrawal-bang-1995/../x"})
    EXPECT_EQ(preset_document(name), nullptr) << name;
  EXPECT_NE(preset_document("agrawal-bang-1995/rigid-single-sided"), nullptr);
}

}  // namespace
}  // namespace slew

#include "server/experiment/document.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "server/experiment/limits.hpp"

namespace slew {
namespace {

using nlohmann::json;

std::vector<Violation> violations_of(std::string_view text) {
  auto outcome = parse_document(text);
  auto* violations = std::get_if<std::vector<Violation>>(&outcome);
  return violations ? std::move(*violations) : std::vector<Violation>();
}

// For texts with exactly one thing wrong.
Violation violation_of(std::string_view text) {
  const auto violations = violations_of(text);
  EXPECT_EQ(violations.size(), 1u) << text.substr(0, 100);
  return violations.empty() ? Violation{} : violations.front();
}

bool mentions(const std::string& sentence, std::string_view what) {
  return sentence.find(what) != std::string::npos;
}

TEST(Document, AnObjectIsReadAsItStands) {
  const auto outcome = parse_document(R"({"a": [1, 2.5e-3, "\u00e9", true, null]})");
  ASSERT_TRUE(std::holds_alternative<json>(outcome));
  EXPECT_EQ(std::get<json>(outcome), json({{"a", {1, 0.0025, "\u00e9", true, nullptr}}}));
}

TEST(Document, BrokenJsonSaysWhere) {
  const Violation violation = violation_of("{\n  \"a\": 1,\n  \"b\": ]\n}");
  EXPECT_EQ(violation.pointer, "");
  EXPECT_TRUE(mentions(violation.problem, "line 3, column 8")) << violation.problem;
  for (const char* text :
       {"", " ", "{", "{\"a\":", "{\"a\":\"", "{\"a\":1}}", "{'a':1}", "{\"a\":1,}", "\xEF\xBB"})
    EXPECT_EQ(violations_of(text).size(), 1u) << text;
}

TEST(Document, TheTopIsAnObject) {
  for (const char* text : {"[]", "1", "\"text\"", "null", "true"})
    EXPECT_EQ(violation_of(text).allowed, "an object") << text;
}

TEST(Document, EveryKeyThatComesTwiceIsNamed) {
  const auto violations = violations_of(R"({"a":1,"b":[{"c":1,"c":2},{"c":1}],"a":3})");
  ASSERT_EQ(violations.size(), 2u);
  EXPECT_EQ(violations[0].pointer, "/b/0/c");
  EXPECT_EQ(violations[1].pointer, "/a");
  // Escaped, it is the same key all the same.
  EXPECT_EQ(violation_of("{\"a\":1,\"\\u0061\":2}").pointer, "/a");
}

TEST(Document, NumbersAreFinite) {
  EXPECT_EQ(violation_of(R"({"a":{"b":[0,1e999]}})").pointer, "/a/b/1");
  EXPECT_EQ(violation_of(R"({"a":-1e999})").given, "-1e999");
  for (const char* text : {R"({"a":NaN})", R"({"a":Infinity})", R"({"a":-Infinity})"}) {
    EXPECT_EQ(violation_of(text).pointer, "/a") << text;
    EXPECT_EQ(violation_of(text).allowed, "a finite number") << text;
  }
  EXPECT_TRUE(violations_of(R"({"a":1.7976931348623157e308,"b":1e-400})").empty());
}

TEST(Document, OnlyUtf8) {
  for (const char* bad :
       {"\xff", "\xc0\xaf", "\xe0\x80\xaf", "\xed\xa0\x80", "\xf4\x90\x80\x80", "\x80", "\xc3"}) {
    const Violation violation = violation_of("{\"a\":\"" + std::string(bad) + "\"}");
    EXPECT_EQ(violation.allowed, "UTF-8");
    EXPECT_TRUE(mentions(violation.problem, "byte 6")) << violation.problem;
  }
  EXPECT_TRUE(violations_of("{\"a\":\"\xc3\xa9\xe2\x82\xac\xf0\x9f\x9b\xb0\"}").empty());
}

TEST(Document, NothingIsHiddenBehindANul) {
  const std::string text = std::string(R"({"a":1})") + '\0' + "rubbish";
  EXPECT_TRUE(mentions(violation_of(text).problem, "NUL"));
  EXPECT_TRUE(mentions(violation_of(std::string(1, '\0')).problem, "NUL"));
}

TEST(Document, TooLargeIsRefusedUnread) {
  const std::string text = R"({"a":")" + std::string(2 << 20, 'x') + "\"}";
  EXPECT_TRUE(mentions(violation_of(text).problem, "too large"));
}

TEST(Document, TenThousandArraysAreRefusedUnread) {
  const std::string open(10000, '['), close(10000, ']');
  EXPECT_EQ(violation_of(R"({"a":)" + open + close + "}").given, "10001 levels");
  EXPECT_TRUE(mentions(violation_of(open).problem, "nested"));
  // Brackets in a string nest nothing.
  EXPECT_TRUE(violations_of(R"({"a":"\"[[[)" + open + "\"}").empty());
}

TEST(Document, TheDeepestThatIsAllowed) {
  const std::size_t most = limits().max_nesting_depth;
  const auto nested = [](std::size_t depth) {
    return R"({"a":)" + std::string(depth - 1, '[') + std::string(depth - 1, ']') + "}";
  };
  EXPECT_TRUE(violations_of(nested(most)).empty());
  EXPECT_EQ(violations_of(nested(most + 1)).size(), 1u);
}

TEST(Document, LongArraysAreNamed) {
  std::string items = "0";
  for (std::size_t i = 1; i < limits().max_items; ++i) items += ",0";
  EXPECT_TRUE(violations_of(R"({"a":{"b":[)" + items + "]}}").empty());
  EXPECT_EQ(violation_of(R"({"a":{"b":[)" + items + ",0]}}").pointer, "/a/b");
}

TEST(Document, WhatIsGivenIsShownShortened) {
  EXPECT_LE(shortened(std::string(1000, 'x')).size(), 200u);
  EXPECT_EQ(shortened(json(1.5)), "1.5");
  // Cut between characters, never inside one.
  std::string text;
  for (int i = 0; i < 300; ++i) text += "\u00e9";
  EXPECT_TRUE(violations_of("{\"a\":" + json(shortened(text)).dump() + "}").empty());
}

TEST(Document, RandomBytesAreAnsweredNotObeyed) {
  std::mt19937 random(1);
  const std::string alphabet = "{}[]\",:0123456789eE+-.truefalsn\\u \n\xc3\xa9\xff";
  for (int i = 0; i < 20000; ++i) {
    std::string text(random() % 40, ' ');
    for (char& c : text) c = i % 2 ? alphabet[random() % alphabet.size()] : static_cast<char>(random() % 256);
    const auto outcome = parse_document(text);
    if (const auto* document = std::get_if<json>(&outcome))
      EXPECT_TRUE(document->is_object());
    else
      EXPECT_FALSE(std::get<std::vector<Violation>>(outcome).empty());
  }
}

}  // namespace
}  // namespace slew

// Texts into the bounded strings of the wire and back, and ids as people write them.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "idl/wire/id.hpp"
#include "idl/wire/text.hpp"

namespace {

void require(bool holds) {
  if (!holds) std::abort();
}

bool begins_a_character(char c) {
  return (static_cast<unsigned char>(c) & 0xC0) != 0x80;
}

// What is stored is a beginning of the text, ends with a zero, and is cut where a character begins.
template <std::size_t N>
void store_and_view(std::string_view text) {
  char target[N + 1];
  target[N] = '\x7F';  // nobody's
  slew::wire::store(text, reinterpret_cast<char(&)[N]>(target));
  require(target[N] == '\x7F');
  const std::string_view whole = text.substr(0, text.find('\0'));
  const std::string_view stored = slew::wire::view(reinterpret_cast<char(&)[N]>(target));
  require(stored.size() < N && whole.starts_with(stored));
  if (stored.size() < whole.size() && text.size() == whole.size())
    require(stored.empty() || begins_a_character(whole[stored.size()]));
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(bytes), size);
  store_and_view<2>(text);
  store_and_view<33>(text);
  store_and_view<65>(text);
  store_and_view<129>(text);
  store_and_view<257>(text);
  if (const auto id = slew::wire::Id::parse(text)) {
    require(id->hex().size() == 32);
    require(slew::wire::Id::parse(id->hex()) == id);
  }
  return 0;
}

// From a long sequence that fails to a short one that still does.
#pragma once

#include <algorithm>
#include <vector>

namespace slew::test {

/// Leaves out what is not needed for `fails(sequence)`, larger pieces first, trying at most `tries` times.
template <typename Step, typename Fails>
std::vector<Step> shrink(std::vector<Step> sequence, Fails&& fails, int tries) {
  for (std::size_t piece = sequence.size() / 2; piece > 0; piece /= 2)
    for (std::size_t begin = 0; begin < sequence.size() && tries > 0;) {
      std::vector<Step> shorter(sequence.begin(), sequence.begin() + static_cast<std::ptrdiff_t>(begin));
      const std::size_t end = std::min(begin + piece, sequence.size());
      shorter.insert(shorter.end(), sequence.begin() + static_cast<std::ptrdiff_t>(end), sequence.end());
      --tries;
      if (fails(shorter))
        sequence = std::move(shorter);
      else
        begin = end;
    }
  return sequence;
}

}  // namespace slew::test

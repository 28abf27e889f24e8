#include "server/control/root_locus.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "server/control/frequency_response.hpp"

namespace slew {
namespace {

using Complex = std::complex<double>;
using Poles = std::vector<Complex>;

constexpr double kFinestStep = 1.0 / 4096;  // of a decade
constexpr std::size_t kMostGains = 4000;

// `next` in the order in which it continues `before`: nearest pairs first.
Poles continued(const Poles& before, const Poles& next) {
  struct Pair {
    double distance;
    std::size_t from, to;
  };
  const std::size_t n = before.size();
  std::vector<Pair> pairs;
  pairs.reserve(n * n);
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; j < n; ++j) pairs.push_back({std::abs(before[i] - next[j]), i, j});
  std::stable_sort(pairs.begin(), pairs.end(),
                   [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
  Poles ordered(n);
  std::vector<bool> is_left(n), is_taken(n);
  for (const Pair& pair : pairs) {
    if (is_left[pair.from] || is_taken[pair.to]) continue;
    ordered[pair.from] = next[pair.to];
    is_left[pair.from] = is_taken[pair.to] = true;
  }
  return ordered;
}

class Tracer {
 public:
  Tracer(const ControlLoop& loop, double radius_rad_s) : loop_(loop), radius_(radius_rad_s) {
    locus_.branches.resize(static_cast<std::size_t>(loop.size()));
    add(0, loop.loop_poles());
  }

  // On to `gain`, by way of the middle while something moves too far.
  void go_to(double gain) {
    const Poles next = continued(last_, loop_.poles(gain));
    const double from = locus_.gains.back();
    const bool is_fine = from > 0 && std::log10(gain / from) < kFinestStep;
    if (!is_fine && is_far(next) && locus_.gains.size() < kMostGains && gain > 1e-9) {
      go_to(from > 0 ? std::sqrt(from * gain) : 0.25 * gain);
      return go_to(gain);
    }
    add(gain, next);
  }

  RootLocus take() { return std::move(locus_); }

 private:
  void add(double gain, const Poles& poles) {
    locus_.gains.push_back(gain);
    for (std::size_t i = 0; i < poles.size(); ++i) locus_.branches[i].push_back(poles[i]);
    last_ = poles;
  }
  bool is_far(const Poles& next) const {
    for (std::size_t i = 0; i < next.size(); ++i) {
      const double size = std::max(std::min(std::abs(last_[i]), std::abs(next[i])), radius_);
      if (std::abs(next[i] - last_[i]) > 0.01 * size) return true;
    }
    return false;
  }

  const ControlLoop& loop_;
  const double radius_;
  RootLocus locus_;
  Poles last_;
};

}  // namespace

bool is_stable(const Poles& poles) {
  double most = 0;
  for (const Complex pole : poles) most = std::max(most, std::abs(pole));
  return std::all_of(poles.begin(), poles.end(),
                     [&](Complex pole) { return pole.real() < -1e-13 * most && std::isfinite(pole.real()); });
}

// Between two gains at which a pole is on the axis nothing changes.
std::vector<StableGains> stable_gains(const ControlLoop& loop) {
  auto crossings = phase_crossovers(loop);
  std::sort(crossings.begin(), crossings.end(),
            [](const PhaseCrossover& a, const PhaseCrossover& b) { return a.loop_gain < b.loop_gain; });
  std::vector<StableGains> found;
  bool was_stable = false;
  for (std::size_t i = 0; i <= crossings.size(); ++i) {
    const bool is_first = i == 0, is_last = i == crossings.size();
    const double from = is_first ? 0 : crossings[i - 1].loop_gain;
    const double to = is_last ? std::numeric_limits<double>::infinity() : crossings[i].loop_gain;
    const double within = is_first ? (is_last ? 1 : 0.5 * to) : is_last ? 2 * from : std::sqrt(from * to);
    const bool stable = is_stable(loop.poles(within));
    if (stable && !was_stable)
      found.push_back({from, to, is_first ? std::nullopt : std::optional(crossings[i - 1].frequency_rad_s),
                       std::nullopt});
    if (stable) {
      found.back().to = to;
      found.back().to_crossing_rad_s = is_last ? std::nullopt : std::optional(crossings[i].frequency_rad_s);
    }
    was_stable = stable;
  }
  return found;
}

RootLocus root_locus(const ControlLoop& loop, double most_gain, double radius_rad_s) {
  constexpr int kPerDecade = 20;
  std::vector<double> gains;
  for (int i = -4 * kPerDecade; std::pow(10.0, i / double{kPerDecade}) < most_gain; ++i)
    gains.push_back(std::pow(10.0, i / double{kPerDecade}));
  for (const PhaseCrossover& crossing : phase_crossovers(loop))
    if (crossing.loop_gain < most_gain) gains.push_back(crossing.loop_gain);
  gains.push_back(most_gain);
  if (most_gain > 1) gains.push_back(1);
  std::sort(gains.begin(), gains.end());
  gains.erase(std::unique(gains.begin(), gains.end()), gains.end());
  Tracer tracer(loop, radius_rad_s);
  for (const double gain : gains) tracer.go_to(gain);
  return tracer.take();
}

}  // namespace slew

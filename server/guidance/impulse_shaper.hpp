// Input shaping: a command, convolved with impulses that sum to 1, leaves no vibration in the modes that they
// are made for (Singer & Seering 1990), whatever the command and the linear plant.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace slew {

struct Impulse {
  double time_s;
  double amplitude;
};

/// Two impulses, half a damped period apart (ZV): A1 = 1/(1+K), A2 = K/(1+K),
/// K = exp(-zeta pi / sqrt(1 - zeta^2)). Expects 0 <= zeta < 1.
std::vector<Impulse> zero_vibration(double frequency_rad_s, double damping_ratio);

/// Three (ZVD): the vibration's slope over the mode's frequency is zero too. It is the ZV shaper twice.
std::vector<Impulse> zero_vibration_and_derivative(double frequency_rad_s, double damping_ratio);

/// One shaper after the other: for two modes at once.
std::vector<Impulse> convolved(const std::vector<Impulse>& a, const std::vector<Impulse>& b);

/// What is left of the vibration of a mode after the last impulse, over that of a single impulse of 1.
double residual_vibration(const std::vector<Impulse>& impulses, double frequency_rad_s, double damping_ratio);

/// A mode to shape for.
struct VibratingMode {
  double frequency_rad_s = 0;  ///< undamped
  double damping_ratio = 0;
};

enum class ShaperType { none, zero_vibration, zero_vibration_and_derivative };

/// Which shaper, and for which modes: those of what is commanded, and others that are known.
struct ImpulseShaper {
  ShaperType type = ShaperType::none;
  std::vector<std::size_t> modes;  ///< places among those of what is commanded, from 0
  std::vector<VibratingMode> known_modes;

  bool is_there() const { return type != ShaperType::none; }
  /// Of all its modes together: two to the number of modes, or three.
  double impulse_count() const;
};

/// A shaper has no more impulses than that: every one of them is one more copy of the command.
inline constexpr double kMostImpulses = 256;

/// The modes to shape for: of `own`, and then the known ones. Throws std::invalid_argument, with a sentence,
/// where there is no such mode, or where it does not oscillate or grows by itself.
std::vector<VibratingMode> shaped_modes(const ImpulseShaper& shaper, std::span<const VibratingMode> own);

/// Ascending in time, from 0; none where nothing is shaped. Throws std::invalid_argument as shaped_modes(),
/// and where there would be too many.
std::vector<Impulse> impulses_of(const ImpulseShaper& shaper, std::span<const VibratingMode> own);

/// A command that is constant in pieces: `value` in [from, to), 0 elsewhere.
struct HeldCommand {
  double from_s;
  double to_s;
  double value;
};

/// The same, shaped. Expects pieces and impulses that ascend, apart from each other; what comes out does too,
/// and neighbours in it differ. Edges that only rounding keeps apart are one.
std::vector<HeldCommand> shaped(std::span<const HeldCommand> command, std::span<const Impulse> impulses);

}  // namespace slew

// The shaper of a request's guidance: which command it shapes, for which modes.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "server/experiment/document.hpp"
#include "server/experiment/sound_fields.hpp"
#include "server/guidance/impulse_shaper.hpp"

namespace slew {

/// Where shaping makes no sense with the plant, the law and the actuator of a request; not of a structure's,
/// whose command is always one that can be shaped.
void check_shaper(const SoundFields& fields, const Violate& violate);

// The rest expects what the schema has passed.

/// Of a guidance block; none where it has no shaper.
ImpulseShaper specify_shaper(const nlohmann::json& guidance);

/// The impulses, or none where shaper_violations() tells why.
std::vector<Impulse> impulses_or_none(const ImpulseShaper& shaper, std::span<const VibratingMode> own);

/// What is shaped: whose modes it makes vibrate ("the closed loop"), in how many pieces it comes ("firings"),
/// and how many of them there may be once every impulse has its own.
struct ShapedCommand {
  std::string whose;
  std::string pieces;
  double count = 0, most = 0;
};

/// What only the modes themselves tell.
std::vector<Violation> shaper_violations(const ImpulseShaper& shaper, std::span<const VibratingMode> own,
                                         const ShapedCommand& command);

/// For descriptions: the modes that can be asked for, those shaped for, the impulses, and when the command
/// ends without and with them.
nlohmann::json command_document(const ImpulseShaper& shaper, std::span<const VibratingMode> own,
                                const std::vector<Impulse>& impulses, double unshaped_end_s);
nlohmann::json impulses_document(const std::vector<Impulse>& impulses);

/// A command that ends after the run.
void warn_of_late_arrival(const std::vector<Impulse>& impulses, double unshaped_end_s, double duration_s,
                          std::vector<std::string>& warnings);

}  // namespace slew

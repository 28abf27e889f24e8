// From a request's text to an experiment that is ready to run, and from its report to the result document.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "server/experiment/document.hpp"
#include "server/simulation/attitude.hpp"
#include "server/simulation/axis.hpp"
#include "server/simulation/run.hpp"
#include "server/simulation/structure.hpp"

namespace slew {

enum class TimingMode { as_fast_as_possible, real_time, scaled };
std::string timing_mode_name(TimingMode mode);

enum class TimingStart { now, held, wall_time };

struct TimingSpecification {
  TimingMode mode = TimingMode::as_fast_as_possible;
  double rate = 1;  ///< simulated per wall second
  TimingStart start = TimingStart::now;
  std::int64_t start_unix_ns = 0;   ///< with TimingStart::wall_time
  std::optional<double> expires_s;  ///< after acceptance; not begun by then, never begun
  bool run_again_after_restart = false;
};

struct TelemetrySpecification {
  double sample_period_s = 0;  ///< simulated
  double publish_max_hz = 0;   ///< wall
  bool lossless = false;       ///< every sample, as fast as its readers acknowledge
};

/// What a request asks to be flown.
using System = std::variant<OnOffAxisSpecification, LinearAxisSpecification, AttitudeSpecification,
                            StructureSpecification>;

struct PlanningTask;  // guidance_request.hpp

/// A request that may be flown, once it is planned. Any number of runs can be made from it.
struct Prepared {
  std::string resolved;  ///< the complete request as JSON text: preset, overrides and defaults in one
  std::string preset;
  std::string label;
  std::vector<std::string> warnings;
  double duration_s = 0;
  std::uint64_t seed = 0;
  TimingSpecification timing;
  TelemetrySpecification telemetry;
  bool verify = false;
  std::uint64_t ballast_operations_per_step = 0;
  System system;
  std::shared_ptr<const PlanningTask> planning;  ///< what must be planned before it flies; null: nothing
  std::string plan;                              ///< as JSON text, once there is one (planning.hpp)

  bool awaits_plan() const { return planning && plan.empty(); }
};

/// A request that may not: a code for programs, a sentence for people, and every reason.
struct Rejection {
  std::string code;
  std::string sentence;
  std::vector<Violation> violations;
};

/// Parses, resolves the preset, fills in defaults, validates against schema and physics. Controls that are
/// given are adopted at once; a search is left to the caller.
std::variant<Prepared, Rejection> prepare(std::string_view request_text);

std::unique_ptr<Run> make_run(const Prepared& prepared);
/// The same request by SUNDIALS.
std::unique_ptr<Run> make_verification(const Prepared& prepared);

/// What the requested system is, without flying it: parameters, regime, closed-form predictions.
nlohmann::json describe(const Prepared& prepared);

/// What pictures of the design are drawn from: its `type`; for linear laws root locus and Bode's curves, for
/// on-off ones the phase plane, in three axes the modulator's duty cycle; "none", and a `sentence`, where
/// there is nothing to draw.
nlohmann::json design_curves(const Prepared& prepared);

/// What the plant is made of: inertias, modes and couplings as they fly; for a frame also its mass properties
/// and all its modes, derived anew. "frame" is null for a plant that has none. Of a rigid body its principal
/// moments and axes; of a flexible structure mass properties, frequencies, what its reductions make wrong,
/// receptances, the design's eigenvalues, and the slew's loads at the times of outputs.at_s.
nlohmann::json model(const Prepared& prepared);

/// What the service knows of a result besides the run's own report.
struct ResultHeading {
  std::string experiment_id;
  std::string request_id;
  std::string phase;
  std::optional<RunFailure> failure;
  std::vector<std::string> warnings;
};

/// schemas/result.schema.json. `run` is null when the run never began.
nlohmann::json result_document(const ResultHeading& heading, const Prepared& prepared, const Run* run,
                               const std::optional<Verification>& verification);

/// What the bits of a run depend on besides request, seed and version: architecture, C library, the processor
/// features by which it chooses its mathematical functions.
std::string platform();

}  // namespace slew

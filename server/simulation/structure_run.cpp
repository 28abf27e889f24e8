// Slews of a flexible structure by ARKODE's implicit Runge-Kutta method. A step of the loop goes from one
// boundary to the next: a tenth of a second, where a pulse begins or ends, where noise changes. The solver is
// reset at each of them with the step size that it had, and what it does in between is kept as polynomials:
// so slices, samples and copies change no bit.
#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>
#include <utility>

#include "server/propagation/dirk_solver.hpp"
#include "server/propagation/erk_solver.hpp"
#include "server/random/random_stream.hpp"
#include "server/simulation/stepped_run.hpp"
#include "server/simulation/structure_channels.hpp"
#include "server/simulation/structure_metrics.hpp"

namespace slew {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kBoundary_s = 0.1;
/// Boundaries nearer to each other are one.
constexpr double kApart_s = 1e-9;
/// The solver's steps between two boundaries; one that takes more makes a boundary of its own.
constexpr Index kMostPieces = 256;
/// What has grown beyond is no small departure from a rigid slew any more, in m and rad.
constexpr double kDiverged = 1e6;
/// Rounding of a stiff structure's coefficients leaves no more than that.
constexpr double kFinestTolerance = 1e-11;

class StructureRun final : public SteppedRun {
 public:
  explicit StructureRun(const StructureSpecification& specification);
  StructureRun(const StructureRun& other);

  const std::vector<std::string>& event_channels() const override {
    static const std::vector<std::string> none;
    return none;
  }
  double duration_s() const override { return spec_->duration_s; }
  RunReport report() const override;
  std::unique_ptr<Run> clone() const override { return std::make_unique<StructureRun>(*this); }

 private:
  void open_step(SampleSink& sink) override;
  void close_step() override;
  void digest_state() override;
  void fill_row(double t_s, std::span<double> state, std::span<double> thrusters) override;

  double next_boundary() const;
  void hold_noise();
  void start_solver();
  void fly_to(double boundary_s);
  StructurePiece piece(Index i) const;

  static int slope(sunrealtype t, N_Vector state, N_Vector slope, void* self) {
    static_cast<StructureRun*>(self)->loop_.slope(t, NV_DATA_S(state), NV_DATA_S(slope));
    return 0;
  }
  static int jacobian(sunrealtype t, N_Vector, N_Vector, SUNMatrix matrix, void* self, N_Vector, N_Vector,
                      N_Vector) {
    static_cast<StructureRun*>(self)->loop_.jacobian(t, SUNDenseMatrix_Data(matrix));
    return 0;
  }

  std::shared_ptr<const StructureSpecification> spec_;
  StructureLoop loop_;
  std::unique_ptr<DirkSolver> solver_;
  double step_s_ = 0;  ///< that the solver has come to; 0: not yet

  // The open step: states and slopes where the solver's own steps begin and end.
  std::vector<double> times_s_;
  Eigen::MatrixXd states_, slopes_;
  Index pieces_ = 0;

  VectorXd row_, noise_, sensor_noise_;
  StructureMeter meter_;
};

StructureRun::StructureRun(const StructureSpecification& specification)
    : spec_(std::make_shared<const StructureSpecification>(specification)),
      loop_(spec_->system),
      times_s_(static_cast<std::size_t>(kMostPieces + 1)),
      states_(Eigen::MatrixXd::Zero(loop_.size(), kMostPieces + 1)),
      slopes_(states_),
      row_(VectorXd::Zero(loop_.size())),
      noise_(VectorXd::Zero(spec_->system->plant.elastic())),
      sensor_noise_(VectorXd::Zero(spec_->system->sensors.rows())),
      meter_(*spec_) {
  report_.propagator.name = "sundials_arkstep_kvaerno";
  lay_out(structure_channels(*spec_), spec_->telemetry_period_s, spec_->output_times_s);
  digest_state();
}

// A copy's solver is its own; it is reset where the next step begins.
StructureRun::StructureRun(const StructureRun& other)
    : SteppedRun(other),
      spec_(other.spec_),
      loop_(other.loop_),
      step_s_(other.step_s_),
      times_s_(other.times_s_),
      states_(other.states_),
      slopes_(other.slopes_),
      pieces_(other.pieces_),
      row_(other.row_),
      noise_(other.noise_),
      sensor_noise_(other.sensor_noise_),
      meter_(other.meter_) {}

void StructureRun::digest_state() {
  digester_.real(t_s_);
  for (Index i = 0; i < states_.rows(); ++i) digester_.real(states_(i, pieces_));
}

double StructureRun::next_boundary() const {
  double next = spec_->duration_s;
  const auto consider = [&](double period_s) {
    double at = (std::floor(t_s_ / period_s) + 1) * period_s;
    if (at <= t_s_ + kApart_s) at += period_s;
    next = std::min(next, at);
  };
  consider(kBoundary_s);
  if (spec_->process_noise) consider(spec_->process_noise->period_s);
  if (spec_->sensor_noise) consider(spec_->sensor_noise->period_s);
  const std::vector<double>& breaks = spec_->system->command.breaks_s();
  const auto first = std::upper_bound(breaks.begin(), breaks.end(), t_s_ + kApart_s);
  if (first != breaks.end()) next = std::min(next, *first);
  return next;
}

// Which of the periods this is, and its numbers: they depend on nothing else.
void StructureRun::hold_noise() {
  const auto draw = [&](const std::optional<HeldNoise>& noise, RandomUse use, VectorXd& values) {
    if (!noise) return;
    const auto counter = static_cast<std::uint64_t>((t_s_ + kApart_s) / noise->period_s);
    const double deviation = std::sqrt(noise->intensity / noise->period_s);
    for (Index i = 0; i < values.size(); ++i)
      values[i] = deviation * RandomStream(spec_->seed, use, static_cast<std::uint32_t>(i)).normal(counter);
  };
  draw(spec_->process_noise, RandomUse::elastic_noise, noise_);
  draw(spec_->sensor_noise, RandomUse::structure_sensor_noise, sensor_noise_);
  loop_.hold_process_noise(noise_);
  loop_.hold_sensor_noise(sensor_noise_);
}

void StructureRun::start_solver() {
  if (solver_) return;
  solver_ = std::make_unique<DirkSolver>(static_cast<sunindextype>(loop_.size()), &slope, &jacobian, this);
  const double tolerance = std::max(spec_->relative_tolerance, kFinestTolerance);
  check_sundials(ARKStepSStolerances(solver_->memory, tolerance, 1e-3 * tolerance), "ARKStepSStolerances");
}

void StructureRun::fly_to(double boundary_s) {
  start_solver();
  std::copy_n(states_.col(0).data(), loop_.size(), solver_->values());
  check_sundials(ARKStepReset(solver_->memory, t_s_, solver_->state), "ARKStepReset");
  check_sundials(ARKStepSetInitStep(solver_->memory, std::min(step_s_, boundary_s - t_s_)),
                 "ARKStepSetInitStep");
  check_sundials(ARKStepSetStopTime(solver_->memory, boundary_s), "ARKStepSetStopTime");
  sunrealtype t_s = t_s_;
  double next_s = step_s_;
  while (t_s < boundary_s && pieces_ < kMostPieces) {
    // What comes before the boundary is cut short by it and says little about the steps to come.
    step_s_ = next_s;
    check_sundials(ARKStepEvolve(solver_->memory, boundary_s, solver_->state, &t_s, ARK_ONE_STEP),
                   "ARKStepEvolve");
    check_sundials(ARKStepGetCurrentStep(solver_->memory, &next_s), "ARKStepGetCurrentStep");
    ++pieces_;
    ++report_.propagator.steps;
    times_s_[static_cast<std::size_t>(pieces_)] = t_s;
    std::copy_n(solver_->values(), loop_.size(), states_.col(pieces_).data());
    loop_.slope(t_s, states_.col(pieces_).data(), slopes_.col(pieces_).data());
  }
  step_s_ = std::max(step_s_, next_s);
}

void StructureRun::open_step(SampleSink& sink) {
  if (t_s_ >= spec_->duration_s) return finish("duration", sink);
  hold_noise();
  states_.col(0) = states_.col(pieces_);
  pieces_ = 0;
  times_s_[0] = t_s_;
  loop_.slope(t_s_, states_.col(0).data(), slopes_.col(0).data());
  try {
    fly_to(next_boundary());
  } catch (const std::runtime_error& error) {
    report_.failure = RunFailure{"not_integrated", error.what()};
    status_ = RunStatus::failed;
    return;
  }
  if (!(states_.col(pieces_).cwiseAbs().maxCoeff() < kDiverged)) {
    report_.failure = RunFailure{
        "diverged", "the structure's motion has grown beyond what is small: the loop is not stable"};
    status_ = RunStatus::failed;
    return;
  }
  end_s_ = times_s_[static_cast<std::size_t>(pieces_)];
  step_is_open_ = true;
}

StructurePiece StructureRun::piece(Index i) const {
  const double from = times_s_[static_cast<std::size_t>(i)];
  return {from,
          times_s_[static_cast<std::size_t>(i + 1)] - from,
          states_.col(i).data(),
          slopes_.col(i).data(),
          states_.col(i + 1).data(),
          slopes_.col(i + 1).data(),
          loop_.plant(),
          spec_->system->tracked(),
          spec_->system->filtered()};
}

void StructureRun::close_step() {
  for (Index i = 0; i < pieces_; ++i) {
    meter_.step(piece(i), loop_);
    digester_.real(times_s_[static_cast<std::size_t>(i + 1)]);
    for (Index k = 0; k < states_.rows(); ++k) digester_.real(states_(k, i + 1));
  }
  t_s_ = end_s_;
  step_is_open_ = false;
}

void StructureRun::fill_row(double t_s, std::span<double> state, std::span<double> thrusters) {
  const auto begin = times_s_.begin();
  const auto above = std::upper_bound(begin, begin + pieces_ + 1, t_s);
  if (above == begin + pieces_ + 1 || pieces_ == 0) {
    row_ = states_.col(pieces_);
  } else {
    const StructurePiece open = piece(std::max<Index>(above - begin - 1, 0));
    open.state_at((t_s - open.from_s) / open.length_s, row_.data());
  }
  const auto plant = static_cast<std::size_t>(loop_.plant());
  const std::span<const double> y(row_.data(), static_cast<std::size_t>(row_.size()));
  const VectorXd& u = loop_.controls(t_s, row_.data());
  fill_structure_row(*spec_, t_s, y.first(plant), y.subspan(plant, plant),
                     {u.data(), static_cast<std::size_t>(u.size())}, state, thrusters);
}

RunReport StructureRun::report() const {
  RunReport report = report_;
  std::vector<double> state(channels().state.size()), thrusters(channels().thrusters.size());
  StructureRun here(*this);  // a row needs room to be made in
  const Index last = step_is_open_ ? 0 : pieces_;
  here.row_ = states_.col(last);
  here.pieces_ = 0;
  here.states_.col(0) = here.row_;
  here.fill_row(t_s_, state, thrusters);
  report.metrics = meter_.finish(t_s_, here.row_.data());
  report.metrics.final_state = std::move(state);
  report.digest = digester_.digest();
  return report;
}

}  // namespace

std::unique_ptr<Run> make_structure_run(const StructureSpecification& specification) {
  if (specification.system) return std::make_unique<StructureRun>(specification);
  StructureSpecification with_system = specification;
  with_system.system = build_structure_system(specification);
  return std::make_unique<StructureRun>(with_system);
}

}  // namespace slew

// The second opinion on a flexible structure: CVODE's backward differentiation, of variable order, with its
// own difference quotients for a Jacobian. Shares the design (bases, surface) with the first one and nothing
// else: M z'' is solved for in every slope, the law and the filter stand here as Sung, Lee & Kim 2001 print
// them, and the filter's covariance is integrated with everything else.
#include <cvodes/cvodes.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>
#include <new>
#include <stdexcept>

#include "server/propagation/dense_factors.hpp"
#include "server/propagation/erk_solver.hpp"
#include "server/random/random_stream.hpp"
#include "server/simulation/digest.hpp"
#include "server/simulation/structure_channels.hpp"

namespace slew {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// CVODE, its state and what belongs to it.
struct BackwardSolver {
  SUNContext context = nullptr;
  N_Vector state = nullptr;
  SUNMatrix matrix = nullptr;
  SUNLinearSolver linear = nullptr;
  void* memory = nullptr;

  explicit BackwardSolver(Index size) {
    check_sundials(SUNContext_Create(nullptr, &context), "SUNContext_Create");
    state = N_VNew_Serial(static_cast<sunindextype>(size), context);
    if (!state) throw std::bad_alloc();
    N_VConst(0, state);
    matrix = SUNDenseMatrix(static_cast<sunindextype>(size), static_cast<sunindextype>(size), context);
    linear = dense_factors(static_cast<sunindextype>(size), context);
    memory = CVodeCreate(CV_BDF, context);
    if (!matrix || !linear || !memory) throw std::bad_alloc();
  }
  BackwardSolver(const BackwardSolver&) = delete;
  BackwardSolver& operator=(const BackwardSolver&) = delete;
  ~BackwardSolver() {
    if (memory) CVodeFree(&memory);
    if (linear) SUNLinSolFree(linear);
    if (matrix) SUNMatDestroy(matrix);
    if (state) N_VDestroy(state);
    SUNContext_Free(&context);
  }
};

/// What the equations need that the specification does not say in these words.
struct Terms {
  MatrixXd inputs;             ///< Q^T W^T of the actuators, for the plant
  Eigen::LDLT<MatrixXd> mass;  ///< of the plant
  VectorXd tangential, centrifugal;
  MatrixXd a, b;                                 ///< of the design model
  VectorXd known_tangential, known_centrifugal;  ///< its elastic loads over its mass
};

Terms terms_of(const StructureSpecification& spec) {
  const StructureSystem& system = *spec.system;
  const MatrixXd loads = actuator_loads(spec, system.elements.structure);
  Terms terms;
  terms.inputs = system.plant.basis.transpose() * loads;
  terms.mass.compute(system.plant.mass);
  // What is given to the hub cancels what a rigid slew takes.
  terms.tangential = system.plant.tangential_load;
  terms.centrifugal = system.plant.centrifugal_load;
  for (VectorXd* load : {&terms.tangential, &terms.centrifugal}) {
    Eigen::Matrix<double, 6, 1> given = load->head<6>();
    if (spec.guidance.loads == ZeroOrderLoads::about_axis_only) {
      const Eigen::Vector3d axis = system.plant.axis;
      given << 0, 0, 0, axis * axis.dot(load->segment<3>(3));
    }
    load->head<6>() -= given;
  }
  if (!spec.control) return terms;
  const ReducedStructure& design = system.design;
  const Index n = design.size();
  const Eigen::LDLT<MatrixXd> mass(design.mass);
  const MatrixXd damping = spec.alpha_1_s * design.mass + spec.beta_s * design.stiffness;
  terms.a = MatrixXd::Zero(2 * n, 2 * n);
  terms.a.topRightCorner(n, n).setIdentity();
  terms.a.bottomLeftCorner(n, n) = -mass.solve(design.stiffness);
  terms.a.bottomRightCorner(n, n) = -mass.solve(damping);
  terms.b = MatrixXd::Zero(2 * n, loads.cols());
  terms.b.bottomRows(n) = mass.solve(design.basis.transpose() * loads);
  VectorXd elastic = design.tangential_load;
  elastic.head<6>().setZero();
  terms.known_tangential = -mass.solve(elastic);
  elastic = design.centrifugal_load;
  elastic.head<6>().setZero();
  terms.known_centrifugal = -mass.solve(elastic);
  return terms;
}

class BackwardStructureRun final : public Run {
 public:
  explicit BackwardStructureRun(const StructureSpecification& specification);

  const ChannelTable& channels() const override { return channels_; }
  const std::vector<std::string>& event_channels() const override {
    static const std::vector<std::string> none;
    return none;
  }
  RunStatus advance(double until_s, std::int64_t max_steps, SampleSink& sink) override;
  double t_s() const override { return t_s_; }
  double duration_s() const override { return spec_.duration_s; }
  RunReport report() const override;
  std::unique_ptr<Run> clone() const override {
    throw std::logic_error("a verification is flown once, from its beginning");
  }

 private:
  // y = [z, z', x_d, x_d', z^_f, lower triangle of P].
  Index plant() const { return spec_.system->plant.size(); }
  Index tracked() const { return spec_.system->tracked(); }
  Index filtered() const { return spec_.system->filtered(); }
  Index size() const { return 2 * plant() + 2 * tracked() + filtered() + filtered() * (filtered() + 1) / 2; }
  MatrixXd covariance(const double* y) const;
  VectorXd controls(double t_s, const double* y) const;
  void slope(double t_s, const double* y, double* rate) const;
  double boundary() const;
  void draw();

  const StructureSpecification spec_;
  const Terms terms_;
  const ChannelTable channels_;
  BackwardSolver solver_;
  VectorXd noise_, sensor_noise_;
  double t_s_ = 0, boundary_s_ = 0;
  bool is_fresh_ = true;
  RunReport report_;
  Digester digester_;
  Metrics metrics_;
};

MatrixXd BackwardStructureRun::covariance(const double* y) const {
  const Index k = filtered();
  const double* packed = y + 2 * plant() + 2 * tracked() + k;
  MatrixXd p(k, k);
  for (Index j = 0; j < k; ++j)
    for (Index i = j; i < k; ++i) p(i, j) = p(j, i) = *packed++;
  return p;
}

// Eq. 24, its first term as the specification has it.
VectorXd BackwardStructureRun::controls(double t_s, const double* y) const {
  VectorXd u = VectorXd::Zero(terms_.inputs.cols());
  if (!spec_.control) return u;
  const StructureController& design = *spec_.system->controller;
  const Index n = spec_.system->design.size(), e = n - 6, p = plant(), m = tracked();
  const SlewState slew = spec_.system->command.at(t_s);
  const Eigen::Map<const VectorXd> z(y, 2 * p), xd(y + 2 * p, m), vd(y + 2 * p + m, m),
      filtered_state(y + 2 * p + 2 * m, 2 * e);
  VectorXd estimate(2 * n), desired(2 * n), desired_rate(2 * n), correction = VectorXd::Zero(2 * n);
  estimate << z.head(6), filtered_state.head(e), z.segment(p, 6), filtered_state.tail(e);
  VectorXd ad(m);
  for (Index i = 0; i < m; ++i) {
    const double w = design.tracking.frequency_rad_s[i];
    ad[i] = -2 * design.tracking.damping_ratio[i] * w * vd[i] - w * w * xd[i] -
            design.tracking.input[i] * slew.acceleration_rad_s2;
  }
  desired << design.tracking.shapes * xd, design.tracking.shapes * vd;
  desired_rate << design.tracking.shapes * vd, design.tracking.shapes * ad;
  const VectorXd error = estimate - desired;
  VectorXd rigid = error;
  rigid.segment(6, e).setZero();
  rigid.tail(e).setZero();

  const MatrixXd gain =
      covariance(y) * design.filter.output.transpose() / spec_.control->intensities.measurement;
  const bool is_printed = spec_.control->gains.form == LawForm::as_printed;
  VectorXd seen = filtered_state;
  if (is_printed) {
    seen.head(e) -= desired.segment(6, e);
    seen.tail(e) -= desired.tail(e);
  }
  const VectorXd inner = gain * (spec_.system->sensors * z + sensor_noise_ - design.filter.output * seen);
  correction.segment(6, e) = inner.head(e);
  correction.tail(e) = inner.tail(e);
  VectorXd sum = terms_.a * (is_printed ? error : estimate) + spec_.control->gains.reaching_1_s * error +
                 spec_.control->gains.rigid_1_s * rigid + correction - desired_rate;
  if (spec_.control->gains.knows_loads)
    sum.tail(n) += terms_.known_tangential * slew.acceleration_rad_s2 +
                   terms_.known_centrifugal * (slew.rate_rad_s * slew.rate_rad_s);
  const MatrixXd& g = design.law.surface;
  return -(g * terms_.b).partialPivLu().solve(g * sum);
}

void BackwardStructureRun::slope(double t_s, const double* y, double* rate) const {
  const ReducedStructure& structure = spec_.system->plant;
  const Index p = plant(), m = tracked();
  const SlewState slew = spec_.system->command.at(t_s);
  const double w = slew.rate_rad_s, a = slew.acceleration_rad_s2;
  const Eigen::Map<const VectorXd> z(y, p), v(y + p, p);
  const VectorXd u = controls(t_s, y);
  VectorXd force = terms_.inputs * u - terms_.tangential * a - terms_.centrifugal * (w * w);
  force -=
      (spec_.alpha_1_s * structure.mass + spec_.beta_s * structure.stiffness + w * structure.gyroscopic) * v;
  force -= (structure.stiffness + a * structure.tangential + w * w * structure.centrifugal) * z;
  Eigen::Map<VectorXd>(rate, p) = v;
  Eigen::Map<VectorXd> acceleration(rate + p, p);
  acceleration = terms_.mass.solve(force);
  acceleration.tail(p - 6) += noise_;
  if (!spec_.control) return;

  const StructureController& design = *spec_.system->controller;
  const Index n = spec_.system->design.size(), e = n - 6, k = 2 * e;
  for (Index i = 0; i < m; ++i) {
    const double* x = y + 2 * p;
    const double frequency = design.tracking.frequency_rad_s[i];
    rate[2 * p + i] = x[m + i];
    rate[2 * p + m + i] = -2 * design.tracking.damping_ratio[i] * frequency * x[m + i] -
                          frequency * frequency * x[i] - design.tracking.input[i] * a;
  }
  const MatrixXd covariance_now = covariance(y);
  const MatrixXd gain =
      covariance_now * design.filter.output.transpose() / spec_.control->intensities.measurement;
  const Eigen::Map<const VectorXd> estimate(y + 2 * p + 2 * m, k);
  MatrixXd a_ff(k, k);
  a_ff << terms_.a.block(6, 6, e, e), terms_.a.block(6, n + 6, e, e), terms_.a.block(n + 6, 6, e, e),
      terms_.a.block(n + 6, n + 6, e, e);
  Eigen::Map<VectorXd> estimated(rate + 2 * p + 2 * m, k);
  estimated = a_ff * estimate + gain * (spec_.system->sensors * Eigen::Map<const VectorXd>(y, 2 * p) +
                                        sensor_noise_ - design.filter.output * estimate);
  estimated.tail(e) += terms_.b.bottomRows(e) * u;
  if (spec_.control->filter_knows_loads)
    estimated.tail(e) += terms_.known_tangential.tail(e) * a + terms_.known_centrifugal.tail(e) * (w * w);
  MatrixXd covariance_rate = a_ff * covariance_now + covariance_now * a_ff.transpose() -
                             spec_.control->intensities.measurement * gain * gain.transpose();
  covariance_rate.diagonal().tail(e).array() += spec_.control->intensities.process;
  double* packed = rate + 2 * p + 2 * m + k;
  for (Index j = 0; j < k; ++j)
    for (Index i = j; i < k; ++i) *packed++ = covariance_rate(i, j);
}

BackwardStructureRun::BackwardStructureRun(const StructureSpecification& specification)
    : spec_(specification),
      terms_(terms_of(specification)),
      channels_(structure_channels(specification)),
      solver_(size()),
      noise_(VectorXd::Zero(spec_.system->plant.elastic())),
      sensor_noise_(VectorXd::Zero(spec_.system->sensors.rows())) {
  if (spec_.control) {
    double* packed = NV_DATA_S(solver_.state) + 2 * plant() + 2 * tracked() + filtered();
    for (Index j = 0; j < filtered(); ++j)
      for (Index i = j; i < filtered(); ++i)
        *packed++ = i == j ? spec_.control->intensities.initial_covariance : 0;
  }
  const auto right_hand_side = [](sunrealtype t, N_Vector state, N_Vector rate, void* self) {
    static_cast<const BackwardStructureRun*>(self)->slope(t, NV_DATA_S(state), NV_DATA_S(rate));
    return 0;
  };
  check_sundials(CVodeInit(solver_.memory, right_hand_side, 0, solver_.state), "CVodeInit");
  check_sundials(CVodeSetUserData(solver_.memory, this), "CVodeSetUserData");
  const double tolerance = spec_.verification_tolerance;
  check_sundials(CVodeSStolerances(solver_.memory, tolerance, tolerance * 1e-3), "CVodeSStolerances");
  check_sundials(CVodeSetLinearSolver(solver_.memory, solver_.linear, solver_.matrix),
                 "CVodeSetLinearSolver");
  check_sundials(CVodeSetMaxNumSteps(solver_.memory, 10000000), "CVodeSetMaxNumSteps");
  report_.propagator.name = "sundials_cvode_bdf";
}

double BackwardStructureRun::boundary() const {
  constexpr double kApart_s = 1e-9;
  double next = spec_.duration_s;
  for (const double at : spec_.system->command.breaks_s())
    if (at > t_s_ + kApart_s) next = std::min(next, at);
  for (const auto& noise : {spec_.process_noise, spec_.sensor_noise})
    if (noise) next = std::min(next, (std::floor((t_s_ + kApart_s) / noise->period_s) + 1) * noise->period_s);
  return next;
}

void BackwardStructureRun::draw() {
  const auto one = [&](const HeldNoise& noise, RandomUse use, VectorXd& values) {
    const auto counter = static_cast<std::uint64_t>((t_s_ + 1e-9) / noise.period_s);
    for (Index i = 0; i < values.size(); ++i)
      values[i] = std::sqrt(noise.intensity / noise.period_s) *
                  RandomStream(spec_.seed, use, static_cast<std::uint32_t>(i)).normal(counter);
  };
  if (spec_.process_noise) one(*spec_.process_noise, RandomUse::elastic_noise, noise_);
  if (spec_.sensor_noise) one(*spec_.sensor_noise, RandomUse::structure_sensor_noise, sensor_noise_);
}

RunStatus BackwardStructureRun::advance(double, std::int64_t max_steps, SampleSink&) {
  while (t_s_ < spec_.duration_s) {
    if (max_steps-- <= 0) return RunStatus::running;
    if (is_fresh_) {
      boundary_s_ = boundary();
      draw();
      check_sundials(CVodeReInit(solver_.memory, t_s_, solver_.state), "CVodeReInit");
      check_sundials(CVodeSetInitStep(solver_.memory, 0), "CVodeSetInitStep");
      check_sundials(CVodeSetStopTime(solver_.memory, boundary_s_), "CVodeSetStopTime");
      is_fresh_ = false;
    }
    sunrealtype reached = t_s_;
    check_sundials(CVode(solver_.memory, boundary_s_, solver_.state, &reached, CV_ONE_STEP), "CVode");
    t_s_ = reached;
    is_fresh_ = t_s_ >= boundary_s_;
    ++report_.propagator.steps;
    const double* y = NV_DATA_S(solver_.state);
    digester_.real(t_s_);
    for (Index i = 0; i < size(); ++i) digester_.real(y[i]);
    const double rate = spec_.system->command.at(t_s_).rate_rad_s +
                        spec_.system->plant.axis.dot(Eigen::Map<const Eigen::Vector3d>(y + plant() + 3));
    metrics_.peak_rate_rad_s = std::max(metrics_.peak_rate_rad_s, std::abs(rate));
  }
  report_.stop_reason = "duration";
  return RunStatus::finished;
}

RunReport BackwardStructureRun::report() const {
  RunReport report = report_;
  report.metrics = metrics_;
  report.metrics.end_time_s = t_s_;
  const double* y = NV_DATA_S(solver_.state);
  const auto p = static_cast<std::size_t>(plant());
  const VectorXd u = controls(t_s_, y);
  std::vector<double> state(channels_.state.size()), thrusters(channels_.thrusters.size());
  fill_structure_row(spec_, t_s_, {y, p}, {y + p, p}, {u.data(), static_cast<std::size_t>(u.size())}, state,
                     thrusters);
  report.metrics.final_error_rad = state[2];
  report.metrics.residual_rate_rad_s = state[1];
  report.metrics.final_state = std::move(state);
  report.digest = digester_.digest();
  return report;
}

}  // namespace

std::unique_ptr<Run> make_structure_verification(const StructureSpecification& specification) {
  if (specification.system) return std::make_unique<BackwardStructureRun>(specification);
  StructureSpecification with_system = specification;
  with_system.system = build_structure_system(specification);
  return std::make_unique<BackwardStructureRun>(with_system);
}

}  // namespace slew

#include "server/simulation/ballast.hpp"

namespace slew {
namespace {

class BallastRun final : public Run {
 public:
  BallastRun(std::unique_ptr<Run> run, std::uint64_t operations)
      : run_(std::move(run)), operations_(operations) {}

  const ChannelTable& channels() const override { return run_->channels(); }
  const std::vector<std::string>& event_channels() const override { return run_->event_channels(); }
  double t_s() const override { return run_->t_s(); }
  double duration_s() const override { return run_->duration_s(); }
  RunReport report() const override { return run_->report(); }
  std::unique_ptr<Run> clone() const override {
    return std::make_unique<BallastRun>(run_->clone(), operations_);
  }

  RunStatus advance(double until_s, std::int64_t max_steps, SampleSink& sink) override {
    RunStatus status = RunStatus::running;
    do {
      status = run_->advance(until_s, 1, sink);
      carry();
    } while (status == RunStatus::running && run_->t_s() < until_s && --max_steps > 0);
    return status;
  }

 private:
  // Each operation waits for the one before it, and the compiler may not leave the last one out.
  void carry() {
    double x = weight_;
    for (std::uint64_t i = 0; i < operations_; ++i) x = 0.5 * x + 0.5;
    weight_ = x;
  }

  std::unique_ptr<Run> run_;
  const std::uint64_t operations_;
  volatile double weight_ = 1;
};

}  // namespace

std::unique_ptr<Run> with_ballast(std::unique_ptr<Run> run, std::uint64_t operations_per_step) {
  return std::make_unique<BallastRun>(std::move(run), operations_per_step);
}

}  // namespace slew

#include "server/service/metrics_page.hpp"

#include <httplib.h>
#include <prometheus/metric_family.h>
#include <prometheus/text_serializer.h>

#include <limits>
#include <stdexcept>
#include <thread>

#include "idl/wire/text.hpp"
#include "server/experiment/limits.hpp"
#include "server/service/thread_name.hpp"

namespace slew::service {
namespace {

using prometheus::ClientMetric;
using prometheus::MetricFamily;
using prometheus::MetricType;

MetricFamily single(const char* name, const char* help, MetricType type, double value) {
  ClientMetric metric;
  (type == MetricType::Counter ? metric.counter.value : metric.gauge.value) = value;
  return {name, help, type, {metric}};
}

template <typename Number>
MetricFamily gauge(const char* name, const char* help, Number value) {
  return single(name, help, MetricType::Gauge, static_cast<double>(value));
}

template <typename Number>
MetricFamily counter(const char* name, const char* help, Number value) {
  return single(name, help, MetricType::Counter, static_cast<double>(value));
}

MetricFamily ended(const slew_v1_Server& health) {
  MetricFamily family{
      "slewd_experiments_ended_total", "experiments that ended, by phase", MetricType::Counter, {}};
  const auto add = [&](const char* phase, std::uint64_t count) {
    ClientMetric metric;
    metric.label.push_back({"phase", phase});
    metric.counter.value = static_cast<double>(count);
    family.metric.push_back(metric);
  };
  add("completed", health.completed);
  add("failed", health.failed);
  add("cancelled", health.cancelled);
  add("interrupted", health.interrupted);
  return family;
}

MetricFamily version(const slew_v1_Server& health) {
  ClientMetric metric;
  metric.label.push_back({"version", std::string(wire::view(health.version))});
  metric.gauge.value = 1;
  return {"slewd_build_info", "always 1; the version is its label", MetricType::Gauge, {metric}};
}

MetricFamily histogram(const Lateness& lateness) {
  ClientMetric metric;
  std::uint64_t below = 0;
  lateness.each_bin([&](double upper_edge_s, std::uint64_t count) {
    metric.histogram.bucket.push_back({below += count, upper_edge_s});
  });
  metric.histogram.bucket.push_back({below, std::numeric_limits<double>::infinity()});
  metric.histogram.sample_count = below;
  metric.histogram.sample_sum = lateness.sum_s();
  return {"slewd_slice_lateness_seconds",
          "from when a paced slice's samples were due until they were in the ring",
          MetricType::Histogram,
          {metric}};
}

std::vector<MetricFamily> families(const slew_v1_Server& health, const Lateness& lateness) {
  return {version(health),
          gauge("slewd_start_time_seconds", "when the server was started, since 1970",
                1e-9 * static_cast<double>(health.started_unix_ns)),
          gauge("slewd_queued", "as-fast experiments that wait for their turn", health.queued),
          gauge("slewd_queue_limit", "experiments that may be alive at once", health.queue_limit),
          gauge("slewd_running", "experiments under way", health.running),
          gauge("slewd_paced", "of these, paced ones", health.paced),
          gauge("slewd_held", "experiments that wait for their start", health.held),
          gauge("slewd_paced_load", "share of the pacers' time that admitted paced experiments need",
                health.paced_load),
          gauge("slewd_paced_load_limit", "share of it that may be promised", limits().max_paced_load),
          gauge("slewd_realtime_policy", "1 when pacers run at SCHED_FIFO", health.realtime_policy),
          gauge("slewd_draining", "1 when the server is shutting down", health.draining),
          gauge("slewd_resident_bytes", "resident memory", health.resident_bytes),
          counter("slewd_requests_accepted_total", "requests accepted", health.accepted),
          counter("slewd_requests_rejected_total", "requests rejected", health.rejected),
          counter("slewd_samples_malformed_total", "samples on the wire that were not worth a reply",
                  health.malformed),
          counter("slewd_telemetry_published_total", "telemetry samples sent", health.samples_published),
          counter("slewd_telemetry_dropped_total", "telemetry samples lost to full rings",
                  health.samples_dropped),
          ended(health),
          histogram(lateness)};
}

}  // namespace

struct MetricsPage::Page {
  httplib::Server server;
  std::thread thread;
};

MetricsPage::MetricsPage(int port) : page_(std::make_unique<Page>()) {
  // Without the library's own choice, by which two servers could share a port.
  page_->server.set_socket_options([](socket_t socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  page_->server.new_task_queue = [] { return new httplib::ThreadPool(1); };
  if (!page_->server.bind_to_port("127.0.0.1", port))
    throw std::runtime_error("the metrics port " + std::to_string(port) + " is taken");
}

void MetricsPage::serve(std::function<slew_v1_Server()> health, const Lateness& lateness,
                        std::optional<std::int64_t> certificate_expires_unix_s) {
  page_->server.Get("/metrics", [health = std::move(health), &lateness, certificate_expires_unix_s](
                                    const httplib::Request&, httplib::Response& response) {
    auto all = families(health(), lateness);
    if (certificate_expires_unix_s)
      all.push_back(gauge("slewd_certificate_expires_time_seconds",
                          "when the server's certificate runs out, since 1970", *certificate_expires_unix_s));
    response.set_content(prometheus::TextSerializer().Serialize(all), "text/plain; version=0.0.4");
  });
  page_->thread = std::thread([this] {
    name_this_thread("metrics");
    page_->server.listen_after_bind();
  });
  // Stopping one that does not listen yet would not stop it.
  while (!page_->server.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

MetricsPage::~MetricsPage() {
  page_->server.stop();
  if (page_->thread.joinable()) page_->thread.join();
}

}  // namespace slew::service

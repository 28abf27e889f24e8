// Health for Prometheus: its text format, over HTTP, on loopback only.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>

#include "server/service/lateness.hpp"
#include "slew.h"

namespace slew::service {

class MetricsPage {
 public:
  /// Takes the port on 127.0.0.1. Throws std::runtime_error when somebody else has it.
  explicit MetricsPage(int port);
  ~MetricsPage();

  /// Serves /metrics. `health` is asked at every scrape, from a thread of the page's own. With DDS Security
  /// it is told when the server's certificate runs out.
  void serve(std::function<slew_v1_Server()> health, const Lateness& lateness,
             std::optional<std::int64_t> certificate_expires_unix_s);

 private:
  struct Page;
  std::unique_ptr<Page> page_;
};

}  // namespace slew::service

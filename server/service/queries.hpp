// Queries and their answers, on a thread that no experiment waits for (server/doc/wire.md).
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <thread>

#include "idl/wire/reader.hpp"
#include "idl/wire/waitset.hpp"
#include "idl/wire/writer.hpp"
#include "server/service/archive.hpp"
#include "server/service/journal.hpp"
#include "server/service/registry.hpp"

namespace slew::service {

class Queries {
 public:
  Queries(const wire::Domain& domain, const Registry& registry, const Archive& archive,
          const std::filesystem::path& journal);
  ~Queries();

 private:
  struct Answer;
  void serve();
  Answer answer(const std::string& kind, const std::string& arguments);
  Answer list(const nlohmann::json& arguments);
  Answer history(const nlohmann::json& arguments);
  Answer show(const nlohmann::json& arguments);
  Answer result(const nlohmann::json& arguments);
  Answer series(const nlohmann::json& arguments);
  Answer describe(const nlohmann::json& arguments);
  JournalEntry find(const nlohmann::json& arguments);
  void send(const wire::Id& request_id, const Answer& answer);

  const Registry& registry_;
  const Archive& archive_;
  JournalReader journal_;
  wire::Reader<slew_v1_Query> query_;
  wire::Writer<slew_v1_Answer> answer_;
  wire::Waitset waitset_;
  std::atomic<bool> stopping_{false};
  std::thread thread_;
};

}  // namespace slew::service

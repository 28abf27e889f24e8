#include "client/slewctl/connection.hpp"

#include <fstream>
#include <iostream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>

#include "client/slewctl/set_path.hpp"
#include "server/experiment/preset.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

std::string read_all(const std::string& file) {
  std::ostringstream text;
  if (file == "-") {
    text << std::cin.rdbuf();
    return text.str();
  }
  std::ifstream stream(file, std::ios::binary);
  if (!stream) throw Stop{kRefused, "the file " + file + " cannot be read"};
  text << stream.rdbuf();
  return text.str();
}

bool needs_to_command(Command command) {
  switch (command) {
    case Command::run:
    case Command::submit:
    case Command::cancel:
    case Command::pause:
    case Command::resume:
    case Command::step:
    case Command::rate:
      return true;
    default:
      return false;
  }
}

}  // namespace

client::SessionOptions session_options(const Options& options) {
  client::SessionOptions session;
  session.domain.domain = options.domain;
  if (!options.dds_profile.empty()) session.domain.profile = read_all(options.dds_profile);
  session.domain.identity = options.identity;
  session.client_id = options.client_id;
  return session;
}

client::Duration seconds(double value) {
  return std::chrono::duration_cast<client::Duration>(std::chrono::duration<double>(value));
}

std::unique_ptr<client::Session> connect(const Options& options) {
  try {
    auto session = std::make_unique<client::Session>(session_options(options));
    if (needs_to_command(options.command) && !session->may_command())
      throw Stop{kNoServer, "this identity may query and watch, not request or control"};
    if (session->wait_for_server(seconds(options.connect_s))) return session;
  } catch (const wire::WireError& error) {
    throw Stop{kNoServer, error.what()};
  }
  throw Stop{kNoServer, "no server in domain " + std::to_string(options.domain) +
                            ", or not permitted (slewctl doctor looks closer)"};
}

json ask(client::Session& session, const std::string& kind, const json& arguments) {
  const auto answer = session.query(kind, arguments.dump(), seconds(10));
  if (!answer) throw Stop{kTimedOut, "the server did not answer within 10 s"};
  json document = json::parse(answer->json, nullptr, false);
  if (document.is_discarded()) throw Stop{kRunFailed, "the server's answer is not JSON"};
  if (answer->is_ok()) return document;
  throw Stop{answer->code == "unavailable" ? kRunFailed : kRefused, document.value("sentence", answer->code)};
}

std::string request_text(const Options& options) {
  std::string text = options.file.empty() ? "{}" : read_all(options.file);
  // Left exactly as it is where nothing is changed: the server judges it, byte for byte.
  if (options.preset.empty() && options.set.empty() && !options.verify) return text;
  json request = json::parse(text, nullptr, false);
  if (!request.is_object())
    throw Stop{kRefused, "the request is not a JSON object, so nothing can be set in it"};
  if (!options.preset.empty()) request["preset"] = options.preset;
  json base = json::object();
  if (request.contains("preset") && request["preset"].is_string())
    if (const json* preset = preset_document(request["preset"].get_ref<const std::string&>()))
      base = preset->at("request");
  try {
    for (const std::string& assignment : options.set) set_path(request, base, assignment);
  } catch (const std::invalid_argument& error) {
    throw Stop{kRefused, error.what()};
  }
  if (options.verify) set_path(request, base, "simulation.verify=true");
  return request.dump(-1, ' ', false, json::error_handler_t::replace);
}

std::string violations_in_words(const json& violations) {
  std::string text;
  for (const json& violation : violations) {
    const std::string pointer = violation.value("pointer", "");
    text += (pointer.empty() ? "(the whole)" : pointer) + ": " + violation.value("problem", "") + "\n";
    if (const auto given = violation.value("given", ""); !given.empty())
      text += "    given:   " + given + "\n";
    if (const auto allowed = violation.value("allowed", ""); !allowed.empty())
      text += "    allowed: " + allowed + "\n";
  }
  return text;
}

void print_json(const json& document) {
  std::cout << document.dump(2, ' ', false, json::error_handler_t::replace) << std::endl;
}

}  // namespace slew::ctl

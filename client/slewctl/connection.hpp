// From options to a session, and from answers to exit codes.
#pragma once

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <stdexcept>
#include <string>

#include "client/library/session.hpp"
#include "client/slewctl/exit_code.hpp"
#include "client/slewctl/options.hpp"

namespace slew::ctl {

/// Ends the command: an exit code, a sentence for standard error, and what a program gets on standard output.
struct Stop {
  ExitCode code;
  std::string sentence;
};

/// A session with a server. Throws Stop (kNoServer) when there is none.
std::unique_ptr<client::Session> connect(const Options& options);
client::SessionOptions session_options(const Options& options);

client::Duration seconds(double value);

/// The document that answers a query. Throws Stop for refusals and silence.
nlohmann::json ask(client::Session& session, const std::string& kind, const nlohmann::json& arguments);

/// The request that the options describe, as JSON text: FILE, preset and --set in one, not yet validated.
std::string request_text(const Options& options);

/// Violations as people read them, one block each.
std::string violations_in_words(const nlohmann::json& violations);

/// One JSON document on standard output.
void print_json(const nlohmann::json& document);

}  // namespace slew::ctl

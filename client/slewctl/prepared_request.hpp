// The request of the command line, prepared here: for commands that need no server.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "client/slewctl/options.hpp"
#include "server/experiment/experiment.hpp"

namespace slew::ctl {

/// Throws Stop (kRefused) with every reason when it cannot be flown; with --json they are printed too.
Prepared prepared_request(const Options& options);

std::string value_in_words(const nlohmann::json& value);

/// A document as rows of path and value. Curves are for pictures and programs.
std::string rows_in_words(const nlohmann::json& document);

}  // namespace slew::ctl

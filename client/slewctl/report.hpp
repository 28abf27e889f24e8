// A result document as people read it.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>

namespace slew::ctl {

std::string result_in_words(const nlohmann::json& result);

}  // namespace slew::ctl

// client - the register map and the status numbers as text, for people and for tools.
#pragma once

#include <string>

#include "armcal/core/status.hpp"

namespace armcal::client {

// "kAxisEnabled: an axis is enabled" without the k; "status 200" for a number without a name.
std::string StatusName(core::Status status);

// The tables of SPEC.md; a test compares them.
std::string RegisterMarkdown();
std::string StatusMarkdown();

// The same map for tools: one line or object an item, addresses zero-based.
std::string RegisterCsv();
std::string RegisterJson();

}  // namespace armcal::client

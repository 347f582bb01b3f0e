// client - gives the register map and the status numbers as text, for people and for tools.
#pragma once

#include <string>

#include "armcal/core/status.hpp"

namespace armcal::client {

// For example "AxisEnabled: an axis is enabled". A number without a name gives "status 200".
std::string StatusName(core::Status status);

// The tables of SPEC.md. A test compares them.
std::string RegisterMarkdown();
std::string StatusMarkdown();

// The same map for tools: one line or object for each register, with zero-based addresses.
std::string RegisterCsv();
std::string RegisterJson();

}  // namespace armcal::client

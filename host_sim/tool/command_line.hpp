// tool - what the definition of the command line gives beside parsing: what a misspelt word was meant to be, and the
// pages of the manual.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

namespace armcal::tool {

// "armcal 0.1.0"
std::string Version();

// One line for the first word that is no verb or no option, with the nearest one; empty: every word is known.
std::string Misspelt(const CLI::App& app, int argc, const char* const* argv);

// armcal pages: manual pages and the words that bash completes, written from the definition of `app`.
void AddPages(CLI::App& app, std::function<int()>& action);

}  // namespace armcal::tool

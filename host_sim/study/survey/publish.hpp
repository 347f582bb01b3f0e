// survey - findings as JSON for programs, and as a page and text for people.
#pragma once

#include <string>

#include "host_sim/data/report/table.hpp"
#include "host_sim/study/survey/draws.hpp"
#include "host_sim/study/survey/sheet.hpp"

namespace armcal::survey {

// "0.165 [0.160, 0.171]", the words, or "-" for a number that does not exist.
std::string TextOf(const Cell& cell);
report::Table TableOf(const Sheet& sheet);

// {"robot", "seed", "draws", "tables": {number: {"title", "columns", "rows": [{column: cell}], "notes"}},
//  "goals": [{"name", "value", "goal", "at_most", "met"}]}. A cell is a string, a number, null for a
// number that does not exist, or {"mean", "low", "high"}.
std::string Json(const Findings& findings, const Settings& settings);

// A self-contained page.
std::string Html(const Findings& findings, const Settings& settings);

// "goals met: 11 of 14" and those not met, one a line.
std::string GoalLines(const Findings& findings);

}  // namespace armcal::survey

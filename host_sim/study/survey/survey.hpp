// survey - all of the survey's tables and figures from one robot file; writes nothing.
#pragma once

#include "host_sim/study/survey/draws.hpp"
#include "host_sim/study/survey/sheet.hpp"

namespace armcal::survey {

// Searches the trajectories and fills every table asked for, printed figures beside ours. Stops early, with what it
// has, when settings.stop is set. io::InputError: a robot without motion within its limits, measured logs that cannot
// be read.
Findings RunSurvey(const Settings& settings);

}  // namespace armcal::survey

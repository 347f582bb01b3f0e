// verdict - splits of one arm's runs as text, JSON, page and pictures; decides nothing.
#pragma once

#include "host_sim/diagnose/verdict/diagnose_agreement.hpp"

namespace armcal::verdict {

std::string SplitsText(const Verdicts& splits, const Agreed& agreed);

// {"verdict", "holds": [{"kinds", "joint", "signals", "splits": {run: {"kind", "torque_of", "before", "after",
// "without", "other_joint", "other_change", "parameters", "score", "folds"}}}], "does_not_hold": [{"held_out", "kind",
// "joint", "why"}], "splits": {run: {"before_moving", "after_moving", "torque_moving"} or {"error"}}}
nlohmann::ordered_json SplitsJson(const Verdicts& splits, const Agreed& agreed);

// errors.svg: error over torque of every held-out run; term_1.svg, ...: what holds, over the signal it depends on.
void WritePictures(const std::filesystem::path& folder, const Verdicts& splits, const Agreed& agreed);

void WriteSplitsPage(const std::filesystem::path& path, const std::string& robot, const Verdicts& splits,
                     const Agreed& agreed);

}  // namespace armcal::verdict

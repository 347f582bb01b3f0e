// judged set - makes the cases of set II.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace armcal::judged {

// controls_plain, controls_slow, ..., singles_ii, unrecorded, several, payload, negative
const std::vector<std::string>& GroupsOfSetTwo();
// One case, number `number` of its group; report: forms and seeds that nothing was tuned on.
void MakeCaseOfSetTwo(const std::filesystem::path& folder, const std::string& group, int number, bool report,
                      unsigned long long seed);

}  // namespace armcal::judged

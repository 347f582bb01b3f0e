// calibration - tells before a table is sent whether the drive's firmware would refuse it, and why.
#pragma once

#include <string>

#include "host_sim/identify/calibration/table_file.hpp"

namespace armcal::calibration {

// What the ceilings of the model's robot file say about the table: parameter or joint, value and bound. Empty: nothing.
// It uses the firmware's own check of the words, and evaluates friction on the firmware's grid in double. The drive may
// have been compiled with other ceilings; what it says counts.
std::string BeyondCeiling(const codegen::Model& model, const TableFile& table);

// "Fc2: mean", "joint 2: torque_limit_Nm", "flags": what a word of the table is called.
std::string WordName(const TableFile& table, int word);

}  // namespace armcal::calibration

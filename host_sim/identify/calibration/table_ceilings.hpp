// calibration - tells before a table is sent whether the drive's firmware would refuse it, and why.
#pragma once

#include <string>
#include <vector>

#include "host_sim/identify/calibration/table_file.hpp"

namespace armcal::calibration {

// What the ceilings of the model's robot file say about the table: parameter or joint, value and bound. Empty: nothing.
// It uses the firmware's own check of the words, and evaluates friction on the firmware's grid in double. The drive may
// have been compiled with other ceilings; what it says counts.
std::string BeyondCeiling(const codegen::Model& model, const TableFile& table);

// What a fit must respect so that a drive accepts its table. Empty: the drive accepts this one.
struct Ceiled {
  std::vector<std::string> said;  // a sentence for each number that lies beyond, as the user reads it
  std::vector<Limit> limits;      // for FitWithBarrier; a joint whose friction lies beyond has them on the whole grid
  std::vector<int> joints;        // whose friction lies beyond, from 0
};
// table: of a fit, its means are those of the fit. Columns of friction that depend on the estimate are taken as they
// are at this table. The default table keeps the limits if it is within the ceilings itself.
Ceiled BeyondCeilings(const codegen::Model& model, const TableFile& table);

// "Fc2: mean", "joint 2: torque_limit_Nm", "flags": what a word of the table is called.
std::string WordName(const TableFile& table, int word);

}  // namespace armcal::calibration

// bags - tells whether a MATLAB file holds all that it announces. libmatio reads on where a file of version 5 is cut,
// and what it returns then was never in the file.
#pragma once

#include "host_sim/data/bags/cursor.hpp"

namespace armcal::bags {

// InputError, without a file name: an element ends beyond the one that it lies in, does not unpack, or an array has
// another number of numbers than its size says. Other versions than 5 are not looked at.
void CheckWhole(Bytes mat);

}  // namespace armcal::bags

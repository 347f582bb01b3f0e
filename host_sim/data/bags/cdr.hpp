// bags - reads messages in CDR, the wire format of ROS 2.
#pragma once

#include "host_sim/data/bags/cursor.hpp"
#include "host_sim/data/bags/definition.hpp"
#include "host_sim/data/bags/flat.hpp"

namespace armcal::bags {

// Fills `out` with the numbers of a message, with their names if `named`. Both byte orders of plain CDR are read.
// InputError, without a file name: the message is shorter than its definition asks, names one thing twice, or is
// encoded in another way (XCDR2, parameter lists).
void ReadCdr(const Definition& definition, Bytes message, bool named, Flat& out);

}  // namespace armcal::bags

// client - reads the residual statistics that a drive keeps of each joint.
#pragma once

#include <cstdint>
#include <vector>

#include "armcal/link/registers.hpp"
#include "host_sim/client/drive_client.hpp"

namespace armcal::client {

// Sums over the rows of one bin (SPEC.md). A sum divided by the count is a mean. The count fades, so it is not an
// integer.
struct ResidualBin {
  double count = 0, residual = 0, square = 0, speed = 0, position = 0, load = 0, load_size = 0, temperature = 0;
};

// [speed, position, load, temperature][direction: 0 backward, 1 forward][quarter of the range seen]
struct ResidualBins {
  ResidualBin bin[link::reg::kResidualSignals][2][link::reg::kResidualQuarters];
};

struct ResidualSlice {
  double start_s = 0, count = 0, square = 0;  // since the adoption; rows; sum of residual^2
};

struct JointResiduals {
  int joint = 0;  // from 1
  std::uint32_t generation = 0, elapsed_s = 0;
  double sigma_Nm = 0;             // torque noise of one row by the table
  ResidualBins reference, recent;  // first rows after the adoption; latest
  std::vector<ResidualSlice> slices;
};

// Reads one snapshot. joint: from 1. Throws RefusedError if the drive keeps no statistics or has no such joint, and
// LinkError if another client goes on selecting joints meanwhile.
JointResiduals ReadResiduals(DriveClient& drive, int joint);

}  // namespace armcal::client

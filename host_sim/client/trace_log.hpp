// client - trace records as logs: joint quantities from the robot file's nominal constants; knows no connection.
#pragma once

#include "codegen/src/robot/robot.hpp"
#include "host_sim/client/trace_reader.hpp"
#include "host_sim/data/logs/log.hpp"

namespace armcal::client {

// Ticks of the motion without its blend.
struct PlayedTicks {
  std::uint32_t first, last;
};

// Trace 0, with motion and flags and whatever else its channels hold. Records whose whole window lies inside the played
// part; first_tick: of the first of them. Throws LinkError if there are too few for a log.
logs::Log RawLog(const TraceRecords& records, const codegen::Robot& robot, const PlayedTicks& played,
                 std::uint32_t& first_tick);

// Trace 1, the drive's processed samples; `tauff` is the committed model's torque at the measured state. All, or the
// played part.
logs::Log SampleLog(const TraceRecords& records, const codegen::Robot& robot, const PlayedTicks& played, bool all);

}  // namespace armcal::client

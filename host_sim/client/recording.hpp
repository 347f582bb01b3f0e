// client - records the traces of a drive, which plays a trajectory or does its own work, and makes logs of them.
#pragma once

#include <atomic>
#include <string>

#include "codegen/src/robot/robot.hpp"
#include "host_sim/client/drive_client.hpp"
#include "host_sim/client/trace_reader.hpp"
#include "host_sim/data/logs/log.hpp"

namespace armcal::client {

// Ticks of the motion without its blend.
struct PlayedTicks {
  std::uint32_t first, last;
};

struct RecordOptions {
  std::string connect, robot, trajectory, out, samples, json;
  double seconds = 0;
  int speed_percent = 100, decimation = 0;
  bool lean = false;
  std::uint32_t schema = 0;                        // the robot's
  const std::atomic<bool>* interrupted = nullptr;  // ends a recording early, as a partial one
};

struct Recording {
  TraceRecords raw, samples;
  PlayedTicks played;       // what belongs into the log
  std::string cut;          // why the recording ended early; empty: it is whole
  bool packed = false;      // the drive's packed records were taken
  std::size_t unknown = 0;  // of those: positions that could not be told
  int decimation = 0, wanted_decimation = 0;
  int failed_attempts = 0;   // requests that had to be repeated
  std::uint32_t schema = 0;  // the drive's
};

// The trajectory if there is one, else so many seconds. On a serial line that cannot carry the records, it says so
// before the recording begins, and takes a larger decimation. What came before the link broke or records were lost is
// kept if it makes a log: then `cut` says why. A drive that plays is stopped and disabled at the end, and after each
// failure; if that fails, the message says so. A drive of another schema is named on stderr. Throws io::InputError
// (another number of joints, another tick, a bad trajectory, a line too slow for any decimation), RefusedError (the
// drive serves no trace or plays none; the motion was stopped), LinkError.
Recording Record(DriveClient& drive, const RecordOptions& o, const codegen::Robot& robot);

// Trace 0, with motion and flags and whatever else its channels hold. Records whose whole window lies inside the played
// part; first_tick: of the first of them. Throws LinkError if there are too few for a log.
logs::Log RawLog(const TraceRecords& records, const codegen::Robot& robot, const PlayedTicks& played,
                 std::uint32_t& first_tick);

// Trace 1, the drive's processed samples; `tauff` is the committed model's torque at the measured state. All, or the
// played part.
logs::Log SampleLog(const TraceRecords& records, const codegen::Robot& robot, const PlayedTicks& played, bool all);

}  // namespace armcal::client

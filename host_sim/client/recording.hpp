// client - brings a drive's traces home, of a trajectory that it plays or of what it does anyway; knows no log.
#pragma once

#include <string>

#include "codegen/src/robot/robot.hpp"
#include "host_sim/client/drive_client.hpp"
#include "host_sim/client/trace_log.hpp"
#include "host_sim/client/trace_reader.hpp"

namespace armcal::client {

struct RecordOptions {
  std::string connect, robot, trajectory, out, samples, json;
  double seconds = 0;
  int speed_percent = 100, decimation = 0;
  bool lean = false;
};

struct Recording {
  TraceRecords raw, samples;
  PlayedTicks played;  // what belongs into the log
};

// The trajectory if there is one, else so many seconds. Throws io::InputError (another robot, a bad trajectory),
// RefusedError (the drive serves no trace or plays none; the motion was stopped), LinkError (records
// were lost).
Recording Record(DriveClient& drive, const RecordOptions& o, const codegen::Robot& robot);

}  // namespace armcal::client

// bags - reads the logs that robots record: MCAP, and the bags of rosbag2.
#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace armcal::bags {

// The columns of one topic; one row a message, in the order of the stamps.
struct Stream {
  std::string topic, type;
  bool recorder_time = false;          // stamps are the recorder's and not those of the messages' headers
  std::vector<std::int64_t> stamp_ns;  // never falling
  std::vector<std::string> names;      // as flat.hpp makes them, with the topic before them
  Eigen::MatrixXd values;              // [messages x names]; NaN where a message does not have the column
  std::size_t unstamped = 0;           // messages without header.stamp, which are left out
  std::size_t backward = 0;            // messages whose stamp is before that of the message in front of them
};

struct Recording {
  std::vector<Stream> streams;
  std::vector<std::string> topics;   // all of them, with their types: "/joint_states (sensor_msgs/msg/JointState)"
  std::vector<std::string> ignored;  // columns of the streams' topics that were not asked for
  std::vector<std::string> notes;    // what was left out, and which time counts
};

struct Asked {
  std::vector<std::string> columns;                // empty: all
  std::vector<std::filesystem::path> definitions;  // files *.msg, for types that the log does not define itself
  bool recorder_time = false;                      // do not look at header.stamp
};

// A folder of rosbag2, or a file that holds MCAP or its database, plain or as .zst. Told by the content.
bool IsRecording(const std::filesystem::path& path);

// InputError, one line with the file and what was expected: the file is damaged; a topic that is asked for is encoded
// in a way that armcal does not read, or has no definition; there are more than 2^27 numbers. Topics that nobody asked
// for may hold anything. If all columns are asked for, `notes` names the topics that cannot be read.
Recording ReadRecording(const std::filesystem::path& path, const Asked& asked);

}  // namespace armcal::bags

// bags - what a container file holds: topics, and messages as bytes. MCAP and the database of rosbag2 are containers.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host_sim/data/bags/cursor.hpp"

namespace armcal::bags {

struct Topic {
  std::string name;
  std::string encoding;    // of the messages: "cdr", "json", or what armcal does not read
  std::string type;        // "sensor_msgs/msg/JointState"
  std::string schema;      // how the definition is written: "ros2msg", "jsonschema"; empty: there is none
  std::string definition;  // of the type, and of the types that it is made of
};

struct Message {
  std::int64_t recorded_ns = 0;
  Bytes data;  // valid during the call
};

// Who takes the messages of a container.
struct Taker {
  // Whether the messages of this topic are wanted; called once for each topic of a file.
  std::function<bool(const Topic& topic)> wants;
  std::function<void(const Topic& topic, const Message& message)> take;
  std::function<void(const std::string& note)> note;
};

bool IsMcap(Bytes file);
// InputError, without the file's name: damaged, or with records whose lengths cannot be. A file that ends too early is
// read up to its last whole record, and a note says so.
void ReadMcap(Bytes file, const Taker& taker);

bool IsDatabase(Bytes file);
// The database of rosbag2. It is opened by its path, or, without one, from the bytes. InputError, without the file's
// name: it is damaged, is no bag, or this program was built without SQLite.
void ReadDatabase(const std::string& path, Bytes file, const Taker& taker);

}  // namespace armcal::bags

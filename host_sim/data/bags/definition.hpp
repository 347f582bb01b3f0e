// bags - what a message consists of, as a ROS 2 definition (.msg) says it.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace armcal::bags {

enum class Kind {
  kBool,
  kInt8,
  kUint8,
  kInt16,
  kUint16,
  kInt32,
  kUint32,
  kInt64,
  kUint64,
  kFloat32,
  kFloat64,
  kText,
  kStruct
};

// Bytes of a number; 0 for texts and structs.
constexpr std::size_t SizeOf(Kind kind) {
  constexpr std::size_t kSize[] = {1, 1, 1, 2, 2, 4, 4, 8, 8, 4, 8, 0, 0};
  return kSize[static_cast<int>(kind)];
}

struct Field {
  enum Form { kOne, kArray, kSequence };  // one, a fixed number, a number that each message tells
  std::string name;
  Kind kind = Kind::kFloat64;
  std::size_t type = 0;  // of a struct: its place in Definition::types
  Form form = kOne;
  std::uint32_t count = 1;  // of an array
};

struct Type {
  std::string name;  // "sensor_msgs/JointState"
  std::vector<Field> field;
};

struct Definition {
  std::vector<Type> types;  // the first one is that of the message
};

// Types by the texts that define them: those that armcal knows (JointState, DynamicJointState, WrenchStamped,
// TwistStamped, Float64MultiArray and what they are made of), and those that are added.
class Definitions {
 public:
  Definitions();

  // Adds a text: the type `name`, and others behind lines "MSG: package/Name". A type that is known is replaced.
  void Add(const std::string& name, std::string_view text);

  bool Knows(const std::string& name) const;

  // InputError, without a file name: no definition of a type, or a line that is no field.
  Definition Find(const std::string& name) const;

 private:
  struct Text {
    std::string name, text;
  };
  const Text* Look(const std::string& name) const;
  std::size_t Make(const std::string& name, int depth, Definition& out) const;

  std::vector<Text> texts_;
};

// "sensor_msgs/msg/JointState" -> "sensor_msgs/JointState"
std::string ShortName(std::string_view type);

}  // namespace armcal::bags

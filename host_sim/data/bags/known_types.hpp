// bags - definitions of the ROS 2 messages that robots log, for a bag without its own. The fields and their order are
// part of the wire format.
#pragma once

namespace armcal::bags {

struct KnownType {
  const char* name;
  const char* text;
};

inline constexpr KnownType kKnownTypes[] = {
    {"builtin_interfaces/Time", "int32 sec\nuint32 nanosec"},
    {"builtin_interfaces/Duration", "int32 sec\nuint32 nanosec"},
    {"std_msgs/Header", "builtin_interfaces/Time stamp\nstring frame_id"},
    {"std_msgs/MultiArrayDimension", "string label\nuint32 size\nuint32 stride"},
    {"std_msgs/MultiArrayLayout", "MultiArrayDimension[] dim\nuint32 data_offset"},
    {"std_msgs/Float64MultiArray", "MultiArrayLayout layout\nfloat64[] data"},
    {"geometry_msgs/Vector3", "float64 x\nfloat64 y\nfloat64 z"},
    {"geometry_msgs/Wrench", "Vector3 force\nVector3 torque"},
    {"geometry_msgs/WrenchStamped", "std_msgs/Header header\nWrench wrench"},
    {"geometry_msgs/Twist", "Vector3 linear\nVector3 angular"},
    {"geometry_msgs/TwistStamped", "std_msgs/Header header\nTwist twist"},
    {"sensor_msgs/JointState",
     "std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort"},
    {"control_msgs/InterfaceValue", "string[] interface_names\nfloat64[] values"},
    {"control_msgs/DynamicJointState",
     "std_msgs/Header header\nstring[] joint_names\ncontrol_msgs/InterfaceValue[] interface_values"},
};

}  // namespace armcal::bags

// robot - what a robot file says, as numbers.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <vector>

namespace armcal::codegen {

enum class JointType { kRevolute, kPrismatic };

// Modified DH (Craig): frame i = frame i-1 * Rx(alpha) Tx(a) Rz(theta) Tz(d); q adds to theta or, prismatic, to d.
struct JointKinematics {
  JointType type = JointType::kRevolute;
  double alpha_rad = 0, a_m = 0, d_m = 0, theta_rad = 0;
};

struct Link {
  double mass_kg = 0;
  std::array<double, 3> center_m{};      // link frame
  std::array<double, 6> inertia_kgm2{};  // xx xy xz yy yz zz about the centre, link axes
};

struct Motor {
  double counts_per_turn = 0;
  int zero_counts = 0;
  double gear_ratio = 1;  // motor turn per joint unit (rad/rad or rad/m), signed
  double current_A_per_lsb = 0;
  double torque_constant_NmpA = 0;
  double torque_constant_tolerance = 0;  // relative, half width; 0: taken as exact
  double rotor_inertia_kgm2 = 0;         // motor shaft
};

// Units are those of a revolute joint: rad, rad/s, N m. For a prismatic joint they are m, m/s, N.
struct Joint {
  std::string name;
  JointKinematics kinematics;
  std::array<double, 2> position_limit_rad{};
  double speed_limit_radps = 0, acceleration_limit_radps2 = 0, torque_limit_Nm = 0;
  double torque_noise_Nm = 0;  // standard deviation of one tick's reading
  double v_min_radps = 0;
  std::map<std::string, double> nominal;  // parameter name -> value: "Fc", "Fv", ...
  std::set<std::string> wide;             // of "Fc", "Fv", "Ia": those that nobody stated; a URDF's values do not count
  Motor motor;
  Link link;
  bool has_motor = false;
};

// The kinds of body parameter, in the order of a link's block of 11: m, m c, I about the frame origin, rotor inertia on
// the joint side. A parameter's name is its kind and its link's number: "mx2".
inline constexpr std::array<const char*, 11> kBodyParameterName = {"m",   "mx",  "my",  "mz",  "Ixx", "Ixy",
                                                                   "Ixz", "Iyy", "Iyz", "Izz", "Ia"};

struct EffectUse {
  std::string effect;
  std::vector<int> joints;                  // 0-based; empty: the record's own scope decides (arm, body)
  std::string state = "estimated";          // estimated | considered | fixed | standby
  std::map<std::string, double> mean;       // linear parameter -> mean
  std::map<std::string, double> nonlinear;  // nonlinear parameter -> value
};

struct Control {
  std::string structure;  // "pd_feedforward"; empty: unknown
  double rate_Hz = 0;
  std::vector<double> kp_Nmprad, kd_Nmsprad;
};

// Which body parameters become filter coordinates; numbers 11 link + kind.
struct ParameterSet {
  bool standard = false;          // all that the torque depends on, instead of an independent choice
  std::vector<int> prefer, omit;  // tried first; left out (taken as zero)
};

// A URDF, and which chain of it is the arm.
struct UrdfChoice {
  std::filesystem::path path;
  std::string tip;                                             // the chain ends at this link; empty: the only chain
  std::map<std::string, double> fixed;                         // joints that are held at a position, rad or m
  std::map<std::string, std::filesystem::path> packages = {};  // where the packages of package://NAME/.. lie
};

// A solid that a link fills, for the collision check. Its own axes: a cylinder and a capsule lie along z.
struct Shape {
  enum class Kind { kBox, kSphere, kCylinder, kCapsule, kMesh };
  std::string link;
  int body = 0;  // 0: the base; k: what joint k moves
  Kind kind = Kind::kBox;
  // Box: its edges. Sphere: radius. Cylinder: radius, length. Capsule: radius, length without its round ends. Mesh: the
  // scale along each axis.
  std::array<double, 3> size_m{};
  std::string mesh;                  // as the URDF names it
  std::filesystem::path file;        // the mesh; empty: it was not found
  std::array<double, 3> xyz_m{};     // seen from the base frame, or from the body's link frame
  std::array<double, 9> rotation{};  // rows of R
};

// What [ceilings] says about the hardest values that a table of this robot may hold. What is empty or absent follows
// from the robot's limits and prior.
struct CeilingSettings {
  std::vector<double> torque_Nm, friction_Nm, noise_Nm;  // one a joint
  std::array<double, 2> torque_scale{0.5, 2.0};
  std::array<double, 2> temperature_degC{15.0, 60.0};  // where friction is tried
  double feed_share = 0.05;  // of the torque ceiling: by so much may a joint's friction push where it should brake
  double least_fade_ms = 500.0, longest_fade_ms = 1e6, least_forgetting = 0.9;
  std::map<std::string, std::array<double, 2>> parameter;  // name -> lowest and highest mean
};

struct Robot {
  std::string name, title, source, path;
  UrdfChoice urdf;                       // no path: DH rows
  std::array<double, 3> gravity_mps2{};  // base frame
  std::string sign_law = "sgn";          // "sgn" | "tanh"
  double sign_width_radps = 0;
  double tick_rate_Hz = 1000;
  int sample_ticks = 8;
  bool has_prior = true;  // false: prior = "none"
  double link_relative_sd = 0.2, center_floor_m = 0.005, inertia_floor_ratio = 0.02, friction_relative_sd = 0.5;
  std::vector<Joint> joint;
  std::vector<Shape> shape;
  std::vector<double> coupling;  // row-major C of q_motor = C q; empty: unit
  std::vector<EffectUse> effect;
  ParameterSet parameters;
  CeilingSettings ceilings;
  Control control;
  // Frame 0 seen from the base frame, in which gravity is given; the translation is seen in no torque. Rows of R.
  std::array<double, 3> base_xyz_m{};
  std::array<double, 9> base_rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};
  // The tool seen from the last link's frame.
  std::array<double, 3> tool_xyz_m{};
  std::array<double, 9> tool_rotation{1, 0, 0, 0, 1, 0, 0, 0, 1};

  int joints() const { return static_cast<int>(joint.size()); }
};

// Throws io::InputError with all faults of the file, a line for each: file, key or joint, what was expected.
Robot ReadRobot(const std::filesystem::path& path);

}  // namespace armcal::codegen

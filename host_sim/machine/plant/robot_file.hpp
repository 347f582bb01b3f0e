// plant - holds what a robot file says of mechanics, motors and sensors.
//
// The plant reads the same files as the generator, but with its own reader and in its own convention (bodies about
// their centres, KDL frames), so that an error in one of the two shows up as a disagreement. Keys that only the
// generator needs are left to the generator, which also refuses unknown ones.
#pragma once

#include <array>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <kdl/frames.hpp>
#include <kdl/rigidbodyinertia.hpp>

namespace armcal::plant {

// A rigid body: centre in the link frame, inertia xx xy xz yy yz zz about the centre in link axes.
struct Body {
  double mass_kg = 0;
  std::array<double, 3> center_m{};
  std::array<double, 6> inertia_kgm2{};
};

KDL::RigidBodyInertia ToKdl(const Body& body);
Body FromKdl(KDL::RigidBodyInertia body);  // a copy: KDL's RefPoint is not const

// Where a URDF puts a joint: its frame in the frame of the link before, at position zero, and its axis in that frame.
struct UrdfPlace {
  KDL::Frame frame;
  KDL::Vector axis;
};

// Rotary quantities; for a prismatic joint read m, m/s, N, N s/m, and rad/m for the gear ratio.
struct JointData {
  std::string name;
  bool prismatic = false;
  double alpha_rad = 0, a_m = 0, d_m = 0, theta_rad = 0;  // modified DH (Craig), offsets included
  std::optional<UrdfPlace> place;                         // in the place of DH
  double lowest_rad = -std::numeric_limits<double>::infinity(), highest_rad = -lowest_rad;
  double speed_limit_radps = 0;                     // 0: the file has none
  double torque_limit_Nm = 0, torque_noise_Nm = 0;  // noise: standard deviation of one tick's reading
  double coulomb_Nm = 0, viscous_Nmsprad = 0;
  bool coulomb_stated = false, viscous_stated = false, rotor_stated = false;  // by the robot file itself
  bool has_motor = false;
  double counts_per_turn = 0;  // of the motor
  long long zero_counts = 0;
  double gear_ratio = 1;                                                           // signed, motor per joint
  double current_A_per_lsb = 0, torque_constant_NmpA = 0, rotor_inertia_kgm2 = 0;  // at the motor shaft
  Body body;
};

struct RobotFile {
  std::string path, name;
  KDL::Vector gravity_mps2;  // base frame
  KDL::Frame base_frame;     // pose of frame 0 in the base frame
  KDL::Frame tool_frame;     // pose of the flange in the last link frame
  double tick_rate_Hz = 1000;
  std::vector<JointData> joint;
  Eigen::MatrixXd coupling;  // C of q_motor = C q, tau = C^T tau_motor; all sides in joint units

  int joints() const { return static_cast<int>(joint.size()); }
};

// Throws io::InputError (file, key, what was expected); also when bodies are missing, without which there is nothing to
// simulate. A joint without a motor is measured on the joint: 2^23 counts a turn or 1e7 a metre, and 2^14 steps of
// current up to the torque limit. A [payload] table makes the last link carry it.
// A URDF's joints that have no [[joint]] table are held: at `fixed`, as they mimic, or where their limits are next to
// zero. What they carry is a part of the link that carries them.
RobotFile ReadRobotFile(const std::string& path);

}  // namespace armcal::plant

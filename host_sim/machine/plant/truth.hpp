// plant - draws the true parameters of an arm around those of its robot file.
#pragma once

#include <cstdint>
#include <vector>

#include "host_sim/machine/plant/robot_file.hpp"

namespace armcal::plant {

// Half widths of the uniform factors by which the truth differs from the file; 0: no difference.
struct Spread {
  double inertial = 0.2;          // mass, each centre component, each inertia entry about the centre, rotor inertia
  double friction = 0.5;          // Coulomb and viscous
  double torque_constant = 0.03;  // of motors; a torque that is measured on the joint is exact
  // What the robot file itself does not state is drawn around this share s of the joint's torque limit T, +- 50 %:
  // Coulomb s T, viscous s T / speed limit, rotor on the joint's side s T / speed limit x 0.25 s. 0: as the file or its
  // URDF has it.
  double unstated = 0;
};

// What the arm really has. Units and shapes as in JointData, one entry a joint (motor).
struct Truth {
  std::vector<Body> body;
  std::vector<double> rotor_inertia_kgm2, coulomb_Nm, viscous_Nmsprad, torque_constant_NmpA;
};

// Positive mass, inertia about the centre positive definite, triangle inequality of its principal moments.
bool IsPhysical(const Body& body);

// Draws, in this order: link by link mass, centre x y z, inertia xx xy xz yy yz zz (the whole body again until it is
// physical), rotor; then joint by joint Coulomb, viscous; then all torque constants; then joint by joint what is not
// stated (Coulomb, viscous, rotor). Equal seeds give equal arms. Throws io::InputError when no physical body is found
// near a link of the file.
Truth DrawTruth(const RobotFile& robot, const Spread& spread, std::uint64_t seed);

}  // namespace armcal::plant

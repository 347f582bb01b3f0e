// plant - draws the true parameters until every body is physical.
#include "host_sim/machine/plant/truth.hpp"

#include <Eigen/Dense>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/machine/plant/random.hpp"

namespace armcal::plant {
namespace {

// Enough for any CAD body that is itself physical; a body that never passes is the file's fault.
constexpr int kMostDraws = 1000;

Body DrawBody(const Body& nominal, double spread, Random& random) {
  const auto scale = [&](double value) { return value * random.Uniform(1 - spread, 1 + spread); };
  Body body;
  body.mass_kg = scale(nominal.mass_kg);
  for (std::size_t k = 0; k < 3; ++k) body.center_m[k] = scale(nominal.center_m[k]);
  for (std::size_t k = 0; k < 6; ++k) body.inertia_kgm2[k] = scale(nominal.inertia_kgm2[k]);
  return body;
}

}  // namespace

bool IsPhysical(const Body& body) {
  const auto& i = body.inertia_kgm2;
  Eigen::Matrix3d inertia;
  inertia << i[0], i[1], i[2], i[1], i[3], i[4], i[2], i[4], i[5];
  const Eigen::Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(inertia).eigenvalues();
  return body.mass_kg > 0 && moments[0] > 0 && moments[0] + moments[1] > moments[2];
}

Truth DrawTruth(const RobotFile& robot, const Spread& spread, std::uint64_t seed) {
  Random random(seed);
  Truth truth;
  for (const JointData& joint : robot.joint) {
    int draws = 0;
    Body body;
    do {
      if (++draws > kMostDraws)
        throw io::InputError(robot.path + ": " + joint.name +
                             ": link: expected a body near a physical one (positive "
                             "definite inertia, no principal moment above the sum of the others)");
      body = DrawBody(joint.body, spread.inertial, random);
    } while (!IsPhysical(body));
    truth.body.push_back(body);
    truth.rotor_inertia_kgm2.push_back(joint.rotor_inertia_kgm2 *
                                       random.Uniform(1 - spread.inertial, 1 + spread.inertial));
  }
  for (const JointData& joint : robot.joint) {
    truth.coulomb_Nm.push_back(joint.coulomb_Nm * random.Uniform(1 - spread.friction, 1 + spread.friction));
    truth.viscous_Nmsprad.push_back(joint.viscous_Nmsprad * random.Uniform(1 - spread.friction, 1 + spread.friction));
  }
  for (const JointData& joint : robot.joint)
    truth.torque_constant_NmpA.push_back(joint.torque_constant_NmpA *
                                         random.Uniform(1 - spread.torque_constant, 1 + spread.torque_constant));
  return truth;
}

}  // namespace armcal::plant

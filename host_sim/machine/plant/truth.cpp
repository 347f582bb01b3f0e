// plant - draws the true parameters until every body is physical.
#include "host_sim/machine/plant/truth.hpp"

#include <Eigen/Dense>
#include <algorithm>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/machine/plant/random.hpp"

namespace armcal::plant {
namespace {

// Enough for any CAD body that is itself physical; a body that never passes is the file's fault.
constexpr int kMostDraws = 1000;
constexpr double kFastest = 20;    // rad/s, m/s; a limit above stands for none
constexpr double kRunUp_s = 0.25;  // in which s T alone would bring the rotor to the speed limit

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
  for (const JointData& joint : robot.joint) {
    const double factor = random.Uniform(1 - spread.torque_constant, 1 + spread.torque_constant);
    truth.torque_constant_NmpA.push_back(joint.torque_constant_NmpA * (joint.has_motor ? factor : 1));
  }
  for (std::size_t j = 0; spread.unstated > 0 && j < robot.joint.size(); ++j) {
    const JointData& joint = robot.joint[j];
    const auto draw = [&] { return spread.unstated * joint.torque_limit_Nm * random.Uniform(0.5, 1.5); };
    const double speed = joint.speed_limit_radps > 0 ? std::min(joint.speed_limit_radps, kFastest) : kFastest;
    const double coulomb = draw(), viscous = draw() / speed, rotor = draw() / speed * kRunUp_s;
    if (!joint.coulomb_stated) truth.coulomb_Nm[j] = coulomb;
    if (!joint.viscous_stated) truth.viscous_Nmsprad[j] = viscous;
    if (!joint.rotor_stated) truth.rotor_inertia_kgm2[j] = rotor / (joint.gear_ratio * joint.gear_ratio);
  }
  return truth;
}

}  // namespace armcal::plant

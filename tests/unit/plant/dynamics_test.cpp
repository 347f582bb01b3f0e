// plant - tests that the motion obeys mechanics: energy, and a second KDL chain.
#include <kdl/chainidsolver_recursive_newton_euler.hpp>

#include "tests/unit/plant/bench.hpp"

namespace armcal::plant {
namespace {

using namespace bench;

// Four joints with every kind of row: turned base, slanted axes, a sliding joint.
std::vector<JointText> FourJoints() {
  return {{.d_m = 0.3},
          {.alpha_deg = -90, .a_m = 0.2},
          {.type = "prismatic", .alpha_deg = 40, .a_m = 0.4, .gear = 150},
          {.alpha_deg = 60, .a_m = 0.1, .d_m = 0.2, .gear = -80}};
}
const std::string kTurnedBase =
    "dh = \"modified\"\nbase_frame = { xyz_m = [0.1, 0.2, 0.3], rpy_deg = [20, -30, 40] }\n";

TEST(Motion, WithoutFrictionOrCurrent_KeepsItsEnergy) {
  Arm arm(MakeScenario("start_rad = [0.3, 0.4, 0.1, -0.5]\n[truth]\ninertial_spread = 0.2\n"),
          WriteText("four.toml", RobotText(FourJoints(), kTurnedBase)));
  Sensors sensors;
  const double before = Energy(arm);
  double worst = 0, exchanged = 0;
  for (int k = 0; k < 3000; ++k) {
    arm.Step(std::vector<double>(4, 0.0), sensors);
    worst = std::max(worst, std::abs(Energy(arm) - before));
    for (int j = 0; j < 4; ++j) exchanged = std::max(exchanged, 0.5 * arm.qd()[j] * arm.qd()[j] * 0.2);
  }
  EXPECT_GT(exchanged, 1.0);  // J: it did fall and swing; rotors alone are 0.2 kg m2
  EXPECT_LT(worst, 1e-3);     // J: the midpoint rule at 0.25 ms; a wrong body or axis gives more than 1
}

TEST(Motion, UnderPower_GainsWhatMotorsGiveAndFrictionLeaves) {
  std::vector<JointText> joints = FourJoints();
  for (JointText& joint : joints) joint.coulomb = 6, joint.viscous = 4;
  Arm arm(MakeScenario("[truth]\nfriction_spread = 0.5\ntorque_constant_spread = 0.03\n"),
          WriteText("four.toml", RobotText(joints, "tick_rate_Hz = 4000\n" + kTurnedBase)));
  Sensors sensors;
  const double before = Energy(arm);
  double work = 0, heat = 0, last_power = 0;
  while (arm.time_s() < 3) {
    std::vector<double> current(4);
    for (int j = 0; j < 4; ++j)
      current[static_cast<std::size_t>(j)] = CurrentFor(arm, j, 60 * std::sin(6 * arm.time_s() + j));
    arm.Step(current, sensors);
    const double power = (arm.torque_Nm() - arm.friction_torque_Nm()).dot(arm.qd());
    work += 0.5 * (power + last_power) * arm.tick_s();
    heat += arm.friction_torque_Nm().dot(arm.qd()) * arm.tick_s();
    last_power = power;
  }
  EXPECT_GT(heat, 5.0);
  // J, of 535 exchanged; what is left (0.025) falls with the square of the tick: trapezoids over a violent motion.
  EXPECT_NEAR(Energy(arm) - before, work, 0.05);
}

// The same arm in KDL's other convention: each segment is joint first, then the constant way to the next joint, and
// bodies are moved to the segment's tip.
KDL::Chain OtherChain(const Arm& arm) {
  const auto& joints = arm.robot().joint;
  const auto row = [&](std::size_t k) {
    return KDL::Frame::DH_Craig1989(joints[k].a_m, joints[k].alpha_rad, joints[k].d_m, joints[k].theta_rad);
  };
  KDL::Chain chain;
  chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::None), row(0)));
  for (std::size_t k = 0; k < joints.size(); ++k) {
    const KDL::Frame tip = k + 1 < joints.size() ? row(k + 1) : KDL::Frame::Identity();
    const Body& body = arm.truth().body[k];
    const auto& i = body.inertia_kgm2;
    const KDL::RigidBodyInertia inertia(body.mass_kg, KDL::Vector(body.center_m[0], body.center_m[1], body.center_m[2]),
                                        KDL::RotationalInertia(i[0], i[3], i[5], i[1], i[2], i[4]));
    chain.addSegment(KDL::Segment(KDL::Joint(KDL::Joint::RotZ), tip, tip.Inverse() * inertia));
  }
  return chain;
}

// Torque of a perfect model at (q, qd, qdd): rigid bodies, rotors, Coulomb and viscous friction.
Eigen::VectorXd PerfectTorque(const Arm& arm, KDL::ChainIdSolver_RNE& solver, const Eigen::VectorXd& q,
                              const Eigen::VectorXd& qd, const Eigen::VectorXd& qdd) {
  KDL::JntArray jq(6), jqd(6), jqdd(6), torque(6);
  jq.data = q, jqd.data = qd, jqdd.data = qdd;
  solver.CartToJnt(jq, jqd, jqdd, KDL::Wrenches(7, KDL::Wrench::Zero()), torque);
  Eigen::VectorXd sum = torque.data;
  for (int j = 0; j < 6; ++j) {
    const std::size_t k = static_cast<std::size_t>(j);
    const double gear = arm.robot().joint[k].gear_ratio;
    sum[j] += gear * gear * arm.truth().rotor_inertia_kgm2[k] * qdd[j] + arm.truth().viscous_Nmsprad[k] * qd[j] +
              arm.truth().coulomb_Nm[k] * ((qd[j] > 0) - (qd[j] < 0));
  }
  return sum;
}

TEST(Motion, OfSixAxes_IsWhatASecondKdlChainSaysAtEachInstant) {
  Arm arm(MakeScenario("[truth]\n", "er20_like"), kEr20);
  KDL::Chain chain = OtherChain(arm);
  KDL::ChainIdSolver_RNE solver(chain, KDL::Vector(0, 0, -9.81));
  Er20Run run(arm);
  double worst = 0;
  for (int k = 0; k < 4000; ++k) {
    run.Tick();
    const Eigen::VectorXd perfect = PerfectTorque(arm, solver, arm.q(), arm.qd(), arm.qdd());
    for (int j = 0; j < 6; ++j)
      if (arm.qd()[j] != 0) worst = std::max(worst, std::abs(arm.torque_Nm()[j] - perfect[j]));
  }
  EXPECT_LT(worst, 1e-8);  // N m: rounding of about 1e3 N m
}

// What an estimator sees: averages of 8 ticks, speed and acceleration from five averages. Readings without noise must
// then fit the motion far better than the noise, away from reversals, or a perfect model could not reach the floor.
TEST(Motion, AveragedLikeAnEstimatorSample_FitsTheNoiseFreeReading) {
  Arm arm(MakeScenario("[truth]\ntorque_constant_spread = 0\n", "er20_like"), kEr20);
  KDL::Chain chain = OtherChain(arm);
  KDL::ChainIdSolver_RNE solver(chain, KDL::Vector(0, 0, -9.81));
  Er20Run run(arm);
  constexpr int kTicks = 8, kSamples = 1250;
  std::vector<Eigen::VectorXd> q(kSamples, Eigen::VectorXd::Zero(6)), torque = q, slowest = q;
  for (int s = 0; s < kSamples; ++s) {
    slowest[static_cast<std::size_t>(s)].setConstant(1e9);
    for (int k = 0; k < kTicks; ++k) {
      run.Tick();
      q[static_cast<std::size_t>(s)] += run.loop().Position() / kTicks;
      torque[static_cast<std::size_t>(s)] += arm.measured_torque_truth_Nm() / kTicks;
      slowest[static_cast<std::size_t>(s)] = slowest[static_cast<std::size_t>(s)].cwiseMin(arm.qd().cwiseAbs());
    }
  }
  const double h = kTicks * arm.tick_s();
  Eigen::VectorXd square = Eigen::VectorXd::Zero(6), count = square;
  for (std::size_t s = 250; s + 2 < kSamples; ++s) {
    const Eigen::VectorXd qd = (q[s - 2] - 8 * q[s - 1] + 8 * q[s + 1] - q[s + 2]) / (12 * h);
    const Eigen::VectorXd qdd = (-q[s - 2] + 16 * q[s - 1] - 30 * q[s] + 16 * q[s + 1] - q[s + 2]) / (12 * h * h);
    const Eigen::VectorXd error = torque[s] - PerfectTorque(arm, solver, q[s], qd, qdd);
    for (int j = 0; j < 6; ++j) {
      if (slowest[s - 2][j] < 0.05 || slowest[s + 2][j] < 0.05 || slowest[s][j] < 0.05) continue;
      square[j] += error[j] * error[j], ++count[j];
    }
  }
  for (int j = 0; j < 6; ++j) {
    const double sample_noise = arm.robot().joint[static_cast<std::size_t>(j)].torque_noise_Nm / std::sqrt(8.0);
    EXPECT_GT(count[j], 500);
    EXPECT_LT(std::sqrt(square[j] / count[j]), 0.1 * sample_noise) << "joint " << j + 1;
  }
}

// One joint about +y of the base, which turns its mass of 3 kg at 0.2 m of its x axis from +x down to -z.
JointText LyingAxis() {
  return {.alpha_deg = -90,
          .link = "mass_kg = 3.0, center_m = [0.2, 0, 0], inertia_kgm2 = [0.05, 0, 0, 0.06, 0, 0.04]"};
}

TEST(Dynamics, TheOffsetOfADhRow_IsInDegrees) {
  std::string text = RobotText({LyingAxis()});
  text.insert(text.find("d_m = "), "offset_deg = 60.0\n");
  const RobotFile robot = ReadRobotFile(WriteText("offset.toml", text));
  EXPECT_NEAR(robot.joint[0].theta_rad, std::numbers::pi / 3, 1e-12);
  Dynamics dynamics(robot, {robot.joint[0].body}, robot.gravity_mps2);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(1), down = Eigen::VectorXd::Constant(1, std::numbers::pi / 6);
  EXPECT_NEAR(dynamics.Torque(zero, zero, zero)[0], -3 * 9.81 * 0.2 * 0.5, 1e-12);  // cos 60 degrees
  EXPECT_NEAR(dynamics.Torque(down, zero, zero)[0], 0, 1e-12);                      // 30 more: it hangs
}

TEST(Dynamics, ThePayloadOfTheRobotFile_IsCarriedAtTheFlange) {
  // The flange is 0.5 m out and turned a quarter about z: the payload's centre at its -y is at the link's +x.
  const RobotFile robot =
      ReadRobotFile(WriteText("loaded.toml", RobotText({LyingAxis()},
                                                       "dh = \"modified\"\n"
                                                       "tool_frame = { xyz_m = [0.5, 0, 0], rpy_deg = [0, 0, 90] }\n"
                                                       "payload = { mass_kg = 2.0, center_m = [0, -0.1, 0], "
                                                       "inertia_kgm2 = [0.01, 0, 0, 0.02, 0, 0.03] }\n")));
  EXPECT_NEAR(robot.joint[0].body.mass_kg, 5, 1e-12);
  Dynamics dynamics(robot, {robot.joint[0].body}, robot.gravity_mps2);
  const Eigen::VectorXd zero = Eigen::VectorXd::Zero(1), one = Eigen::VectorXd::Ones(1);
  const double weight = dynamics.Torque(zero, zero, zero)[0];
  EXPECT_NEAR(weight, -9.81 * (3 * 0.2 + 2 * 0.6), 1e-12);
  const double inertia = 0.04 + 3 * 0.2 * 0.2 + 0.03 + 2 * 0.6 * 0.6;  // about the axis, by Steiner
  EXPECT_NEAR(dynamics.Torque(zero, zero, one)[0] - weight, inertia, 1e-12);
}

TEST(Dynamics, StandardDh_IsTheModifiedArmWithShiftedRows) {
  // Standard row i: (a_i, alpha_i) after the joint; modified row i+1 has them before its joint.
  const auto standard = ReadRobotFile(WriteText("standard.toml", RobotText({{.alpha_deg = -90, .a_m = 0.2, .d_m = 0.3},
                                                                            {.alpha_deg = 30, .a_m = 0.5, .d_m = 0.1}},
                                                                           "dh = \"standard\"\n")));
  const auto modified =
      ReadRobotFile(WriteText("modified.toml", RobotText({{.d_m = 0.3}, {.alpha_deg = -90, .a_m = 0.2, .d_m = 0.1}})));
  std::vector<Body> bodies{standard.joint[0].body, standard.joint[1].body};
  Dynamics a(standard, bodies, standard.gravity_mps2), b(modified, bodies, modified.gravity_mps2);
  const Eigen::Vector2d q(0.4, -1.1), qd(0.7, 1.3), qdd(-2, 3);
  EXPECT_LT((a.Torque(q, qd, qdd) - b.Torque(q, qd, qdd)).norm(), 1e-12);
  EXPECT_NEAR(standard.tool_frame.p.x(), 0.5, 1e-12);  // the last row leads to the flange
}

}  // namespace
}  // namespace armcal::plant

// plant - gives the plant's tests small robots as text, an energy oracle, a trajectory and a PD loop.
#pragma once

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <Eigen/Dense>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/machine/plant/arm.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::plant::bench {

inline std::string WriteText(const std::string& name, const std::string& text) {
  static const files::test::TemporaryFolder folder;  // until the program ends
  return folder.Write(name, text).string();
}

// What a test wants of a joint; the rest is the same for all.
struct JointText {
  std::string type = "revolute";
  double alpha_deg = 0, a_m = 0, d_m = 0, coulomb = 0, viscous = 0, gear = 100, noise = 0, zero_counts = 0;
  std::string link =
      "mass_kg = 3.0, center_m = [0.2, 0.05, -0.1], inertia_kgm2 = [0.05, 0.004, -0.006, 0.06, 0.003, 0.04]";
};

inline std::string RobotText(const std::vector<JointText>& joints, const std::string& top = "dh = \"modified\"\n") {
  std::string text = "name = \"test_arm\"\ntitle = \"t\"\nsource = \"t\"\ngravity_mps2 = [0.0, 0.0, -9.81]\n" + top;
  int number = 0;
  for (const JointText& j : joints) {
    const bool slides = j.type == "prismatic";
    const auto line = [&text](const std::string& key, double value) {
      text += key + " = " + std::to_string(value) + "\n";
    };
    text += "[[joint]]\nname = \"axis " + std::to_string(++number) + "\"\ntype = \"" + j.type + "\"\n";
    line("alpha_deg", j.alpha_deg), line("a_m", j.a_m), line("d_m", j.d_m);
    line(slides ? "torque_limit_N" : "torque_limit_Nm", 500);
    line(slides ? "torque_noise_N" : "torque_noise_Nm", j.noise);
    line(slides ? "coulomb_N" : "coulomb_Nm", j.coulomb);
    line(slides ? "viscous_Nspm" : "viscous_Nmsprad", j.viscous);
    text += "encoder = { counts_per_turn = 65536, zero_counts = " + std::to_string(std::lround(j.zero_counts)) + " }\n";
    text += "motor = { gear_ratio = " + std::to_string(j.gear) +
            ", current_A_per_lsb = 0.001, torque_constant_NmpA = 0.5, rotor_inertia_kgm2 = 2.0e-5 }\n";
    text += "link = { " + j.link + " }\n";
  }
  return text;
}

// more: further TOML, top-level keys first. Truth equals the file unless `more` has its own [truth].
inline Scenario MakeScenario(const std::string& more = "", const std::string& robot = "test_arm") {
  const std::string exact = more.find("[truth]") == std::string::npos
                                ? "\n[truth]\ninertial_spread = 0\nfriction_spread = 0\ntorque_constant_spread = 0\n"
                                : "";
  return ReadScenario(WriteText(
      "scenario.toml", "title = \"t\"\nrobot = \"" + robot + "\"\ntruth_seed = 5\nnoise_seed = 6\n" + more + exact));
}

inline std::unique_ptr<const JointEffect> Make(const std::string& kind, const std::string& keys, int joint = 0) {
  const toml::table table = toml::parse(keys);
  const io::TomlReader reader(table, "test");
  auto effect = ReadJointEffect(kind, reader, joint);
  reader.Finish();
  return effect;
}

// Kinetic plus potential energy by DH products and geometric Jacobians; shares no code with the plant's KDL chain.
inline double Energy(const Arm& arm) {
  const RobotFile& robot = arm.robot();
  const auto to_eigen = [](const KDL::Vector& v) { return Eigen::Vector3d(v.x(), v.y(), v.z()); };
  Eigen::Isometry3d frame = Eigen::Isometry3d::Identity();
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) frame(r, c) = robot.base_frame.M(r, c);
  frame.translation() = to_eigen(robot.base_frame.p);
  std::vector<Eigen::Vector3d> axis, origin;
  double energy = 0;
  for (int k = 0; k < arm.joints(); ++k) {
    const JointData& joint = robot.joint[static_cast<std::size_t>(k)];
    const Body& body = arm.truth().body[static_cast<std::size_t>(k)];
    const double theta = joint.theta_rad + (joint.prismatic ? 0 : arm.q()[k]);
    const double d = joint.d_m + (joint.prismatic ? arm.q()[k] : 0);
    frame = frame * Eigen::AngleAxisd(joint.alpha_rad, Eigen::Vector3d::UnitX()) *
            Eigen::Translation3d(joint.a_m, 0, 0) * Eigen::AngleAxisd(theta, Eigen::Vector3d::UnitZ()) *
            Eigen::Translation3d(0, 0, d);
    axis.push_back(frame.linear().col(2));
    origin.push_back(frame.translation());
    const Eigen::Vector3d center = frame * Eigen::Vector3d(body.center_m.data());
    Eigen::Vector3d speed = Eigen::Vector3d::Zero(), turn = Eigen::Vector3d::Zero();
    for (int i = 0; i <= k; ++i) {
      const std::size_t s = static_cast<std::size_t>(i);
      if (robot.joint[s].prismatic) {
        speed += axis[s] * arm.qd()[i];
      } else {
        speed += axis[s].cross(center - origin[s]) * arm.qd()[i];
        turn += axis[s] * arm.qd()[i];
      }
    }
    const auto& m = body.inertia_kgm2;
    Eigen::Matrix3d inertia;
    inertia << m[0], m[1], m[2], m[1], m[3], m[4], m[2], m[4], m[5];
    const Eigen::Vector3d local = frame.linear().transpose() * turn;
    const double rotor =
        joint.gear_ratio * joint.gear_ratio * arm.truth().rotor_inertia_kgm2[static_cast<std::size_t>(k)];
    energy += 0.5 * body.mass_kg * speed.squaredNorm() + 0.5 * local.dot(inertia * local) +
              0.5 * rotor * arm.qd()[k] * arm.qd()[k] - body.mass_kg * to_eigen(robot.gravity_mps2).dot(center);
  }
  return energy;
}

// Current that gives a joint torque by nominal constants (no coupling).
inline double CurrentFor(const Arm& arm, int joint, double torque) {
  const JointData& j = arm.robot().joint[static_cast<std::size_t>(joint)];
  return torque / (j.gear_ratio * j.torque_constant_NmpA);
}

// Five harmonics of 0.1 Hz, six joints; close to what an excitation for this arm looks like.
struct Wave {
  static constexpr double kPeriod_s = 10;
  static void At(double t, Eigen::VectorXd& q, Eigen::VectorXd& qd) {
    static constexpr double kA[6][5] = {{.65, 1.2, -1.1, -.5, .1},   {.65, -.1, .65, .35, .5},
                                        {-.3, -.7, -.3, .1, -.55},   {.6, .85, 1.1, .15, 1.05},
                                        {-.65, -.65, .25, .3, -1.1}, {-.9, .3, -.6, .9, .4}};
    static constexpr double kB[6][5] = {{.5, -.1, .45, .05, .2},    {-.1, .1, -.75, .25, .15},
                                        {-.7, 1.2, -.45, 0, .2},    {.5, -.1, .45, -.15, -1},
                                        {.3, .7, -.15, -.05, -1.1}, {-.95, -.4, .4, -.55, .3}};
    static constexpr double kCenter[6] = {.2, -.3, 1.1, .4, -.2, .1};
    const double w = 2 * std::numbers::pi / kPeriod_s;
    q.resize(6), qd.resize(6);
    for (int j = 0; j < 6; ++j) {
      q[j] = kCenter[j], qd[j] = 0;
      for (int k = 1; k <= 5; ++k) {
        q[j] += (kA[j][k - 1] * std::sin(w * k * t) - kB[j][k - 1] * std::cos(w * k * t)) / (w * k);
        qd[j] += kA[j][k - 1] * std::cos(w * k * t) + kB[j][k - 1] * std::sin(w * k * t);
      }
    }
  }
};

// The loop of the robot file's [control]: kp on position, kd on the encoder's difference, nothing else.
class PdLoop {
 public:
  PdLoop(Arm& arm, std::vector<double> kp, std::vector<double> kd)
      : arm_(arm), kp_(std::move(kp)), kd_(std::move(kd)), command_(kp_.size()) {
    arm_.Read(sensors_);
    last_ = Position();
  }
  void Tick(const Eigen::VectorXd& q, const Eigen::VectorXd& qd) {
    const Eigen::VectorXd now = Position();
    for (int j = 0; j < arm_.joints(); ++j) {
      const std::size_t k = static_cast<std::size_t>(j);
      const double speed = (now[j] - last_[j]) / arm_.tick_s();
      command_[k] = CurrentFor(arm_, j, kp_[k] * (q[j] - now[j]) + kd_[k] * (qd[j] - speed));
    }
    last_ = now;
    arm_.Step(command_, sensors_);
  }
  // Joint position by the encoder.
  Eigen::VectorXd Position() const {
    Eigen::VectorXd q(arm_.joints());
    for (int j = 0; j < arm_.joints(); ++j) {
      const JointData& joint = arm_.robot().joint[static_cast<std::size_t>(j)];
      q[j] = static_cast<double>(sensors_.counts[static_cast<std::size_t>(j)] - joint.zero_counts) * 2 *
             std::numbers::pi / (joint.counts_per_turn * joint.gear_ratio);
    }
    return q;
  }
  const Sensors& sensors() const { return sensors_; }

 private:
  Arm& arm_;
  std::vector<double> kp_, kd_, command_;
  Sensors sensors_;
  Eigen::VectorXd last_;
};

inline const std::string kEr20 = "codegen/robots/er20_like.toml";

// The wave from its first pose on, with the gains of er20_like.toml and two seconds of fading in.
class Er20Run {
 public:
  explicit Er20Run(Arm& arm) : arm_(arm), loop_(Placed(arm), kKp, kKd) { Wave::At(0, start_, q_); }
  void Tick() {
    const double s = std::min(1.0, arm_.time_s() / 2), rate = s < 1 ? 0.5 : 0;
    const double fade = s * s * s * (10 - 15 * s + 6 * s * s), slope = 30 * s * s * (1 - s) * (1 - s) * rate;
    Wave::At(arm_.time_s(), q_, qd_);
    qd_ = fade * qd_ + slope * (q_ - start_);
    q_ = start_ + fade * (q_ - start_);
    loop_.Tick(q_, qd_);
  }
  const Eigen::VectorXd& wanted() const { return q_; }
  const PdLoop& loop() const { return loop_; }

 private:
  static Arm& Placed(Arm& arm) {
    Eigen::VectorXd q, qd;
    Wave::At(0, q, qd);
    arm.Place({q.data(), 6});
    return arm;
  }
  inline static const std::vector<double> kKp{60000, 80000, 40000, 4000, 3000, 1500}, kKd{1500, 2000, 1000, 60, 45, 20};
  Arm& arm_;
  PdLoop loop_;
  Eigen::VectorXd start_, q_, qd_;
};

}  // namespace armcal::plant::bench

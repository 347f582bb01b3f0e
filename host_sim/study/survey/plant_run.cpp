// survey - drives the plant along a series and records what its sensors say.
#include "host_sim/study/survey/plant_run.hpp"
#include <cmath>
#include <numbers>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/machine/plant/arm.hpp"
#include "host_sim/study/survey/online_run.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Where on the series the reference stands: phase, pace and change of pace. The pace rises along 3 s^2 - 2 s^3.
struct Pace {
  double phase, rate, change;
};
Pace PaceAt(double t) {
  if (t >= kRamp_s) return {t - 0.5 * kRamp_s, 1, 0};
  const double s = t / kRamp_s;
  return {kRamp_s * (s * s * s - 0.5 * s * s * s * s), 3 * s * s - 2 * s * s * s, 6 * (s - s * s) / kRamp_s};
}

// The reference at a time: the series' chain rule.
codegen::Signals ReferenceAt(const excitation::Series& series, double t) {
  const Pace pace = PaceAt(t);
  codegen::Signals s = series.At(VectorXd::Constant(1, pace.phase));
  s.qdd = s.qdd * (pace.rate * pace.rate) + s.qd * pace.change;
  s.qd *= pace.rate;
  return s;
}

std::vector<plant::Body> FileBodies(const plant::RobotFile& file) {
  std::vector<plant::Body> bodies;
  for (const plant::JointData& joint : file.joint) bodies.push_back(joint.body);
  return bodies;
}

// The drive's loop: torque of the file's arm along the reference, and a PD law on encoder readings.
class Loop {
 public:
  Loop(const codegen::Robot& robot, const excitation::Series& series, plant::Arm& arm)
      : robot_(robot),
        series_(series),
        arm_(arm),
        declared_(arm.robot(), FileBodies(arm.robot()), arm.robot().gravity_mps2),
        current_(static_cast<std::size_t>(arm.joints())) {
    const codegen::Signals start = ReferenceAt(series, 0);
    const VectorXd q = start.q.row(0);
    arm_.Place({q.data(), static_cast<std::size_t>(q.size())});
    arm_.Read(sensors_);
    before_ = Position();
  }

  // One tick. Afterwards q and torque are the readings at its end.
  void Tick() {
    const double step = arm_.tick_s();
    const codegen::Signals want = ReferenceAt(series_, arm_.time_s() + step);
    const VectorXd q = want.q.row(0), qd = want.qd.row(0), qdd = want.qdd.row(0), is = Position();
    const VectorXd feed = declared_.Torque(q, qd, qdd);
    for (int j = 0; j < arm_.joints(); ++j) {
      const plant::JointData& data = arm_.robot().joint[static_cast<std::size_t>(j)];
      const double speed = (is[j] - before_[j]) / step;
      const double friction = std::copysign(data.coulomb_Nm, qd[j]) + data.viscous_Nmsprad * qd[j];
      const double torque = feed[j] + friction + data.gear_ratio * data.gear_ratio * data.rotor_inertia_kgm2 * qdd[j] +
                            robot_.control.kp_Nmprad[j] * (q[j] - is[j]) +
                            robot_.control.kd_Nmsprad[j] * (qd[j] - speed);
      current_[static_cast<std::size_t>(j)] = torque / (data.gear_ratio * data.torque_constant_NmpA);
    }
    before_ = is;
    arm_.Step(current_, sensors_);
  }
  VectorXd Position() const {
    VectorXd q(arm_.joints());
    for (int j = 0; j < q.size(); ++j) {
      const plant::JointData& data = arm_.robot().joint[static_cast<std::size_t>(j)];
      q[j] = static_cast<double>(sensors_.counts[static_cast<std::size_t>(j)] - data.zero_counts) * 2 *
             std::numbers::pi / (data.counts_per_turn * data.gear_ratio);
    }
    return q;
  }
  VectorXd Torque() const {
    VectorXd tau(arm_.joints());
    for (int j = 0; j < tau.size(); ++j) {
      const plant::JointData& data = arm_.robot().joint[static_cast<std::size_t>(j)];
      tau[j] = sensors_.current_lsb[static_cast<std::size_t>(j)] * data.current_A_per_lsb * data.gear_ratio *
               data.torque_constant_NmpA;
    }
    return tau;
  }

 private:
  const codegen::Robot& robot_;
  const excitation::Series& series_;
  plant::Arm& arm_;
  plant::Dynamics declared_;
  plant::Sensors sensors_;
  std::vector<double> current_;
  VectorXd before_;
};

// The arm, and its loop after the ramp.
struct Running {
  Running(const codegen::Robot& robot, const excitation::Series& series, const PlantSettings& settings)
      : arm(ScenarioOf(settings), robot.path), loop(robot, series, arm) {
    for (long long k = std::llround(kRamp_s / arm.tick_s()); k > 0; --k) loop.Tick();
  }

  plant::Arm arm;
  Loop loop;

 private:
  static plant::Scenario ScenarioOf(const PlantSettings& settings) {
    plant::Scenario scenario;
    scenario.truth_seed = settings.truth_seed, scenario.noise_seed = settings.noise_seed;
    scenario.spread = {0, settings.friction, settings.torque_constant, 0};
    scenario.joint_effects = settings.effects;
    scenario.torque_noise_scale = settings.noise;
    if (settings.payload) scenario.payload = plant::PayloadStep{*settings.payload, 0, INFINITY};
    scenario.flange = KDL::Frame::Identity();
    // A current that steps is not the same throughout a tick, and the reading at its end is not its mean. That moves
    // the torque by 0.08 ms against the position, and a fit takes most of this for viscous friction.
    scenario.command_ramps = true;
    return scenario;
  }
};

// What a payload adds to the joints' torque.
class PayloadTorque {
 public:
  PayloadTorque(const plant::Arm& arm, const plant::Body& payload)
      : bare_(arm.robot(), arm.truth().body, arm.robot().gravity_mps2),
        laden_(arm.robot(), arm.truth().body, arm.robot().gravity_mps2,
               plant::AttachedBody{payload, KDL::Frame::Identity()}) {}
  VectorXd At(const plant::Arm& arm) {
    return laden_.Torque(arm.q(), arm.qd(), arm.qdd()) - bare_.Torque(arm.q(), arm.qd(), arm.qdd());
  }

 private:
  plant::Dynamics bare_, laden_;
};

// On the joints' side.
VectorXd RotorInertias(const codegen::Robot& robot) {
  VectorXd rotors(robot.joints());
  for (int j = 0; j < robot.joints(); ++j) {
    const auto& motor = robot.joint[static_cast<std::size_t>(j)].motor;
    rotors[j] = motor.gear_ratio * motor.gear_ratio * motor.rotor_inertia_kgm2;
  }
  return rotors;
}

}  // namespace

logs::Log RunPlant(const codegen::Robot& robot, const excitation::Series& series, const PlantSettings& settings) {
  if (robot.control.structure.empty()) throw io::InputError(robot.path + ": expected a [control] table");
  Running plant(robot, series, settings);
  const double step = plant.arm.tick_s() * robot.sample_ticks;
  const auto samples = static_cast<Eigen::Index>(settings.seconds / step);
  std::optional<PayloadTorque> load;
  if (settings.payload && settings.load_loss.size() > 0) load.emplace(plant.arm, *settings.payload);
  logs::Log log;
  log.joints = plant.arm.joints();
  log.source = "plant";
  log.t = VectorXd::LinSpaced(samples, 0, step * static_cast<double>(samples - 1));
  log.q.setZero(samples, log.joints), log.tau = log.q;
  for (Eigen::Index k = 0; k < samples; ++k)
    for (int tick = 0; tick < robot.sample_ticks; ++tick) {
      plant.loop.Tick();
      log.q.row(k) += plant.loop.Position().transpose() / robot.sample_ticks;
      VectorXd torque = plant.loop.Torque();
      if (load) torque += settings.load_loss.cwiseProduct(load->At(plant.arm));
      log.tau.row(k) += torque.transpose() / robot.sample_ticks;
    }
  return log;
}

calibration::Dataset WithoutRotors(const codegen::Robot& robot, const codegen::Model& model, const logs::Log& log) {
  calibration::Dataset data = calibration::Prepare(model, log, {kPlantCutoff_Hz});
  data.tau -= data.s.qdd * RotorInertias(robot).asDiagonal();
  return data;
}

Instants RunExactly(const codegen::Robot& robot, const excitation::Series& series, const PlantSettings& settings) {
  Running plant(robot, series, settings);
  const double step = plant.arm.tick_s() * robot.sample_ticks;
  const auto samples = static_cast<Eigen::Index>(settings.seconds / step);
  const int n = plant.arm.joints();
  Instants all;
  all.s.t.resize(samples);
  all.s.q.resize(samples, n), all.s.qd = all.s.qdd = all.tau = all.s.q;
  Eigen::Index kept = 0;
  for (Eigen::Index k = 0; k < samples; ++k) {
    for (int tick = 0; tick < robot.sample_ticks; ++tick) plant.loop.Tick();
    const VectorXd& qd = plant.arm.qd();
    bool moves = true;
    for (int j = 0; j < n; ++j) moves &= Moves(qd[j], robot.joint[static_cast<std::size_t>(j)]);
    if (!moves) continue;
    all.s.t[kept] = step * static_cast<double>(k);
    all.s.q.row(kept) = plant.arm.q(), all.s.qd.row(kept) = qd, all.s.qdd.row(kept) = plant.arm.qdd();
    all.tau.row(kept++) = plant.arm.torque_Nm() - RotorInertias(robot).cwiseProduct(plant.arm.qdd());
  }
  all.s.t.conservativeResize(kept);
  for (MatrixXd* block : {&all.s.q, &all.s.qd, &all.s.qdd, &all.tau}) block->conservativeResize(kept, n);
  return all;
}

}  // namespace armcal::survey

// tests - records 60 s of the simulated arm for the programs that run on a target: make_trace ROBOT SCENARIO OUT
//
// The plant is the arm as it really is, with a truth of its own; the controller is the robot file's, without any model.
#include <cmath>
#include <cstdio>
#include <exception>
#include <fstream>
#include <numbers>

#include "armcal/model/sample.hpp"
#include "codegen/src/robot/robot.hpp"
#include "host_sim/machine/plant/arm.hpp"
#include "tests/target/trace_tick.hpp"

namespace {

using namespace armcal;  // NOLINT: a program of one file

constexpr int kTicks = 60000, kJoints = 6;

// A joint's set-point: three tones, none of them a multiple of another joint's.
struct Motion {
  double q = 0, qd = 0;
};
Motion SetPoint(int joint, double t) {
  Motion motion;
  for (int k = 0; k < 3; ++k) {
    const double w = 2 * std::numbers::pi * (0.05 + 0.013 * joint + 0.11 * k), speed = 0.25 + 0.05 * joint;
    motion.q -= speed / w * std::cos(w * t + joint + k);
    motion.qd += speed * std::sin(w * t + joint + k);
  }
  return motion;
}

void Record(const char* robot_path, const char* scenario_path, std::ofstream& out) {
  const codegen::Robot robot = codegen::ReadRobot(robot_path);
  plant::Arm arm(plant::ReadScenario(scenario_path), robot_path);
  Eigen::VectorXd start(kJoints);
  for (int j = 0; j < kJoints; ++j) start[j] = SetPoint(j, 0).q;
  arm.Place({start.data(), kJoints});
  plant::Sensors sensors;
  arm.Read(sensors);
  std::vector<std::int32_t> before = sensors.counts;
  std::vector<double> command(kJoints);
  for (int tick = 0; tick < kTicks; ++tick) {
    for (int j = 0; j < kJoints; ++j) {
      const plant::JointData& data = arm.robot().joint[j];
      const double counts_to_rad = 2 * std::numbers::pi / (data.counts_per_turn * data.gear_ratio);
      const double q = counts_to_rad * static_cast<double>(sensors.counts[j] - data.zero_counts);
      const double qd = counts_to_rad * (sensors.counts[j] - before[j]) / arm.tick_s();
      const Motion set = SetPoint(j, tick * arm.tick_s());
      command[j] = (robot.control.kp_Nmprad[j] * (set.q - q) + robot.control.kd_Nmsprad[j] * (set.qd - qd)) /
                   (data.gear_ratio * data.torque_constant_NmpA);
    }
    before = sensors.counts;
    arm.Step(command, sensors);
    target::TraceTick record = {};
    for (int j = 0; j < kJoints; ++j) {
      record.counts[j] = sensors.counts[j];
      record.current[j] = sensors.current_lsb[j];
      record.temperature_cdegC[j] = static_cast<std::int16_t>(std::lround(100 * sensors.temperature_degC[j]));
      record.flags[j] = static_cast<std::uint8_t>(model::kEnabled | (sensors.saturated[j] ? model::kSaturated : 0));
    }
    out.write(reinterpret_cast<const char*>(&record), sizeof record);
  }
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 4) {
    std::fprintf(stderr, "make_trace ROBOT SCENARIO OUT\n");
    return 2;
  }
  try {
    std::ofstream out(arguments[3], std::ios::binary);
    Record(arguments[1], arguments[2], out);
    return out.good() ? 0 : 1;
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}

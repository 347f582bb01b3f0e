// survey - measures an arm that the survey did not make: the plant (KDL, stiction, sensors) follows a series in a loop.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "codegen/src/robot/robot.hpp"
#include "host_sim/data/logs/log.hpp"
#include "host_sim/identify/calibration/dataset.hpp"
#include "host_sim/identify/excitation/series.hpp"
#include "host_sim/machine/plant/scenario.hpp"

namespace armcal::survey {

// Until the series runs at its own pace. The plant's clock shows it when a recording begins.
inline constexpr double kRamp_s = 2;

// Cut-off for positions of the plant, whose counts are fine.
inline constexpr double kPlantCutoff_Hz = 50;

struct PlantSettings {
  std::uint64_t truth_seed = 1, noise_seed = 1;
  // Half widths by which the true arm differs from the robot file. The true bodies are those of the file.
  double friction = 0.5, torque_constant = 0.03;
  double seconds = 10;
  double noise = 1;                                    // of the torque, over the robot file's
  std::vector<plant::PlacedJointEffect> effects = {};  // beside Coulomb and viscous friction
  std::optional<plant::Body> payload = {};             // in the last link's frame
  Eigen::VectorXd load_loss = {};                      // f1 of (9) for the payload's torque, of each joint, in RunPlant
};

// The plant starts at rest, reaches the series' pace within two seconds and is then recorded for `seconds`. A PD law
// with feed-forward of the file's bodies (KDL) drives it by the gains in robot.control. The current goes on a straight
// line from one tick's command to the next one's. A sample of the log is the average of robot.sample_ticks readings of
// encoder and current. With load_loss the motors give f1 times the payload's torque in addition. The loss takes it, so
// the arm moves as it would without. io::InputError: the plant cannot read the robot file; the file has no [control]
// table.
logs::Log RunPlant(const codegen::Robot& robot, const excitation::Series& series, const PlantSettings& settings);

// What an arm without rotors would have measured: the survey's arm has none. RunPlant's log at the model's rows, less
// the torque of the robot file's rotors.
calibration::Dataset WithoutRotors(const codegen::Robot& robot, const codegen::Model& model, const logs::Log& log);

// The same run without sensors: state and motor torque of single instants at which every joint moves faster than its
// v_min, less the torque of the rotors.
struct Instants {
  codegen::Signals s;
  Eigen::MatrixXd tau;
};
Instants RunExactly(const codegen::Robot& robot, const excitation::Series& series, const PlantSettings& settings);

}  // namespace armcal::survey

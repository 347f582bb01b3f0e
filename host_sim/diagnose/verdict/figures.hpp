// verdict - gives figures that several verbs print and write: the error on a held-out log, the exogeneity test.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "host_sim/identify/calibration/held_out.hpp"
#include "host_sim/identify/methods/exogeneity.hpp"

namespace armcal::verdict {

// Per joint, over scored samples: all, and where the joint moves. relative: error / torque, moving samples. band: the
// same in a band.
struct HeldOutError {
  Eigen::VectorXd rms, rms_moving, relative, relative_band, moving_share;
  double band_Hz = 0;
};

HeldOutError CompareHeldOut(const calibration::Dataset& test, const Eigen::MatrixXd& predicted, double band_Hz);
void PrintHeldOut(const HeldOutError& e, const std::string& name);
nlohmann::ordered_json ToJson(const HeldOutError& e);
std::vector<double> ToList(const Eigen::VectorXd& v);

// Which joints hold, which fail, where it cannot be told; and what to do. otherwise: what else may make it fail.
std::string ExogeneityText(const calibration::Exogeneity& e, const std::string& otherwise);
inline constexpr const char* kLacksMore = "the model lacks a torque that no record describes";
nlohmann::ordered_json ToJson(const calibration::Exogeneity& e);

// "1, 3 and 4" of joints counted from 0.
std::string JointGroup(const std::vector<int>& joints);

// What a held-out log cannot tell, a line each: its samples or trajectory are a training log's; a joint of it is
// outside of what training has shown; joints that move in phase. Empty: nothing to say.
std::vector<std::string> MotionText(const calibration::HeldOutMotion& motion);
// {"same_samples", "same_as", "repeated", "repeats", "joints": [{"positions_outside", "speeds_outside",
// "variance_ratio", "extrapolation"}], "in_phase": [{"joints", "held_out_too"}]}
nlohmann::ordered_json ToJson(const calibration::HeldOutMotion& motion);

}  // namespace armcal::verdict

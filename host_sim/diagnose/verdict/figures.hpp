// verdict - gives figures that several verbs print and write: the error on a held-out log, the exogeneity test.
#pragma once

#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "host_sim/identify/calibration/held_out.hpp"
#include "host_sim/identify/methods/exogeneity.hpp"

namespace armcal::verdict {

// Per joint [n]; NaN: the joint has no such samples. rms: over scored samples; rms_moving, relative (error / torque):
// over those where the joint moves. nrmse: rms(error) / std(torque) over every sample of the record, as the public
// benchmarks define it; R2 is one minus its square.
struct ErrorFigures {
  Eigen::VectorXd rms, rms_moving, relative, nrmse;
  Eigen::VectorXd r2() const { return 1 - nrmse.array().square(); }
};
// band: the same of torque and prediction below band_Hz, both through one zero-phase filter.
struct HeldOutError {
  ErrorFigures full, band;
  Eigen::VectorXd moving_share;
  double band_Hz = 0;  // 0: no band was asked for
};

// A log and its predicted torque [N x n].
struct Predicted {
  const calibration::Dataset* log = nullptr;
  Eigen::MatrixXd torque;
};

// All logs as one record; each is filtered by itself. InputError: a band from half a log's sample rate on.
HeldOutError CompareHeldOut(const std::vector<Predicted>& logs, double band_Hz);
HeldOutError CompareHeldOut(const calibration::Dataset& test, const Eigen::MatrixXd& predicted, double band_Hz);
// The table of a terminal, a row a joint.
void PrintError(const HeldOutError& e, const codegen::Robot& robot, const std::string& of);
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

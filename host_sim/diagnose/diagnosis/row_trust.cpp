// diagnosis - compares rows with those beside them: the sign of friction in them, and what the model leaves of them.
#include "host_sim/diagnose/diagnosis/row_trust.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "host_sim/identify/calibration/channel.hpp"

namespace armcal::diagnosis {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr double kColoured = 0.9;  // of the deviation: what is predictable from the rows before is no part of it
constexpr double kSteady = 0.1;    // change of friction's sign, which goes from -1 to 1
constexpr double kFarOff = 4;      // usual deviations
constexpr double kHeavy = 0.003;   // share of rows that are as far off; of normal noise it is 0.00006
constexpr double kHalf = 1.7;      // usual deviations where a row's square weighs half
constexpr int kBeside = 2;         // rows on each side

// How far each row is from the median of those beside it. 0 where the segment ends.
VectorXd FromThoseBeside(const RowIndex& rows, const VectorXd& left) {
  VectorXd out = VectorXd::Zero(left.size());
  int begin = 0;  // of the segment
  for (int last = 0; last < rows.size(); ++last) {
    if (rows.segment_begin[static_cast<std::size_t>(last)]) begin = last;
    const int first = last - 2 * kBeside, middle = last - kBeside;
    if (first < begin) continue;
    std::array<double, 2 * kBeside> about;
    std::copy_n(left.data() + first, kBeside, about.begin());
    std::copy_n(left.data() + middle + 1, kBeside, about.begin() + kBeside);
    std::sort(about.begin(), about.end());
    out[middle] = left[middle] - 0.5 * (about[kBeside - 1] + about[kBeside]);
  }
  return out;
}

// Weights that differ from row to row would hide the colour from the whitening of the rows.
bool IsColoured(const RowIndex& rows, const VectorXd& left) {
  const double deviation = left.norm() / std::sqrt(static_cast<double>(std::max<Index>(1, left.size())));
  return FitNoise(rows, left).innovation < kColoured * deviation;
}

}  // namespace

VectorXd SteadyFriction(const codegen::Model& model, const calibration::Dataset& data, int joint) {
  const codegen::Robot& robot = model.robot();
  const Eigen::ArrayXd speed = data.s.qd.col(joint).array();
  const bool is_smooth = robot.sign_law == "tanh";
  const VectorXd sign = calibration::ThroughChannel(
      data, joint, is_smooth ? VectorXd((speed / robot.sign_width_radps).tanh()) : VectorXd(speed.sign()));
  const auto of_joint = [joint](const VectorXd& Hz) {
    return Hz.size() > joint ? Hz[joint] : std::numeric_limits<double>::infinity();
  };
  const double resolved_s = 0.5 / std::min(of_joint(data.cutoff_Hz), of_joint(data.saved_Hz));
  const Index samples = sign.size(), reach = static_cast<Index>(std::ceil(resolved_s * data.rate_Hz()));
  VectorXd out(samples);
  for (Index k = 0; k < samples; ++k) {
    const Index first = std::max<Index>(0, k - reach), last = std::min(samples - 1, k + reach);
    const auto about = sign.segment(first, last - first + 1);
    out[k] = about.maxCoeff() - about.minCoeff() < kSteady;
  }
  return out;
}

VectorXd KnockWeights(const RowIndex& rows, const VectorXd& left) {
  const VectorXd off = FromThoseBeside(rows, left);
  const double usual = UsualDeviation(off);
  const auto far = static_cast<double>((off.array().abs() > kFarOff * usual).count());
  if (IsColoured(rows, left) || !(usual > 0) || far < kHeavy * static_cast<double>(rows.size())) return {};
  return (1 + (off / (kHalf * usual)).array().square()).rsqrt();
}

}  // namespace armcal::diagnosis

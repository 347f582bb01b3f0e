// judged set - filters and delays torques as a channel does.
#include "tests/judged/channel.hpp"

#include <algorithm>
#include <cmath>

namespace armcal::judged {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

VectorXd Lagged(const VectorXd& u, double pole_Hz, double step_s) {
  const double x = 2 * kPi * pole_Hz * step_s, decay = std::exp(-x);
  const double now = 1 - (1 - decay) / x, before = (1 - decay) / x - decay;  // of an input that is linear in between
  VectorXd y(u.size());
  y[0] = u[0];
  for (Index k = 1; k < u.size(); ++k) y[k] = decay * y[k - 1] + now * u[k] + before * u[k - 1];
  return y;
}

VectorXd Delayed(const VectorXd& u, double delay_s, double step_s) {
  VectorXd y(u.size());
  for (Index k = 0; k < u.size(); ++k) {
    const double at = std::max(0.0, static_cast<double>(k) - delay_s / step_s);
    const auto below = static_cast<Index>(at);
    const double share = at - static_cast<double>(below);
    y[k] = (1 - share) * u[below] + share * u[std::min(below + 1, u.size() - 1)];
  }
  return y;
}

}  // namespace

VectorXd Passed(const Channel& channel, int joint, const VectorXd& torque, double step_s) {
  if (!channel.late()) return torque;
  VectorXd out = torque;
  for (int i = 0; i < 2 && channel.pole_Hz[joint] > 0; ++i) out = Lagged(out, channel.pole_Hz[joint], step_s);
  return channel.delay_s[joint] > 0 ? Delayed(out, channel.delay_s[joint], step_s) : out;
}

Eigen::MatrixXd Passed(const Channel& channel, const Eigen::MatrixXd& torque, double step_s) {
  if (!channel.late()) return torque;
  Eigen::MatrixXd out(torque.rows(), torque.cols());
  for (Index j = 0; j < torque.cols(); ++j) out.col(j) = Passed(channel, static_cast<int>(j), torque.col(j), step_s);
  return out;
}

}  // namespace armcal::judged

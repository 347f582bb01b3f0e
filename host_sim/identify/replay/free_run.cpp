// replay - steps an arm through a log's torque.
#include "host_sim/identify/replay/free_run.hpp"

#include <Eigen/QR>
#include <cmath>
#include <limits>

#include "codegen/src/io/input_error.hpp"

namespace armcal::replay {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kRunaway = 1e3;  // rad or m: the arm is no longer one
// The first pass takes friction and dynamics where the step begins, the second one in its middle.
constexpr int kPasses = 2;
constexpr int kMostCuts = 3;  // of a step, for each joint

}  // namespace

Record MakeRecord(const logs::Log& log) {
  Record r{log.t, log.q, log.tau, log.temp, log.source};
  if (log.ext.cols() == log.joints) r.torque += log.ext;
  return r;
}

FreeRun::FreeRun(const codegen::Model& model, double step_s) : model_(model), arm_(model), step_s_(step_s) {}

int FreeRun::Stride(const Record& log) const {
  const double sample_s = (log.t[log.samples() - 1] - log.t[0]) / (log.samples() - 1);
  return std::max(1, static_cast<int>(std::floor(step_s_ / sample_s + 1e-3)));
}

// A step of h, cut where a joint stops: there friction changes at once, and the rest of the step begins at rest.
void FreeRun::Advance(double h, double t, const VectorXd& torque, const VectorXd& temp) {
  VectorXd next, slid;
  for (int cuts = 0;; ++cuts) {
    next = qd_ + h * qdd_;
    for (int pass = 0; pass < kPasses; ++pass) {
      const VectorXd middle = 0.5 * (qd_ + next), at = q_ + 0.5 * h * middle;
      arm_.SetDynamics(at, middle);
      arm_.SetFriction({t, at, middle, qdd_, temp});
      arm_.Step(h, torque, qd_, next);
    }
    double share = 1;
    Eigen::Index stops = -1;
    if (cuts < kMostCuts * qd_.size() && (qd_.cwiseProduct(next).array() <= 0 && qd_.array() != 0).any()) {
      arm_.Slide(h, torque, qd_, slid);
      for (Eigen::Index j = 0; j < qd_.size(); ++j)
        if (qd_[j] * slid[j] < 0 && qd_[j] / (qd_[j] - slid[j]) < share) share = qd_[j] / (qd_[j] - slid[j]), stops = j;
    }
    if (stops >= 0) {
      next = qd_ + share * (slid - qd_);
      next[stops] = 0;
      qdd_ = (slid - qd_) / h;
    } else {
      qdd_ = (next - qd_) / h;
    }
    q_ += 0.5 * share * h * (qd_ + next);
    qd_ = next;
    if (stops < 0) return;
    h *= 1 - share;
    if (h <= 0) return;
  }
}

MatrixXd FreeRun::Run(const Record& log, int first, int last, const State& start, const Parameters& p) {
  const int n = model_.joints(), stride = Stride(log), count = (last - first) / stride;
  MatrixXd out = MatrixXd::Constant(count + 1, n, std::numeric_limits<double>::quiet_NaN());
  arm_.SetParameters(p.z);
  const VectorXd to_torque = (1 + p.kappa.array()).inverse();
  VectorXd torque(n), temp;
  q_ = start.q, qd_ = start.qd, qdd_ = VectorXd::Zero(n);
  out.row(0) = q_;
  for (int step = 0; step < count; ++step) {
    const int k = first + step * stride, end = k + stride;
    const double length_s = log.t[end] - log.t[k];
    const int parts = std::max(1, static_cast<int>(std::ceil(length_s / step_s_ - 0.5)));
    const double h = length_s / parts;
    if (log.temp.cols() == n) temp = log.temp.row(k);
    for (int part = 0; part < parts; ++part) {
      const double share = (part + 0.5) / parts;
      if (stride == 1) {
        torque = (1 - share) * log.torque.row(k) + share * log.torque.row(end);
      } else {
        torque.setZero();
        for (int i = k; i < end; ++i)
          torque +=
              0.5 * (log.t[i + 1] - log.t[i]) / length_s * (log.torque.row(i) + log.torque.row(i + 1)).transpose();
      }
      torque.array() *= to_torque.array();
      Advance(h, log.t[k] + share * length_s, torque, temp);
    }
    if (!q_.allFinite() || q_.cwiseAbs().maxCoeff() > kRunaway) break;
    out.row(step + 1) = q_;
  }
  return out;
}

State StateFromFirst(const Record& log, int samples) {
  if (samples < 3 || samples > log.samples())
    throw io::InputError(log.source + ": --start-samples " + std::to_string(samples) + ": expected 3 to " +
                         std::to_string(log.samples()) + ", the samples of the log");
  const double middle_s = log.t[(samples - 1) / 2];
  MatrixXd powers(samples, 3);
  for (int k = 0; k < samples; ++k) {
    const double s = log.t[k] - middle_s;
    powers.row(k) << 1, s, s * s;
  }
  const MatrixXd fit = powers.colPivHouseholderQr().solve(MatrixXd(log.q.topRows(samples)));
  return {fit.row(0), fit.row(1)};
}

}  // namespace armcal::replay

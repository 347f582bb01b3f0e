// methods - simulates the arm under its control law, step by step, and makes logs along that motion.
#include "host_sim/identify/methods/closed_loop.hpp"
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/quintic_spline.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kSubsteps = 2;          // steps of one control period
constexpr double kRunaway_rad = 1e3;  // beyond: the parameters are no arm's

const codegen::Model& Checked(const codegen::Model& model) {
  if (model.robot().control.structure != "pd_feedforward")
    throw io::InputError(model.robot().path + ": control: expected structure = \"pd_feedforward\" with rate and gains");
  return model;
}

VectorXd Map(const std::vector<double>& v) { return VectorXd::Map(v.data(), static_cast<Eigen::Index>(v.size())); }

}  // namespace

LoopSimulator::LoopSimulator(const codegen::Model& model, const LoopSettings& settings)
    : model_(Checked(model)), settings_(settings), arm_(model) {
  const int n = model.joints();
  kp_ = Map(model.robot().control.kp_Nmprad), kd_ = Map(model.robot().control.kd_Nmsprad);
  limit_.resize(n), resolution_.resize(n);
  for (int j = 0; j < n; ++j) {
    const codegen::Joint& joint = model.robot().joint[j];
    limit_[j] = joint.torque_limit_Nm;
    resolution_[j] = 2 * std::numbers::pi / (joint.motor.counts_per_turn * std::abs(joint.motor.gear_ratio));
  }
  if (settings_.feedforward.size() == 0) settings_.feedforward = MakeProblem(model, {}).start;
}

// The believed model's torque along the reference; friction takes the reference's direction, none below v_min.
MatrixXd LoopSimulator::FeedForward(const codegen::Signals& s) const {
  const int n = model_.joints(), columns = model_.columns();
  const VectorXd& x = settings_.feedforward;
  MatrixXd tau = MatrixXd::Zero(s.samples(), n);
  model_.ForEachBlock(
      s, {x.data(), static_cast<std::size_t>(columns)},
      {x.data() + columns, static_cast<std::size_t>(model_.nonlinear())},
      [&](int begin, int count, std::span<const double* const> root) {
        for (int j = 0; j < n; ++j)
          for (int c = 0; c < columns; ++c) {
            if (model_.rows()[j][c].IsZero()) continue;
            const double* value = root[static_cast<std::size_t>(j * columns + c)];
            for (int k = 0; k < count; ++k)
              if (model_.is_rigid(c) || std::abs(s.qd(begin + k, j)) > model_.robot().joint[j].v_min_radps)
                tau(begin + k, j) += x[c] * value[k];
          }
      });
  return tau;
}

// law: the control law's torque at rest in q = 0; kp, kd: its gains, zero for a joint at its limit.
void LoopSimulator::Step(double h, const VectorXd& law, const VectorXd& kp, const VectorXd& kd) {
  const VectorXd before = qd_;
  arm_.SetFriction({0, q_, before, qdd_, {}});
  tau_ = arm_.Step(h, {law, kp, kd}, q_, before, qd_);
}

LoopRun LoopSimulator::Run(const VectorXd& t, const MatrixXd& reference, const VectorXd& z) {
  const int n = model_.joints(), samples = static_cast<int>(t.size());
  const double h = 1 / (model_.robot().control.rate_Hz * kSubsteps);
  const int steps = std::max(1, static_cast<int>(std::ceil((t[samples - 1] - t[0]) / h - 1e-6)));
  const logs::QuinticSpline spline(t, reference);
  codegen::Signals ref;
  ref.t = (VectorXd::LinSpaced(steps + 1, 0, steps) * h).array() + t[0];
  ref.t = ref.t.cwiseMin(t[samples - 1]);
  ref.q = spline.Evaluate(ref.t, 0), ref.qd = spline.Evaluate(ref.t, 1), ref.qdd = spline.Evaluate(ref.t, 2);
  const MatrixXd ahead = FeedForward(ref);

  arm_.SetParameters(z);
  q_ = ref.q.row(0), qd_ = ref.qd.row(0), qdd_ = ref.qdd.row(0), tau_ = ahead.row(0);
  MatrixXd q(steps + 1, n), qd(steps + 1, n), tau(steps + 1, n);
  q.row(0) = q_, qd.row(0) = qd_, tau.row(0) = tau_;
  LoopRun out;
  VectorXd read_error = VectorXd::Zero(n), last_error = VectorXd::Zero(n), speed_error = VectorXd::Zero(n);
  int done = 0;
  for (int k = 1; k <= steps; ++k) {
    if (settings_.encoder && (k - 1) % kSubsteps == 0) {
      for (int j = 0; j < n; ++j) read_error[j] = resolution_[j] * std::round(q_[j] / resolution_[j]) - q_[j];
      speed_error = (read_error - last_error) * model_.robot().control.rate_Hz;
      last_error = read_error;
    }
    arm_.SetDynamics(q_ + 0.5 * h * qd_, qd_ + 0.5 * h * qdd_);  // of the step's middle
    const VectorXd before = qd_;
    const VectorXd law = ahead.row(k).transpose() + kp_.cwiseProduct(ref.q.row(k).transpose() - read_error) +
                         kd_.cwiseProduct(ref.qd.row(k).transpose() - speed_error);
    Step(h, law, kp_, kd_);
    if ((tau_.cwiseAbs() - limit_).maxCoeff() > 0) {  // joints at their limit give just that
      VectorXd cut = law, kp = kp_, kd = kd_;
      for (int j = 0; j < n; ++j)
        if (std::abs(tau_[j]) > limit_[j]) cut[j] = std::copysign(limit_[j], tau_[j]), kp[j] = kd[j] = 0;
      qd_ = before;
      Step(h, cut, kp, kd);
    }
    qdd_ = (qd_ - before) / h;
    q_ += 0.5 * h * (before + qd_);
    if (!q_.allFinite() || q_.cwiseAbs().maxCoeff() > kRunaway_rad) break;
    q.row(k) = q_, qd.row(k) = qd_, tau.row(k) = tau_;
    done = k;
  }
  out.complete = done == steps;
  // Between steps: speed and torque as straight lines. Acceleration and torque at a step: mean of the steps beside it.
  out.s.t = t;
  out.s.q.setConstant(samples, n, std::numeric_limits<double>::quiet_NaN());
  out.s.qd = out.s.q, out.s.qdd = out.s.q, out.tau = out.s.q;
  const auto slope = [&](int k) -> Eigen::RowVectorXd {
    const int a = std::max(0, k - 1), b = std::min(done, k + 1);
    return (qd.row(b) - qd.row(a)) / ((b - a) * h);
  };
  const auto torque = [&](int k) -> Eigen::RowVectorXd { return 0.5 * (tau.row(k) + tau.row(std::min(done, k + 1))); };
  for (int i = 0; i < samples && done > 0; ++i) {
    const double at = (t[i] - t[0]) / h;
    const int k = std::min(static_cast<int>(at), steps - 1);
    if (k + 1 > done) break;
    const double share = at - k;
    out.s.q.row(i) = (1 - share) * q.row(k) + share * q.row(k + 1);
    out.s.qd.row(i) = (1 - share) * qd.row(k) + share * qd.row(k + 1);
    out.s.qdd.row(i) = (1 - share) * slope(k) + share * slope(k + 1);
    out.tau.row(i) = (1 - share) * torque(k) + share * torque(k + 1);
  }
  out.q_read = out.s.q;
  for (int j = 0; j < n && settings_.encoder; ++j)
    out.q_read.col(j) = resolution_[j] * (out.s.q.col(j) / resolution_[j]).array().round();
  return out;
}

ClosedLoop MakeClosedLoop(const codegen::Model& model, const LoopSettings& settings) {
  const auto simulator = std::make_shared<LoopSimulator>(model, settings);
  return [simulator](const Dataset& log, const VectorXd& z) {
    if (log.reference.rows() != log.samples())
      throw io::InputError(log.source + ": expected a reference (qref) for every sample");
    return simulator->Run(log.s.t, log.reference, z).s;
  };
}

namespace {

constexpr double kFollows = 0.1;
constexpr double kSmallestShare = 0.125;

bool Follows(const codegen::Signals& s, const codegen::Signals& path) {
  for (Eigen::Index j = 0; j < path.q.cols(); ++j) {
    const auto motion = path.q.col(j).array() - path.q.col(j).mean();
    if ((s.q.col(j) - path.q.col(j)).squaredNorm() > kFollows * kFollows * motion.square().sum()) return false;
  }
  return true;
}

}  // namespace

LoopLogs::LoopLogs(const Problem& problem, const char* method) : problem_(problem) {
  if (!problem.closed_loop)
    throw io::InputError(std::string("method ") + method +
                         ": expected a control law in the robot file and a log with qref");
  if (!Run(problem.start))
    throw io::InputError(std::string("method ") + method +
                         ": the arm with the robot file's values runs away in simulation; expected gains and values "
                         "with which it follows its reference");
  start_ = logs_;
}

bool LoopLogs::Run(const VectorXd& z) {
  logs_.clear();
  for (const Dataset* log : problem_.train) {
    Dataset copy = *log;
    copy.s = problem_.closed_loop(*log, z);
    copy.s.temp = log->s.temp;
    if (!copy.s.q.allFinite() || !copy.s.qd.allFinite() || !copy.s.qdd.allFinite()) return false;
    if (!start_.empty() && !Follows(copy.s, start_[logs_.size()].s)) return false;
    logs_.push_back(std::move(copy));
  }
  return true;
}

double LoopLogs::Simulate(const VectorXd& z) {
  for (; share_ >= kSmallestShare; share_ /= 2)
    if (Run(problem_.start + share_ * (z - problem_.start))) return share_;
  logs_ = start_;
  return share_ = 0;
}

}  // namespace armcal::calibration

// methods - one step of an arm: its mass matrix, the friction of both directions, and the balance of all torques.
#include "host_sim/identify/methods/arm_step.hpp"

#include <algorithm>
#include <cmath>
#include <map>

#include "codegen/src/generator/derivative.hpp"
#include "codegen/src/generator/dynamics.hpp"

namespace armcal::calibration {

using codegen::Expr;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kSlowest = 0.02;  // share of v_min at which friction of a joint about to move is taken
constexpr int kMaxSweeps = 60;     // of the balance; a sweep's error falls by far more than half

// M (upper triangle, by column), V and G of (1), from base parameters as inputs.
std::vector<Expr> DynamicsRoots(codegen::Graph& g, const codegen::Model& model) {
  const codegen::Dynamics d = codegen::MakeDynamics(g, model.robot(), model.base_columns());
  std::vector<Expr> roots;
  for (const auto& column : d.mass) roots.insert(roots.end(), column.begin(), column.end());
  roots.insert(roots.end(), d.velocity.begin(), d.velocity.end());
  roots.insert(roots.end(), d.gravity.begin(), d.gravity.end());
  return roots;
}

bool ReadsAnotherJointsSpeed(const codegen::Model& model) {
  for (const codegen::InputId& input : model.graph().inputs()) {
    if (input.quantity != codegen::Quantity::kSpeed) continue;
    for (int j = 0; j < model.joints(); ++j)
      for (int c = 0; c < model.columns(); ++c) {
        const Expr e = model.rows()[j][c];
        if (j != input.row && !model.is_rigid(c) && !e.IsZero() && codegen::Reads(e, e.graph()->Input(input)))
          return true;
      }
  }
  return false;
}

}  // namespace

ArmStep::ArmStep(const codegen::Model& model)
    : model_(model), effects_(model), dynamics_(graph_, DynamicsRoots(graph_, model)) {
  const int n = model.joints();
  std::map<codegen::InputId, int> known;
  for (int j = 0; j < n; ++j)
    known[{codegen::Quantity::kPosition, j}] = j, known[{codegen::Quantity::kSpeed, j}] = n + j;
  for (int d = 0; d < model.rigid(); ++d)
    known[{.quantity = codegen::Quantity::kBaseParameter, .parameter = d}] = 2 * n + d;
  for (const codegen::InputId& input : graph_.inputs()) source_.push_back(known.contains(input) ? known[input] : -1);
  input_.assign(source_.size(), 0);
  value_.resize(static_cast<std::size_t>(n * (n + 1) / 2 + 2 * n));
  crossed_ = n > 1 && ReadsAnotherJointsSpeed(model);
}

void ArmStep::SetDynamics(const VectorXd& q, const VectorXd& qd) {
  const int n = model_.joints();
  for (std::size_t i = 0; i < source_.size(); ++i)
    if (const int s = source_[i]; s >= 0)
      input_[i] = s < n ? q[s] : s < 2 * n ? qd[s - n] : z_[model_.front() + s - 2 * n];
  dynamics_.EvaluateAt<double>(input_, scratch_, value_);
  mass_.resize(n, n);
  std::size_t k = 0;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i <= j; ++i) mass_(i, j) = mass_(j, i) = value_[k++];
  bias_ = VectorXd::Map(&value_[k], n) + VectorXd::Map(&value_[k + static_cast<std::size_t>(n)], n);
}

void ArmStep::SetFriction(const Instant& at) {
  const Eigen::Index n = at.speed.size();
  VectorXd size(n);
  for (Eigen::Index j = 0; j < n; ++j)
    size[j] = std::max(std::abs(at.speed[j]), kSlowest * model_.robot().joint[static_cast<std::size_t>(j)].v_min_radps);
  const auto torque = [&](const VectorXd& speed) {
    effects_.Set(at.t, at.q, speed, at.qdd, at.temp, z_);
    return effects_.Torque();
  };
  if (!crossed_) {
    forward_ = torque(size), backward_ = torque(-size);
    return;
  }
  forward_.resize(n), backward_.resize(n);
  for (Eigen::Index j = 0; j < n; ++j) {
    VectorXd speed = at.speed;
    speed[j] = size[j], forward_[j] = torque(speed)[j];
    speed[j] = -size[j], backward_[j] = torque(speed)[j];
  }
}

// A v + friction(v) = right for the speeds qd, friction between `backward` (v < 0) and `forward` (v > 0) at v = 0:
// projected Gauss-Seidel, which converges because A is positive definite. Where friction feeds energy (forward below
// backward), both directions may balance: the joint keeps its own.
void ArmStep::Balance(const VectorXd& right, const VectorXd& forward, const VectorXd& backward, VectorXd& qd) const {
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    double change = 0;
    for (Eigen::Index i = 0; i < qd.size(); ++i) {
      const double rest = right[i] - A_.row(i).dot(qd) + A_(i, i) * qd[i];
      const bool can_forward = rest > forward[i], can_backward = rest < backward[i];
      const bool goes_forward = can_forward && (!can_backward || qd[i] > 0);
      const double v = goes_forward   ? (rest - forward[i]) / A_(i, i)
                       : can_backward ? (rest - backward[i]) / A_(i, i)
                                      : 0;
      change = std::max(change, std::abs(v - qd[i]));
      qd[i] = v;
    }
    if (change < 1e-12) return;
  }
}

VectorXd ArmStep::Step(double h, const Law& law, const VectorXd& q, const VectorXd& before, VectorXd& qd) {
  A_ = mass_ / h;
  A_.diagonal() += law.kd + 0.5 * h * law.kp;
  const VectorXd right = mass_ * before / h + law.torque - law.kp.cwiseProduct(q + 0.5 * h * before) - bias_;
  qd = before;
  Balance(right, forward_, backward_, qd);
  return law.torque - law.kp.cwiseProduct(q + 0.5 * h * (before + qd)) - law.kd.cwiseProduct(qd);
}

void ArmStep::Step(double h, const VectorXd& torque, const VectorXd& before, VectorXd& qd) {
  A_ = mass_ / h;
  qd = before;
  Balance(mass_ * before / h + torque - bias_, forward_, backward_, qd);
}

void ArmStep::Slide(double h, const VectorXd& torque, const VectorXd& before, VectorXd& qd) {
  VectorXd forward = forward_, backward = backward_;
  for (Eigen::Index j = 0; j < before.size(); ++j) {
    if (before[j] > 0) backward[j] = forward[j];
    if (before[j] < 0) forward[j] = backward[j];
  }
  A_ = mass_ / h;
  qd = before;
  Balance(mass_ * before / h + torque - bias_, forward, backward, qd);
}

}  // namespace armcal::calibration

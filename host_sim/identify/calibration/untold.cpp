// calibration - tests at random states whether changed columns are those of an arm with other bodies.
#include "host_sim/identify/calibration/untold.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <bit>
#include <cmath>
#include <random>

#include "host_sim/identify/calibration/column_fit.hpp"
#include "host_sim/identify/calibration/prior.hpp"

namespace armcal::calibration {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kSame = 1e-6;    // of a column: rounding is below, a kinematic difference far above
constexpr double kOffset = 0.37;  // of a position; any value that is no special angle
constexpr double kFactor = 1.3;
constexpr int kSpare = 3;  // rows for each column

class Faults {
 public:
  explicit Faults(const codegen::Model& model) : model_(model), n_(model.joints()) {
    const int count = kSpare * model.columns() / n_ + 2;
    std::mt19937_64 random(1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    s_.t = VectorXd::LinSpaced(count, 0, 0.01 * count);
    for (MatrixXd* m : {&s_.q, &s_.qd, &s_.qdd}) m->resize(count, n_);
    for (int j = 0; j < n_; ++j) {
      const codegen::Joint& joint = model.robot().joint[static_cast<std::size_t>(j)];
      const auto [lower, upper] = joint.position_limit_rad;
      for (int k = 0; k < count; ++k) {
        s_.q(k, j) = 0.5 * (lower + upper) + 0.5 * (upper - lower) * uniform(random);
        s_.qd(k, j) = joint.speed_limit_radps * uniform(random);
        s_.qdd(k, j) = joint.acceleration_limit_radps2 * uniform(random);
      }
    }
    truth_ = Stack(s_);
  }

  // True torques, as another channel gives them, are torques of the arm at the positions that other channels give.
  bool Unseen(const codegen::Signals& read, const ColumnChange& torque, const VectorXd& factor) const {
    const MatrixXd fitted = Stack(read);
    MatrixXd given = truth_;
    const Index count = s_.q.rows();
    for (int j = 0; j < n_; ++j)
      given.middleRows(j * count, count) = factor[j] * torque.tau_sign[static_cast<std::size_t>(j)] *
                                           truth_.middleRows(torque.tau[static_cast<std::size_t>(j)] * count, count);
    VectorXd scale = fitted.colwise().norm();
    for (double& v : scale) v = v > 0 ? 1 / v : 0;
    Eigen::ColPivHouseholderQR<MatrixXd> qr;
    qr.setThreshold(1e-10);
    qr.compute(fitted * scale.asDiagonal());
    MatrixXd left = qr.householderQ().adjoint() * given;
    for (Index c = 0; c < given.cols(); ++c)
      if (left.col(c).tail(left.rows() - qr.rank()).norm() > kSame * given.col(c).norm()) return false;
    return true;
  }
  bool Unseen(const ColumnChange& change) const { return Unseen(change.Moved(s_), change, VectorXd::Ones(n_)); }
  bool UnseenOffset(int j) const {
    codegen::Signals read = s_;
    read.q.col(j).array() += kOffset;
    return Unseen(read, ColumnChange(n_), VectorXd::Ones(n_));
  }
  bool UnseenFactor(int j) const {
    VectorXd factor = VectorXd::Ones(n_);
    factor[j] = kFactor;
    return Unseen(s_, ColumnChange(n_), factor);
  }

 private:
  // [n x states] rows, joint after joint.
  MatrixXd Stack(const codegen::Signals& s) const {
    const std::vector<double> committed(static_cast<std::size_t>(model_.columns()), 0);
    std::vector<MatrixXd> row;
    model_.Regressor(s, committed, MeanUnknowns(model_), row);
    MatrixXd out(n_ * s.samples(), model_.columns());
    for (int j = 0; j < n_; ++j) out.middleRows(j * s.samples(), s.samples()) = row[static_cast<std::size_t>(j)];
    return out;
  }

  const codegen::Model& model_;
  int n_;
  codegen::Signals s_;
  MatrixXd truth_;
};

std::string List(const std::string& letter, unsigned set, int n) {
  std::string out;
  for (int j = 0; j < n; ++j)
    if (set >> j & 1U) out += (out.empty() ? "" : ", ") + letter + std::to_string(j + 1);
  return out;
}

// Sets of joints whose signs may turn together: those that follow from smaller ones are left out.
std::vector<unsigned> UnseenSigns(const Faults& faults, int n) {
  constexpr int kMost = 7;  // joints of which all sets are tried
  std::vector<unsigned> found, basis;
  const auto reduced = [&basis](unsigned set) {
    for (const unsigned b : basis) set = std::min(set, set ^ b);
    return set;
  };
  for (int size = 1; size <= n; ++size)
    for (unsigned set = 1; set < 1U << n; ++set) {
      if (std::popcount(set) != size || (n > kMost && size > 1 && size < n) || reduced(set) == 0) continue;
      ColumnChange change(n);
      for (int j = 0; j < n; ++j)
        if (set >> j & 1U)
          change.q_scale[static_cast<std::size_t>(j)] = change.tau_sign[static_cast<std::size_t>(j)] = -1;
      if (!faults.Unseen(change)) continue;
      found.push_back(set);
      basis.push_back(reduced(set));
      std::sort(basis.rbegin(), basis.rend());
    }
  return found;
}

}  // namespace

std::vector<std::string> UntoldFaults(const codegen::Model& model) {
  if (model.robot().has_prior) return {};
  const int n = model.joints();
  const Faults faults(model);
  std::vector<std::string> out;
  std::string offsets;
  for (int j = 0; j < n; ++j)
    if (faults.UnseenOffset(j)) offsets += (offsets.empty() ? "" : " or ") + fmt::format("q{}", j + 1);
  if (!offsets.empty()) out.push_back("an offset of " + offsets);
  if (n > 1) out.push_back("one factor of all torques");  // all parameters share it
  for (int j = 0; j < n; ++j)
    if (faults.UnseenFactor(j)) out.push_back(fmt::format("a factor of tau{}", j + 1));
  for (const unsigned set : UnseenSigns(faults, n))
    out.push_back((std::popcount(set) > 1 ? "the signs of " : "the sign of ") + List("q", set, n) + " with " +
                  List("tau", set, n));
  for (int i = 0; i < n; ++i)
    for (int j = i + 1; j < n; ++j) {
      ColumnChange change(n);
      std::swap(change.q[static_cast<std::size_t>(i)], change.q[static_cast<std::size_t>(j)]);
      std::swap(change.tau[static_cast<std::size_t>(i)], change.tau[static_cast<std::size_t>(j)]);
      if (faults.Unseen(change)) out.push_back(fmt::format("joints {} and {} exchanged", i + 1, j + 1));
    }
  ColumnChange pace(n);
  pace.pace = kFactor;
  if (faults.Unseen(pace)) out.push_back("the unit of time");
  return out;
}

}  // namespace armcal::calibration

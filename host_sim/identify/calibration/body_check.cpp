// calibration - checks a log against the torque that the robot file's bodies need.
#include "host_sim/identify/calibration/body_check.hpp"

#include <fmt/core.h>

#include <Eigen/QR>
#include <cmath>

#include "codegen/src/io/input_error.hpp"

namespace armcal::calibration {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kRows = 600;        // of a log: enough to tell columns apart
constexpr double kExchanged = 2;  // by how much an exchange of two columns must cut the sum of log residual variances
constexpr double kScale = 20;     // a torque this much larger or smaller than the bodies need is in another unit
constexpr double kDoubtful = 4;  // a torque this much larger or smaller may be in another unit, or the bodies are wrong
constexpr double kLaden = 50;    // no load makes a torque this much larger: it would be half the torque limit or more
constexpr double kTelling =
    0.5;  // share of the torque without friction that the bodies must explain before its scale is judged
constexpr double kTiny = 0.01;  // of the torque limit: a cable may need as much

struct Match {
  double log_left = 0;  // log of the share of variance left
  double told = 0;      // share of what friction leaves that the bodies explain
  double scale = 1;     // measured over needed
  double needed = 0;    // RMS about its mean
};

// torque = scale needed + Coulomb, viscous, offset, over rows of one joint. A torque that never changes, as of a joint
// that a brake holds, tells nothing.
Match Compare(const VectorXd& torque, const VectorXd& needed, const VectorXd& speed) {
  if (torque.minCoeff() == torque.maxCoeff()) return {};
  MatrixXd A(torque.size(), 4);
  A << needed, speed.cwiseSign(), speed, VectorXd::Ones(torque.size());
  const VectorXd x = A.colPivHouseholderQr().solve(torque);
  const double left = (torque - A * x).squaredNorm();
  const double all = (torque.array() - torque.mean()).square().sum();
  const MatrixXd friction = A.rightCols(3);
  const double without = (torque - friction * friction.colPivHouseholderQr().solve(torque)).squaredNorm();
  return {std::log(std::max(left, 1e-12 * all) / std::max(all, 1e-300)), 1 - left / std::max(without, 1e-300), x[0],
          std::sqrt((needed.array() - needed.mean()).square().mean())};
}

codegen::Signals EveryOf(const Dataset& d, MatrixXd& tau) {
  const int step = std::max(1, d.samples() / kRows);
  const auto rows = Eigen::seq(0, d.samples() - 1, step);
  tau = d.tau(rows, Eigen::all);
  codegen::Signals s;
  s.t = d.s.t(rows), s.q = d.s.q(rows, Eigen::all), s.qd = d.s.qd(rows, Eigen::all), s.qdd = d.s.qdd(rows, Eigen::all);
  return s;
}

class Checker {
 public:
  Checker(const codegen::Model& model, const Dataset& data) : model_(model), signals_(EveryOf(data, tau_)) {
    VectorXd bodies(model.body_parameters());
    for (int k = 0; k < bodies.size(); ++k) bodies[k] = model.table()[k].mean;
    base_ = model.base_map() * bodies;
  }

  std::vector<Match> Compare(const codegen::Signals& s, const MatrixXd& tau) const {
    std::vector<MatrixXd> row;
    model_.Regressor(s, {}, {}, row);
    std::vector<Match> out;
    for (int j = 0; j < model_.joints(); ++j)
      out.push_back(
          calibration::Compare(tau.col(j), row[j].middleCols(model_.front(), model_.rigid()) * base_, s.qd.col(j)));
    return out;
  }
  double Left(bool positions, bool torques, int i, int j) const {
    codegen::Signals s = signals_;
    MatrixXd tau = tau_;
    if (positions)
      for (MatrixXd* m : {&s.q, &s.qd, &s.qdd}) m->col(i).swap(m->col(j));
    if (torques) tau.col(i).swap(tau.col(j));
    double sum = 0;
    for (const Match& m : Compare(s, tau)) sum += m.log_left;
    return sum;
  }
  const codegen::Signals& signals() const { return signals_; }
  const MatrixXd& tau() const { return tau_; }

 private:
  const codegen::Model& model_;
  MatrixXd tau_;
  codegen::Signals signals_;
  VectorXd base_;
};

}  // namespace

std::vector<std::string> CheckAgainstModel(const codegen::Model& model, const Dataset& data) {
  if (!model.robot().has_prior) return {};
  const Checker checker(model, data);
  const double as_given = checker.Left(false, false, 0, 0);
  double least = as_given - kExchanged;
  std::string exchanged;
  for (int i = 0; i < model.joints(); ++i)
    for (int j = i + 1; j < model.joints(); ++j)
      for (const auto& [positions, torques, name] : {std::tuple{true, false, "q"}, std::tuple{false, true, "tau"}}) {
        const double left = checker.Left(positions, torques, i, j);
        if (left < least) least = left, exchanged = fmt::format("{0}{1} and {0}{2}", name, i + 1, j + 1);
      }
  if (!exchanged.empty())
    throw io::InputError(data.source + ": columns " + exchanged +
                         " seem to be exchanged; expected each in its joint's place");
  const std::vector<Match> match = checker.Compare(checker.signals(), checker.tau());
  std::string doubtful;
  bool fits_nearer_base = false, laden = false;
  for (int j = 0; j < model.joints(); ++j) {
    const Match& m = match[static_cast<std::size_t>(j)];
    if (m.needed < kTiny * model.robot().joint[j].torque_limit_Nm || m.told < kTelling) continue;
    if (m.scale > 1 / kDoubtful && m.scale < kDoubtful) {
      fits_nearer_base = true;
      continue;
    }
    // A load at the flange makes the torque of the outer joints large and hardly changes the inner ones.
    const bool may_be_load = fits_nearer_base && m.scale > 1;
    if (m.scale < 1 / kScale || m.scale > (may_be_load ? kLaden : kScale))
      throw io::InputError(
          data.source + fmt::format(": joint {}: torque is {:.2g} times what the robot file's bodies need, expected N "
                                    "m (N) on the joint side with the sign of q",
                                    j + 1, m.scale));
    laden = laden || may_be_load;
    doubtful += fmt::format("{}joint {} {:.2g}", doubtful.empty() ? "" : ", ", j + 1, m.scale);
  }
  if (doubtful.empty()) return {};
  return {
      data.source + ": torque as a multiple of what the robot file's bodies need: " + doubtful + "; " +
      (laden ? "does the arm carry a load that the robot file lacks, or is the torque not in N m?" : "is it in N m?") +
      " A motor current needs torque constant times gear ratio as scale in the channel map"};
}

}  // namespace armcal::calibration

// calibration - solves for bodies, friction, gains and load together, from sums over the logs.
#include "host_sim/identify/calibration/payload.hpp"

#include <fmt/core.h>
#include <Eigen/Cholesky>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/barrier_fit.hpp"
#include "host_sim/identify/calibration/table_file.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kWideTorque =
    100;  // a prior so wide that it says nothing: a column alone may make this many times the torque
constexpr double kWideGain = 10;    // the same for a gain
constexpr double kTolerance = 0.1;  // of a torque constant whose tolerance the robot file does not state
constexpr int kMostRounds = 40;
constexpr double kReach_m = 0.5;  // true of any load: its mass lies about this far from the flange

// Coordinates [columns, kappa (one a joint), load]; measured torque_j = (1 + kappa_j) (Y_j p + P_j load).
class LoadFit {
 public:
  LoadFit(const codegen::Model& model, const LoadLogs& logs)
      : model_(model), logs_(logs), n_(model.joints()), columns_(model.columns()), prior_(MakePrior(model)) {
    Eigen::Matrix4d flange = Eigen::Matrix4d::Identity();
    flange.topLeftCorner<3, 3>() =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(model.robot().tool_rotation.data());
    flange.topRightCorner<3, 1>() = Eigen::Map<const Eigen::Vector3d>(model.robot().tool_xyz_m.data());
    to_link_ = BodyMap(flange);
    eta_ = MeanUnknowns(model);
    sum_.assign(n_, MatrixXd::Zero(columns_ + kLoadParameters + 1, columns_ + kLoadParameters + 1));
    rows_.setZero(n_), sigma_.resize(n_), inflation_.setOnes(n_);
    for (int j = 0; j < n_; ++j) sigma_[j] = model.robot().joint[j].torque_noise_Nm;
    ForEachLog([&](const Dataset& log, const std::vector<MatrixXd>& raw) {
      for (int j = 0; j < n_; ++j) {
        const MatrixXd used = log.used.col(j).cast<double>().asDiagonal() * raw[j];
        sum_[j] += used.transpose() * used;
        rows_[j] += log.used.col(j).sum();
      }
    });
    const int size = columns_ + n_ + kLoadParameters;
    prior_.mean.conservativeResizeLike(VectorXd::Zero(size));
    prior_.covariance.conservativeResizeLike(MatrixXd::Zero(size, size));
    for (int i = 0; i < kLoadParameters; ++i) Widen(load(i), columns_ + i), prior_.active.push_back(load(i));
  }

  int gain(int joint) const { return columns_ + joint; }
  int load(int i) const { return columns_ + n_ + i; }
  double value(int c) const { return x_[c]; }
  double sd(int c) const { return std::sqrt(std::max(0.0, covariance_(c, c))); }
  double prior_sd(int c) const { return std::sqrt(prior_.covariance(c, c)); }
  VectorXd LoadValue() const { return x_.tail(kLoadParameters); }
  MatrixXd LoadCovariance() const { return covariance_.bottomRightCorner(kLoadParameters, kLoadParameters); }
  bool converged() const { return converged_; }

  // Makes the prior of the arm so wide that it says nothing. `gains`: the same for the gains; only their sign is known.
  void ForgetArm(bool gains) {
    for (const int c : prior_.active)
      if (c < columns_) prior_.covariance.row(c).setZero(), prior_.covariance.col(c).setZero(), Widen(c, c);
    if (!gains) return;
    std::erase_if(prior_.active, [&](int c) { return c >= columns_ && c < load(0); });
    for (int j = 0; j < n_; ++j)
      prior_.covariance(gain(j), gain(j)) = kWideGain * kWideGain, prior_.active.push_back(gain(j));
  }
  void KnowLoad(const codegen::Payload& known) {
    VectorXd body = VectorXd::Zero(kLoadParameters);
    body[0] = known.mass_kg;
    if (known.center_m) std::copy(known.center_m->begin(), known.center_m->end(), body.data() + 1);
    if (known.inertia_kgm2) std::copy(known.inertia_kgm2->begin(), known.inertia_kgm2->end(), body.data() + 4);
    const int count = known.inertia_kgm2 ? kLoadParameters : known.center_m ? 4 : 1;
    const VectorXd origin = ToOrigin(body);
    for (int i = 0; i < count; ++i) prior_.mean[load(i)] = origin[i], std::erase(prior_.active, load(i));
  }

  void Solve() {
    x_ = prior_.mean;
    converged_ = false;
    for (int round = 0; round < kMostRounds && !converged_; ++round) {
      // The gains' columns need an estimate of the arm's torque, so the first round leaves them out.
      std::vector<int> active = prior_.active;
      if (round == 0) std::erase_if(active, [&](int c) { return c >= columns_ && c < load(0); });
      const VectorXd next = Step(active);
      converged_ = round > 1 && LargestChange(next) < 1e-3;
      x_ = next;
      for (int j = 0; j < n_; ++j)
        if (rows_[j] > 0) sigma_[j] = std::max(1e-12, std::sqrt(Square(j, Residual(j)) / rows_[j]));
      // The load's mass is known after the first round. It says where the load may be.
      for (int i = 1; i < kLoadParameters; ++i) prior_.covariance(load(i), load(i)) = LoadVariance(i, x_[load(0)]);
    }
    Inflate();
    Step(prior_.active);  // again, for a covariance that counts residuals which are not white
  }

 private:
  // raw[j]: [N x columns + load + 1], the last column measured torque.
  template <class Visit>
  void ForEachLog(const Visit& visit) const {
    for (const bool carrying : {false, true})
      for (const Dataset* log : carrying ? logs_.with : logs_.without) {
        std::vector<MatrixXd> raw, body;
        model_.Regressor(log->s, {prior_.mean.data(), static_cast<std::size_t>(columns_)}, eta_, raw);
        if (carrying) model_.BodyColumns(log->s, n_ - 1, body);
        for (int j = 0; j < n_; ++j) {
          raw[j].conservativeResize(Eigen::NoChange, columns_ + kLoadParameters + 1);
          if (carrying) raw[j].middleCols(columns_, kLoadParameters) = body[j] * to_link_;
          else raw[j].middleCols(columns_, kLoadParameters).setZero();
          raw[j].rightCols(1) = log->tau.col(j);
        }
        visit(*log, raw);
      }
  }
  void Widen(int coordinate, int column) {
    double size = 0;
    for (const MatrixXd& s : sum_)
      if (s(column, column) > 0)
        size = std::max(size, s(columns_ + kLoadParameters, columns_ + kLoadParameters) / s(column, column));
    prior_.covariance(coordinate, coordinate) = kWideTorque * kWideTorque * size;
  }
  // (1 + kappa_j) (p, load) as weights of joint j's columns.
  VectorXd Weights(int j) const {
    VectorXd w(columns_ + kLoadParameters);
    w << x_.head(columns_), x_.tail(kLoadParameters);
    return (1 + x_[gain(j)]) * w;
  }
  VectorXd Residual(int j) const {
    VectorXd r(columns_ + kLoadParameters + 1);
    r << -Weights(j), 1;
    return r;
  }
  double Square(int j, const VectorXd& r) const { return std::max(0.0, r.dot(sum_[j] * r)); }

  // One step of Gauss and Newton's: every sum it needs is one of raw columns.
  VectorXd Step(const std::vector<int>& active) {
    const int size = static_cast<int>(x_.size()), raw = columns_ + kLoadParameters + 1;
    Information info(n_, size);
    for (int j = 0; j < n_; ++j) {
      const double scale = 1 + x_[gain(j)];
      MatrixXd D = MatrixXd::Zero(raw, size);  // derivatives as sums of raw columns
      D.topLeftCorner(columns_, columns_).diagonal().setConstant(scale);
      D.block(columns_, load(0), kLoadParameters, kLoadParameters).diagonal().setConstant(scale);
      D.col(gain(j)).head(raw - 1) = Weights(j) / scale;
      VectorXd target = VectorXd::Zero(raw);  // measured - predicted + D x
      target << x_[gain(j)] / scale * Weights(j), 1;
      info.gram[j] = D.transpose() * sum_[j] * D;
      info.right[j] = D.transpose() * (sum_[j] * target);
    }
    const VectorXd weight = (sigma_.cwiseAbs2().cwiseProduct(inflation_)).cwiseInverse();
    return SolveWithPrior(info, weight, prior_, active, &covariance_);
  }
  double LargestChange(const VectorXd& next) const {
    double change = 0;
    for (const int c : prior_.active)
      if (sd(c) > 0) change = std::max(change, std::abs(next[c] - x_[c]) / sd(c));
    return change;
  }
  void Inflate() {
    VectorXd sum = VectorXd::Zero(n_);
    ForEachLog([&](const Dataset& log, const std::vector<MatrixXd>& raw) {
      for (int j = 0; j < n_; ++j) sum[j] += VarianceInflation(raw[j] * Residual(j), log.used.col(j));
    });
    inflation_ = sum / static_cast<double>(logs_.without.size() + logs_.with.size());
  }

  const codegen::Model& model_;
  const LoadLogs& logs_;
  int n_, columns_;
  Prior prior_;
  MatrixXd to_link_;
  std::vector<double> eta_;
  std::vector<MatrixXd> sum_;  // [joint] raw' raw over used rows
  Eigen::VectorXi rows_;
  VectorXd sigma_, inflation_, x_;
  MatrixXd covariance_;
  bool converged_ = false;
};

void RequireLoad(const LoadFit& fit, const LoadLogs& logs) {
  const double mass = fit.value(fit.load(0)), sd = fit.sd(fit.load(0));
  const std::string& name = logs.with.front()->source;
  if (!std::isfinite(mass)) throw io::InputError(name + ": no load fits these logs");
  if (mass < -kMassSeen * sd)
    throw io::InputError(
        fmt::format("{}: the load's mass comes out as {:.3g} +- {:.2g} kg: are the logs with and "
                    "without it exchanged?",
                    name, mass, sd));
  if (mass < kMassSeen * sd)
    throw io::InputError(
        fmt::format("{}: no load is seen (mass {:.3g} +- {:.2g} kg), expected a run with a payload at "
                    "the flange",
                    name, mass, sd));
}

LoadFit Unknown(const codegen::Model& model, const LoadLogs& logs) {
  LoadFit fit(model, logs);
  if (!model.robot().has_prior) fit.ForgetArm(false);
  fit.Solve();
  RequireLoad(fit, logs);
  return fit;
}

}  // namespace

// Bonferroni: what a Gaussian passes to either side with 5 % / 4 and with 5 % / 6.
double Load::HalfWidth95(int i) const { return (i < 4 ? 2.4977 : 2.6383) * sd[i]; }

double LoadVariance(int i, double mass_kg) { return std::pow(mass_kg * (i < 4 ? kReach_m : kReach_m * kReach_m), 2); }

std::vector<DriveGain> FindDriveGains(const codegen::Model& model, const LoadLogs& logs,
                                      const codegen::Payload& known) {
  Unknown(model, logs);  // a load must be seen before its mass can be a scale
  LoadFit fit(model, logs);
  fit.ForgetArm(true);
  fit.KnowLoad(known);
  fit.Solve();
  if (!fit.converged()) throw io::InputError(logs.with.front()->source + ": no gains fit these logs and this payload");
  std::vector<DriveGain> out;
  for (int j = 0; j < model.joints(); ++j) {
    const double scale = 1 + fit.value(fit.gain(j));
    const double stated = model.robot().joint[j].motor.torque_constant_tolerance;
    DriveGain g{1 / scale, fit.sd(fit.gain(j)) / (scale * scale), false};
    g.determined = g.sd < kFromPrior * (stated > 0 ? stated : kTolerance) / std::sqrt(3) * std::abs(g.value);
    if (g.determined && g.value < 0)
      throw io::InputError(fmt::format("{}: joint {}: its gain comes out as {:.3g}, expected the sign of q in tau",
                                       logs.with.front()->source, j + 1, g.value));
    out.push_back(g);
  }
  return out;
}

Load FindLoad(const codegen::Model& model, const LoadLogs& logs) {
  const LoadFit fit = Unknown(model, logs);
  const VectorXd estimate = fit.LoadValue();
  const MatrixXd covariance = fit.LoadCovariance();
  Load load;
  load.was_physical = Eigen::LLT<Eigen::Matrix4d>(PseudoInertia(estimate.data())).info() == Eigen::Success;
  const VectorXd body = NearestBody(estimate, covariance.inverse());
  load.body = ToCentre(body);
  const MatrixXd to_centre = OriginJacobian(load.body).inverse();
  load.sd = (to_centre * covariance * to_centre.transpose()).diagonal().cwiseSqrt();
  for (int i = 0; i < kLoadParameters; ++i)
    load.determined.push_back(fit.sd(fit.load(i)) < kFromPrior * fit.prior_sd(fit.load(i)));
  return load;
}

}  // namespace armcal::calibration

// verdict - projects the torques of known terms off the declared model's rows.
#include "host_sim/diagnose/verdict/common_rows.hpp"

#include <algorithm>

#include "host_sim/diagnose/verdict/json.hpp"
#include "host_sim/identify/calibration/channel.hpp"
#include "host_sim/identify/calibration/weighted_fit.hpp"

namespace armcal::verdict {

using calibration::Dataset;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
constexpr int kRowsOfARun = 4000;  // enough for a form; memory stays below 100 MB for a dozen runs
}  // namespace

CommonRows::CommonRows(const codegen::Model& model, const std::vector<Dataset>& runs)
    : CommonRows(model, runs, calibration::WeightedFit(model, calibration::Pointers(runs))) {}

CommonRows::CommonRows(const codegen::Model& model, const std::vector<Dataset>& runs, calibration::Fit declared)
    : model_(model), runs_(runs), declared_(std::move(declared)) {
  const int n = model.joints(), columns = model.columns();
  row_.resize(n);
  for (int j = 0; j < n; ++j)
    for (std::size_t r = 0; r < runs.size(); ++r)
      for (int k = 0, step = std::max(1, runs[r].samples() / kRowsOfARun); k < runs[r].samples(); k += step)
        if (runs[r].used(k, j)) row_[j].emplace_back(r, k);
  for (int j = 0; j < n; ++j)
    design_.emplace_back(static_cast<Index>(row_[j].size()), static_cast<Index>(declared_.active.size()));
  calibration::Information information(n, columns + n);
  std::vector<Index> filled(n, 0);
  for (std::size_t r = 0; r < runs.size(); ++r) {
    const std::vector<MatrixXd> rows = DeclaredRows(runs[r]);
    for (int j = 0; j < n; ++j)
      for (; filled[j] < static_cast<Index>(row_[j].size()) && row_[j][filled[j]].first == static_cast<int>(r);
           ++filled[j])
        design_[j].row(filled[j]) = rows[j].row(row_[j][filled[j]].second);
  }
  VectorXd weight = VectorXd::Ones(n);
  for (int j = 0; j < n; ++j) {
    design_[j] /= declared_.sigma[j];
    information.gram[j](declared_.active, declared_.active) = design_[j].transpose() * design_[j];
  }
  MatrixXd covariance;
  calibration::SolveWithPrior(information, weight, calibration::MakePrior(model), declared_.active, &covariance);
  inverse_ = covariance(declared_.active, declared_.active);
}

// [n] N x active: torque of each joint per unit of the declared model's active coordinates.
std::vector<MatrixXd> CommonRows::DeclaredRows(const Dataset& run) const {
  const int columns = model_.columns();
  std::vector<MatrixXd> regressor, out;
  model_.Regressor(run.s, {declared_.x.data(), static_cast<std::size_t>(columns)}, declared_.eta, regressor);
  calibration::PassThroughChannel(run, regressor);
  for (int j = 0; j < model_.joints(); ++j) {
    out.push_back(MatrixXd::Zero(run.samples(), static_cast<Index>(declared_.active.size())));
    for (Index a = 0; a < out[j].cols(); ++a) {
      const int c = declared_.active[static_cast<std::size_t>(a)];
      if (c < columns) out[j].col(a) = regressor[j].col(c);
      else if (c == columns + j) out[j].col(a) = regressor[j] * declared_.x.head(columns);
    }
  }
  return out;
}

Index CommonRows::AllRows() const {
  Index sum = 0;
  for (const auto& own : row_) sum += static_cast<Index>(own.size());
  return sum;
}

// torque: rows of all joints, one below the other, a column each; over the joints' noise.
MatrixXd CommonRows::TakenUp(const MatrixXd& torque) const {
  MatrixXd right = MatrixXd::Zero(inverse_.rows(), torque.cols());
  Index at = 0;
  for (const MatrixXd& d : design_) right += d.transpose() * torque.middleRows(at, d.rows()), at += d.rows();
  return inverse_ * right;
}

MatrixXd CommonRows::Left(MatrixXd torque) const {
  const MatrixXd taken_up = TakenUp(torque);
  Index at = 0;
  for (const MatrixXd& d : design_) torque.middleRows(at, d.rows()) -= d * taken_up, at += d.rows();
  return torque;
}

std::vector<MatrixXd> CommonRows::Beyond(const std::vector<MatrixXd>& torques) const {
  MatrixXd seen(AllRows(), static_cast<Index>(torques.size()));
  for (std::size_t t = 0; t < torques.size(); ++t) {
    Index at = 0;
    for (int j = 0; j < model_.joints(); ++j)
      for (const auto& [r, k] : row_[j]) seen(at++, static_cast<Index>(t)) = torques[t](k, j) / declared_.sigma[j];
  }
  const MatrixXd taken_up = TakenUp(seen);
  const std::vector<MatrixXd> declared = DeclaredRows(runs_[0]);
  std::vector<MatrixXd> left = torques;
  for (std::size_t t = 0; t < torques.size(); ++t)
    for (int j = 0; j < model_.joints(); ++j)
      if (auto own = left[t].col(j); !own.isZero(0)) own -= declared[j] * taken_up.col(static_cast<Index>(t));
  return left;
}

Trace CommonRows::Of(const diagnosis::KnownTerm& term, const MatrixXd& covariance) const {
  MatrixXd torque(AllRows(), 1 + static_cast<Index>(term.eta.size()) + term.amplitude.size());
  std::vector<diagnosis::TermTorques> of_run;
  for (const Dataset& run : runs_) of_run.push_back(diagnosis::TorquesOf(term, model_, declared_, run));
  Index at = 0;
  for (int j = 0; j < model_.joints(); ++j)
    for (const auto& [r, k] : row_[j]) {
      const diagnosis::TermTorques& own = of_run[static_cast<std::size_t>(r)];
      torque(at, 0) = own.torque(k, j) / declared_.sigma[j];
      for (std::size_t p = 0; p < own.slope.size(); ++p)
        torque(at, static_cast<Index>(p) + 1) = own.slope[p](k, j) / declared_.sigma[j];
      ++at;
    }
  const MatrixXd left = Left(std::move(torque));
  const auto slope = left.rightCols(left.cols() - 1);
  Trace out{left.col(0), std::sqrt(std::max(0.0, (slope.transpose() * slope).cwiseProduct(covariance).sum())),
            VectorXd::Zero(model_.joints())};
  at = 0;
  for (int j = 0; j < model_.joints(); ++j) {
    const auto own = static_cast<Index>(row_[j].size());
    if (own > 0)
      out.rms_Nm[j] =
          declared_.sigma[j] * std::sqrt(out.left.segment(at, own).squaredNorm() / static_cast<double>(own));
    at += own;
  }
  return out;
}

Traces TracesOf(const Verdicts& splits, const CommonRows& rows, const codegen::Catalogue& catalogue) {
  Traces out;
  for (const auto& [held_out, verdict] : splits) {
    const nlohmann::ordered_json terms = verdict.value("terms", nlohmann::ordered_json::array());
    for (std::size_t k = 0; k < terms.size(); ++k) {
      if (terms[k]["class"] == "run_state" || terms[k]["training_only"] || !terms[k]["confirmed"]) continue;
      Eigen::MatrixXd covariance;
      const diagnosis::KnownTerm term = ReadKnownTerm(terms[k], catalogue, covariance);
      out.emplace(std::pair(held_out, k), rows.Of(term, covariance));
    }
  }
  return out;
}

Distance Compare(const Trace& a, const Trace& b) {
  const double longer = std::max({a.left.norm(), b.left.norm(), 1e-300});
  return {(a.left - b.left).norm() / longer, std::hypot(a.uncertainty, b.uncertainty) / longer};
}

}  // namespace armcal::verdict

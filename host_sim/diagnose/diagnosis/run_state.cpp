// diagnosis - a scalar Kalman filter along the shape that training found.
#include "host_sim/diagnose/diagnosis/run_state.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
// Of the walk that would have a drift's changes: its path is smoother than a walk's. Over exponentials of 2 to 20 s, up
// to 25 noises high, a tenth left the least on another run.
constexpr double kSmooth = 0.1;
}  // namespace

RunState MakeRunState(const Candidate& candidate, const std::vector<double>& eta, const VectorXd& amplitude,
                      double train_s) {
  RunState out{&candidate, eta, amplitude, 0, 1, 0};
  if (candidate.record().search.how == codegen::SearchWay::kOnset) {  // there or not: one step up, perhaps one down
    out.time_s = 0.5 * (eta[0] + eta[1]);
    out.variance_ps = 1 / train_s;
    return out;
  }
  // A spline over time: its coefficients are the level's path from zero on. At the end the splines but the first sum up
  // to one.
  const VectorXd& path = amplitude;
  double changes = path[0] * path[0];
  for (int k = 1; k < path.size(); ++k) changes += (path[k] - path[k - 1]) * (path[k] - path[k - 1]);
  out.time_s = eta[1];
  out.level_sd = path.cwiseAbs().maxCoeff();
  out.variance_ps = kSmooth * changes / train_s;
  out.amplitude = VectorXd::Ones(path.size());
  return out;
}

MatrixXd Track(const RunState& state, const Quantities& q, const MatrixXd& residual, const VectorXd& sigma) {
  std::vector<std::vector<VectorXd>> value;
  state.candidate->Evaluate(q, state.eta, value, state.time_s);
  const auto& rows = state.candidate->rows();
  MatrixXd shape = MatrixXd::Zero(residual.rows(), residual.cols());
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (int c = 0; c < state.candidate->columns(state.eta); ++c)
      if (value[c][r].size()) shape.col(rows[r]) += state.amplitude[c] * value[c][r];
  MatrixXd predicted = MatrixXd::Zero(residual.rows(), residual.cols());
  double level = 0, variance = state.level_sd * state.level_sd;
  for (Eigen::Index k = 0; k < residual.rows(); ++k) {
    if (k > 0) variance += state.variance_ps * q.dt[k];
    predicted.row(k) = level * shape.row(k);
    for (const int j : rows) {
      const double h = shape(k, j);
      if (!q.data->used(k, j) || h == 0) continue;
      const double gain = variance * h / (variance * h * h + sigma[j] * sigma[j]);
      level += gain * (residual(k, j) - h * level);
      variance *= 1 - gain * h;
    }
  }
  return predicted;
}

}  // namespace armcal::diagnosis

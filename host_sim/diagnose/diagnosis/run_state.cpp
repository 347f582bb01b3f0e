// diagnosis - judges whether a torque over time can be a state of the run, and follows such a state on another run.
#include "host_sim/diagnose/diagnosis/run_state.hpp"

#include <algorithm>
#include <cmath>

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
// Of the walk that would have a drift's changes: its path is smoother than a walk's. Over exponentials of 2 to 20 s, up
// to 25 noises high, a tenth left the least on another run.
constexpr double kSmooth = 0.1;
constexpr double kTurnsBack = 0.2;  // of what a state of a run spans: less is no turn
constexpr double kHardly = 0.25;    // of its level
constexpr double kAsFar = 0.5;      // of what it spans in training

// Its value at the knots, from cubic B-splines without the first one.
VectorXd AtKnots(const VectorXd& amplitude) {
  VectorXd spline(amplitude.size() + 1);
  spline << 0, amplitude;
  const Eigen::Index knots = spline.size() - 2;
  return (spline.head(knots) + 4 * spline.segment(1, knots) + spline.tail(knots)) / 6;
}

double Span(const VectorXd& value) { return value.maxCoeff() - value.minCoeff(); }

int Turns(const VectorXd& value) {
  int turns = 0, way = 0;
  for (double furthest = value[0]; const double now : value) {
    const double step = now - furthest;
    if (way * step <= 0 && std::abs(step) < kTurnsBack * Span(value)) continue;
    const int next = step > 0 ? 1 : -1;
    turns += way != 0 && next != way;
    way = next, furthest = now;
  }
  return turns;
}

// The candidate's torque at a time of the run, [N x n], whatever the samples' own times.
MatrixXd TorqueAt(double time_s, const Candidate& c, const Quantities& q, const std::vector<double>& eta,
                  const VectorXd& amplitude) {
  std::vector<std::vector<VectorXd>> value;
  c.Evaluate(q, eta, value, time_s);
  MatrixXd torque = MatrixXd::Zero(q.data->samples(), q.data->joints());
  for (std::size_t r = 0; r < c.rows().size(); ++r)
    for (int column = 0; column < c.columns(eta); ++column)
      if (value[column][r].size()) torque.col(c.rows()[r]) += amplitude[column] * value[column][r];
  return torque;
}

bool IsOverTime(const Candidate& c) {
  const codegen::EffectRecord& record = c.record();
  return record.effect_class == codegen::EffectClass::kRunState && record.search.how == codegen::SearchWay::kSpline;
}
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
  const auto& rows = state.candidate->rows();
  const MatrixXd shape = TorqueAt(state.time_s, *state.candidate, q, state.eta, state.amplitude);
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

std::string WhyNoState(const Candidate& c, const VectorXd& amplitude) {
  if (!IsOverTime(c)) return "";
  const VectorXd value = AtKnots(amplitude);
  if (Turns(value) > 1) return "over time it goes to and fro, which a state of a run does not";
  return Span(value) < kHardly * value.cwiseAbs().maxCoeff() ? "it does not change during the run" : "";
}

bool GoesToAndFroOn(const Candidate& c, const VectorXd& amplitude, const Quantities& q, const MatrixXd& residual) {
  if (!IsOverTime(c)) return false;
  const auto& t = q.data->s.t;
  const std::vector<double> over_all{t[0], t[t.size() - 1]};
  const auto columns = static_cast<Eigen::Index>(c.columns(over_all));
  // It may begin at any level: at the end of the run the splines but the first sum up to one.
  const MatrixXd level = TorqueAt(over_all[1], c, q, over_all, VectorXd::Ones(columns));
  std::vector<std::vector<VectorXd>> value;
  c.Evaluate(q, over_all, value);
  MatrixXd gram = MatrixXd::Zero(columns + 1, columns + 1);
  VectorXd right = VectorXd::Zero(columns + 1), row(columns + 1);
  for (std::size_t r = 0; r < c.rows().size(); ++r) {
    const int j = c.rows()[r];
    for (Eigen::Index k = 0; k < residual.rows(); ++k) {
      if (!q.data->used(k, j)) continue;
      for (Eigen::Index i = 0; i < columns; ++i) {
        const VectorXd& own = value[static_cast<std::size_t>(i)][r];
        row[i] = own.size() ? own[k] : 0;
      }
      row[columns] = level(k, j);
      gram += row * row.transpose(), right += residual(k, j) * row;
    }
  }
  gram.diagonal() *= 1 + 1e-9;
  const VectorXd path = gram.ldlt().solve(right).head(columns);
  return Span(AtKnots(path)) > kAsFar * Span(AtKnots(amplitude)) && Turns(AtKnots(path)) > 1;
}

}  // namespace armcal::diagnosis

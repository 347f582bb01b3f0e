// diagnosis - searches over the time of a run: one long window, or several short ones.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "host_sim/diagnose/diagnosis/searcher.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kMostWindows = 6;  // more are no isolated events
constexpr int kDurations = 6;    // tried, from the shortest on, each 1.6 times the one before
constexpr double kLonger = 1.6;
constexpr int kStepsPerWindow = 8;
constexpr double kOutlier = 4;  // times the noise: a few samples beyond are no event
constexpr double kFar = 1000;   // lengths of the log
constexpr double kSeen = 0.7;   // share of a window's samples that are used at least

struct Window {
  double gain = 0, on = 0, off = 0;
};

// One row of an event over all samples of the log, over the row's noise: what the base leaves, whether a sample counts,
// and what multiplies the shape, [samples x columns].
struct EventRow {
  VectorXd left, used;
  MatrixXd factor;
};

// Where one of the shapes fits best. tried: places looked at.
Window Strongest(const std::vector<VectorXd>& shapes, const std::vector<EventRow>& rows, const VectorXd& time,
                 double& tried) {
  const int samples = static_cast<int>(time.size());
  const Eigen::Index columns = rows[0].factor.cols();
  const double step_s = (time[samples - 1] - time[0]) / (samples - 1);
  Window best;
  tried = 0;
  for (const VectorXd& shape : shapes) {
    const int length = static_cast<int>(shape.size()), stride = std::max(1, length / kStepsPerWindow);
    for (int at = 0; at + length <= samples; at += stride, ++tried) {
      MatrixXd gram = MatrixXd::Zero(columns, columns);
      VectorXd right = VectorXd::Zero(columns);
      for (const EventRow& row : rows) {
        const auto used = row.used.segment(at, length);
        if (used.sum() < kSeen * length) continue;
        const MatrixXd column = shape.cwiseProduct(used).asDiagonal() * row.factor.middleRows(at, length);
        gram += column.transpose() * column;
        right += column.transpose() * row.left.segment(at, length);
      }
      gram.diagonal().array() += 1e-9 * gram.trace() + 1e-300;
      const double gain = right.dot(gram.ldlt().solve(right));
      if (gain > best.gain) best = {gain, time[at], time[at] + length * step_s};
    }
  }
  return best;
}

}  // namespace

// Windows [on, off] on a grid of the log's time, not shorter than the record's minimum; then refined.
void Searcher::Onset() {
  const auto& t = e_.logs[0].data->s.t;
  const double begin = t[0], end = t[t.size() - 1], minimum = c_.record().search.minimum_s;
  if (e_.logs.size() != 1 || end - begin < 2 * minimum) return;  // times of several logs have no common origin
  for (auto& u : c_.unknowns()) u.lower = begin - 1, u.upper = end + 1;
  best_.searched = 2;
  best_.tried = 0.5 * kOnsetGrid * kOnsetGrid;
  // Each cell of time once; a window is the sum of its cells.
  std::vector<double> edge{begin - 1};
  for (int k = 1; k < kOnsetGrid; ++k) edge.push_back(begin + (end - begin) * k / kOnsetGrid);
  edge.push_back(end + 1);
  std::vector<Projection> cell;
  for (int k = 0; k < kOnsetGrid; ++k) cell.push_back(metric().Project(Gather({edge[k], edge[k + 1]})));
  double most = 0;
  std::vector<double> window;
  for (int i = 0; i < kOnsetGrid; ++i) {
    Projection sum = cell[i];
    for (int k = i; k < kOnsetGrid; ++k) {
      if (k > i) sum += cell[k];
      if (edge[k + 1] - edge[i] < minimum || k - i + 1 == kOnsetGrid) continue;  // on all the time is no step
      const double value = Value(sum).gain;
      if (value > most) most = value, window = {edge[i], edge[k + 1]};
    }
  }
  if (most > 0) Consider(window);
  if (Promising()) RefineBest(0.5 / kOnsetGrid, kOnsetHalvings);
  if (best_.eta[1] - best_.eta[0] < minimum) best_.gain = Gain{};
}

// Isolated windows one after the other, each where a half sine, the shape of these records, fits best what the ones
// before have left. Where the sign of friction changes, an error of the derived speed looks like an event.
void Searcher::Windows() {
  if (e_.logs.size() != 1) return;
  const auto& time = e_.logs[0].data->s.t;
  const int samples = static_cast<int>(time.size());
  const double begin = time[0], end = time[samples - 1], step_s = (end - begin) / (samples - 1);
  for (auto& u : c_.unknowns()) u.lower = begin - 1, u.upper = end + 1;
  const auto& joints = c_.rows();
  // In the middle of a window without end the shape is one.
  std::vector<std::vector<VectorXd>> value;
  const double far_s = kFar * (end - begin);
  c_.Evaluate(e_.logs[0], {begin - far_s, end + far_s}, value);
  std::vector<EventRow> rows(joints.size());
  for (std::size_t r = 0; r < rows.size(); ++r) {
    rows[r].factor = MatrixXd::Zero(samples, static_cast<Eigen::Index>(value.size()));
    for (std::size_t c = 0; c < value.size(); ++c)
      if (value[c][r].size())
        rows[r].factor.col(static_cast<Eigen::Index>(c)) = value[c][r] / g_.metric.noise()[joints[r]].innovation;
  }
  std::vector<VectorXd> shapes;
  for (int d = 0; d < kDurations; ++d) {
    const double span = c_.record().search.minimum_s * std::pow(kLonger, d);
    const int length = std::min(static_cast<int>(span / step_s), samples / 4);
    shapes.push_back(Eigen::ArrayXd::LinSpaced(length, 0, std::numbers::pi).sin());
  }
  std::vector<double> found;
  for (int windows = 1; windows <= kMostWindows; ++windows) {
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const int j = joints[r];
      const RowIndex& index = e_.index[j];
      const VectorXd& steady = e_.steady[j];
      const VectorXd residual =
          (found.empty() ? g_.metric.RawResidual(j) : g_.metric.ResidualWith(GatherColumns(c_, e_, found), j)) /
          g_.metric.noise()[j].innovation;
      rows[r].left = rows[r].used = VectorXd::Zero(samples);
      for (int i = 0; i < index.size(); ++i)
        if (steady[i] > 0)
          rows[r].left[index.sample[i]] = std::clamp(residual[i], -kOutlier, kOutlier),
          rows[r].used[index.sample[i]] = 1;
    }
    double tried = 0;
    const Window best = Strongest(shapes, rows, time, tried);
    // A window pays for its own place and amplitudes. All windows together pay the record's own penalty.
    Found one = best_;
    one.gain.rank = static_cast<int>(value.size()), one.searched = 2, one.tried = tried;
    one.penalty = PenaltyOf(one.gain.rank + one.searched, c_, e_);
    if (best.gain < GainOfScore(one) - c_.record().generic_penalty) break;
    best_.searched = 2 * windows;
    best_.tried = std::pow(tried, windows);
    const auto with = [&](const std::vector<double>& last) {
      if (last[1] - last[0] < c_.record().search.minimum_s) return 0.0;
      std::vector<double> all = found;
      all.insert(all.end(), last.begin(), last.end());
      return Consider(all);
    };
    const double width = (best.off - best.on) / (end - begin + 2);
    const std::vector<double> last = Refine({best.on, best.off}, 0.25 * width, 3, with);
    found.insert(found.end(), last.begin(), last.end());
  }
}

}  // namespace armcal::diagnosis

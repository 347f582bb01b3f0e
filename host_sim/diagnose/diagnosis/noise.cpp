// diagnosis - fits the noise model by Burg's method, and whitens the stretches of a log that have no gap.
#include "host_sim/diagnose/diagnosis/noise.hpp"

#include <algorithm>
#include <cmath>

#include "codegen/src/generator/vector_units.hpp"
#include "codegen/src/io/watch.hpp"

namespace armcal::diagnosis {

using Eigen::VectorXd;

namespace {

constexpr int kPairsOfALag = 20;    // for each coefficient before it
constexpr double kSurest = 0.9995;  // of a reflection: nothing is foreseen entirely

// First row of each stretch without gaps, and the row after its last one.
std::vector<std::pair<int, int>> Stretches(const RowIndex& rows) {
  std::vector<std::pair<int, int>> out;
  for (int begin = 0, end = 0; begin < rows.size(); begin = end) {
    end = begin + 1;
    while (end < rows.size() && !rows.segment_begin[end]) ++end;
    out.emplace_back(begin, end);
  }
  return out;
}

// A stretch without gaps.
ARMCAL_VECTOR_UNITS("avx2")
void WhitenStretch(const NoiseModel& noise, const double* v, int count, double* out) {
  const double* const a = noise.a.data();
  const int order = noise.order(), first = std::min(order, count);
  for (int k = 0; k < first; ++k) {
    const auto p = static_cast<std::size_t>(k);
    double sum = v[k];
    for (int i = 0; i < k; ++i) sum -= noise.start[p][i] * v[k - 1 - i];
    out[k] = sum / (noise.innovation * noise.start_sd[p]);
  }
  int k = first;
  for (; k + codegen::kLanes <= count; k += codegen::kLanes) {
    codegen::Lanes sum = codegen::LanesAt(v + k);
    for (int i = 0; i < order; ++i) sum -= a[i] * codegen::LanesAt(v + k - 1 - i);
    *reinterpret_cast<codegen::Lanes*>(out + k) = sum / noise.innovation;
  }
  for (; k < count; ++k) {
    double sum = v[k];
    for (int i = 0; i < order; ++i) sum -= a[i] * v[k - 1 - i];
    out[k] = sum / noise.innovation;
  }
}

}  // namespace

bool RowIndex::averaged() const {
  return std::any_of(average.begin(), average.end(), [](const Average* a) { return a != nullptr; });
}

std::pair<int, int> RowIndex::RowsOf(int log) const {
  const auto [first, last] = std::equal_range(dataset.begin(), dataset.end(), log);
  return {static_cast<int>(first - dataset.begin()), static_cast<int>(last - dataset.begin())};
}

void RowIndex::Take(int log, const Eigen::Ref<const VectorXd>& column, Eigen::Ref<VectorXd> rows) const {
  const auto [first, last] = RowsOf(log);
  const Average* const own =
      static_cast<std::size_t>(log) < average.size() ? average[static_cast<std::size_t>(log)] : nullptr;
  if (own) rows.segment(first, last - first) = *own * column;
  else
    for (int k = first; k < last; ++k) rows[k] = column[sample[static_cast<std::size_t>(k)]];
  if (weight.size()) rows.segment(first, last - first).array() *= weight.segment(first, last - first).array();
}

double Median(std::vector<double> x) {
  if (x.empty()) return 0;
  const auto middle = x.begin() + static_cast<std::ptrdiff_t>(x.size() / 2);
  std::nth_element(x.begin(), middle, x.end());
  return *middle;
}

double UsualDeviation(const VectorXd& e) {
  const VectorXd size = e.cwiseAbs();
  return 1.4826 * Median({size.begin(), size.end()});
}

bool IsWhite(const NoiseModel& noise) { return noise.order() == 0; }

double SlowNoise(const NoiseModel& noise) { return noise.innovation / (1 - noise.a.sum()); }

NoiseModel FitNoise(const RowIndex& rows, const VectorXd& e) {
  NoiseModel noise;
  if (rows.size() == 0) return noise;
  const double count = rows.size();
  std::vector<double> power{std::max(e.squaredNorm() / count, 1e-48)};  // what each order leaves
  noise.innovation = std::sqrt(std::max(power[0], 1e-24));
  const std::vector<std::pair<int, int>> stretches = Stretches(rows);
  VectorXd ahead = e, back = e, past;  // what is left of a row by the rows before it, and by those after it
  std::vector<VectorXd> predictor{VectorXd()};
  double least = count * std::log(power[0]);
  int order = 0;
  for (int m = 0; m < kMostOrder && power.back() > 1e-48; ++m) {
    io::CancellationPoint();
    double product = 0, squares = 0;
    int pairs = 0;
    for (const auto& [begin, end] : stretches) {
      const int size = end - begin - m - 1;
      if (size <= 0) continue;
      const auto later = ahead.segment(begin + m + 1, size), earlier = back.segment(begin + m, size);
      product += later.dot(earlier), squares += later.squaredNorm() + earlier.squaredNorm();
      pairs += size;
    }
    if (pairs < kPairsOfALag * (m + 1) || squares <= 0) break;  // too few pairs tell nothing of a lag
    const double reflection = std::clamp(2 * product / squares, -kSurest, kSurest);
    for (const auto& [begin, end] : stretches) {
      const int size = end - begin - m - 1;
      if (size <= 0) continue;
      auto later = ahead.segment(begin + m + 1, size);
      past = back.segment(begin + m, size);
      back.segment(begin + m + 1, size) = past - reflection * later;
      later -= reflection * past;
    }
    const VectorXd& shorter = predictor.back();
    VectorXd next(m + 1);
    for (int i = 0; i < m; ++i) next[i] = shorter[i] - reflection * shorter[m - 1 - i];
    next[m] = reflection;
    power.push_back(power.back() * (1 - reflection * reflection));
    predictor.push_back(std::move(next));
    const double deviance = count * std::log(power.back()) + (m + 1) * std::log(count);
    if (deviance < least) least = deviance, order = m + 1;
  }
  if (order == 0) return noise;
  noise.a = predictor[static_cast<std::size_t>(order)];
  for (int p = 0; p < order; ++p) noise.start_sd.push_back(std::sqrt(power[p] / power[order]));
  predictor.resize(static_cast<std::size_t>(order));
  noise.start = std::move(predictor);
  // What the coefficients really leave. The recursion's own figure leaves out the first rows of each stretch: an effect
  // still inside would then look like less noise than there is.
  noise.innovation = 1;
  noise.innovation = std::sqrt(std::max(Whiten(noise, rows, e).squaredNorm() / rows.size(), 1e-24));
  return noise;
}

double Deviance(const NoiseModel& noise, const RowIndex& rows) {
  double sum = 2 * rows.size() * std::log(noise.innovation) + noise.order() * std::log(std::max(2, rows.size()));
  if (IsWhite(noise)) return sum;
  for (const auto& [begin, end] : Stretches(rows))
    for (int place = 0; place < std::min(noise.order(), end - begin); ++place)
      sum += 2 * std::log(noise.start_sd[static_cast<std::size_t>(place)]);
  return sum;
}

VectorXd Whiten(const NoiseModel& noise, const RowIndex& rows, const Eigen::Ref<const VectorXd>& v) {
  if (IsWhite(noise)) return v / noise.innovation;
  VectorXd out(v.size());
  for (const auto& [begin, end] : Stretches(rows))
    WhitenStretch(noise, v.data() + begin, end - begin, out.data() + begin);
  return out;
}

Eigen::MatrixXd WhitenColumns(const NoiseModel& noise, const RowIndex& rows, const Eigen::MatrixXd& m) {
  if (IsWhite(noise)) return m * (1 / noise.innovation);
  Eigen::MatrixXd out(m.rows(), m.cols());
  for (const auto& [begin, end] : Stretches(rows))
    for (int c = 0; c < m.cols(); ++c)
      WhitenStretch(noise, m.col(c).data() + begin, end - begin, out.col(c).data() + begin);
  return out;
}

}  // namespace armcal::diagnosis

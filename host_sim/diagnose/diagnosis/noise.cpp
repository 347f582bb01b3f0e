// diagnosis - fits the noise model by Yule-Walker, and whitens the stretches of a log that have no gap.
#include "host_sim/diagnose/diagnosis/noise.hpp"

#include <algorithm>
#include <cmath>

#include "codegen/src/generator/vector_units.hpp"

namespace armcal::diagnosis {

using Eigen::VectorXd;

namespace {

// position of each row in its segment
std::vector<int> PlaceInSegment(const RowIndex& rows) {
  std::vector<int> place(rows.size());
  for (int k = 0; k < rows.size(); ++k) place[k] = rows.segment_begin[k] ? 0 : place[k - 1] + 1;
  return place;
}

// A stretch without gaps; leaves out[0 .. kArOrder) as it is.
ARMCAL_VECTOR_UNITS("avx2")
void WhitenStretch(const NoiseModel& noise, const double* v, int count, double* out) {
  const double* const a = noise.a.data();
  int k = kArOrder;
  for (; k + codegen::kLanes <= count; k += codegen::kLanes) {
    codegen::Lanes sum = codegen::LanesAt(v + k);
#pragma GCC unroll 8
    for (int i = 0; i < kArOrder; ++i) sum -= a[i] * codegen::LanesAt(v + k - 1 - i);
    *reinterpret_cast<codegen::Lanes*>(out + k) = sum / noise.innovation;
  }
  for (; k < count; ++k) {
    double sum = v[k];
    for (int i = 0; i < kArOrder; ++i) sum -= a[i] * v[k - 1 - i];
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

bool IsWhite(const NoiseModel& noise) { return noise.a.squaredNorm() == 0; }

NoiseModel FitNoise(const RowIndex& rows, const VectorXd& e) {
  NoiseModel noise;
  const std::vector<int> place = PlaceInSegment(rows);
  VectorXd r = VectorXd::Zero(kArOrder + 1);
  Eigen::VectorXi count = Eigen::VectorXi::Zero(kArOrder + 1);
  for (int k = 0; k < rows.size(); ++k)
    for (int lag = 0; lag <= std::min(kArOrder, place[k]); ++lag) r[lag] += e[k] * e[k - lag], ++count[lag];
  if (count[0] == 0) return noise;
  const double variance = r[0] / count[0];
  noise.innovation = std::sqrt(std::max(variance, 1e-24));
  if (count[kArOrder] < 20 * kArOrder) return noise;  // too few pairs to learn a colour from
  for (int lag = 0; lag <= kArOrder; ++lag) r[lag] = r[lag] / count[lag];
  VectorXd a = VectorXd::Zero(kArOrder);  // Levinson-Durbin: stays stable where a plain solve may not
  double power = r[0];
  for (int m = 0; m < kArOrder; ++m) {
    double reflection = r[m + 1];
    for (int i = 0; i < m; ++i) reflection -= a[i] * r[m - i];
    reflection = std::clamp(reflection / power, -0.98, 0.98);
    const VectorXd before = a;
    a[m] = reflection;
    for (int i = 0; i < m; ++i) a[i] = before[i] - reflection * before[m - 1 - i];
    power *= 1 - reflection * reflection;
  }
  noise.a = a;
  // What the coefficients really leave. The recursion's own figure is too small where a slow residual is broken into
  // segments: an effect still inside would then look like less noise than there is.
  noise.innovation = 1;
  noise.innovation = std::sqrt(std::max(Whiten(noise, rows, e).squaredNorm() / WhitenedRows(noise, rows), 1e-24));
  return noise;
}

VectorXd Whiten(const NoiseModel& noise, const RowIndex& rows, const Eigen::Ref<const VectorXd>& v) {
  if (IsWhite(noise)) return v / noise.innovation;
  VectorXd out = VectorXd::Zero(v.size());
  for (int begin = 0, end = 0; begin < rows.size(); begin = end) {
    end = begin + 1;
    while (end < rows.size() && !rows.segment_begin[end]) ++end;
    WhitenStretch(noise, v.data() + begin, end - begin, out.data() + begin);
  }
  return out;
}

int WhitenedRows(const NoiseModel& noise, const RowIndex& rows) {
  if (IsWhite(noise)) return rows.size();
  int count = 0;
  for (const int place : PlaceInSegment(rows)) count += place >= kArOrder;
  return count;
}

}  // namespace armcal::diagnosis

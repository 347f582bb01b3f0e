// choice - assigns rows to stretches by the middle of what they average.
#include "host_sim/identify/choice/block_errors.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "codegen/src/io/input_error.hpp"

namespace armcal::choice {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kStretch_s = 2, kLeast_s = 0.5;
constexpr int kFewest = 10;
constexpr int kDraws = 1000;

}  // namespace

Stretches::Stretches(const calibration::Dataset& log) {
  const double length_s = log.s.t[log.samples() - 1] - log.s.t[0];
  if (length_s < kFewest * kLeast_s)
    throw io::InputError(log.source + ": too short to compare laws: " + std::to_string(length_s) + " s, expected " +
                         std::to_string(kFewest * kLeast_s) + " s");
  count = std::max(kFewest, static_cast<int>(length_s / kStretch_s));
  samples = (log.samples() + count - 1) / count;
}

int Stretches::Of(Index sample) const { return static_cast<int>(sample / samples); }

calibration::Dataset Without(const calibration::Dataset& log, int remainder, int folds) {
  const Stretches stretches(log);
  calibration::Dataset out = log;
  for (Index k = 0; k < log.used.rows(); ++k)
    if (stretches.Of(k) % folds == remainder) out.used.row(k).setZero();
  out.average.clear();
  return out;
}

MatrixXd SquaresByStretch(const calibration::Dataset& log, const MatrixXd& residual) {
  const Stretches stretches(log);
  MatrixXd out = MatrixXd::Zero(stretches.count, log.joints());
  for (int j = 0; j < log.joints(); ++j) {
    if (!log.averaged(j)) {
      for (Index k = 0; k < residual.rows(); ++k)
        if (log.used(k, j)) out(stretches.Of(k), j) += residual(k, j) * residual(k, j);
      continue;
    }
    using Average = Eigen::SparseMatrix<double, Eigen::RowMajor>;
    const Average& average = log.average[static_cast<std::size_t>(j)];
    for (Index row = 0; row < average.outerSize(); ++row) {
      double sum = 0, middle = 0, weight = 0;
      for (Average::InnerIterator e(average, row); e; ++e) {
        sum += e.value() * residual(e.col(), j);
        middle += e.value() * static_cast<double>(e.col()), weight += e.value();
      }
      if (weight > 0) out(stretches.Of(static_cast<Index>(middle / weight)), j) += sum * sum;
    }
  }
  return out;
}

Ratio Compare(const VectorXd& a, const VectorXd& b) {
  const auto ratio = [](double above, double below) { return std::sqrt(above / std::max(below, 1e-300)) - 1; };
  std::vector<Index> told;  // stretches in which the joint has rows
  for (Index k = 0; k < a.size(); ++k)
    if (a[k] > 0 || b[k] > 0) told.push_back(k);
  if (told.empty()) return {std::nan(""), std::nan(""), std::nan("")};
  std::mt19937_64 random(1);
  std::uniform_int_distribution<std::size_t> pick(0, told.size() - 1);
  std::vector<double> drawn;
  for (int draw = 0; draw < kDraws; ++draw) {
    double above = 0, below = 0;
    for (std::size_t k = 0; k < told.size(); ++k) {
      const Index at = told[pick(random)];
      above += a[at], below += b[at];
    }
    drawn.push_back(ratio(above, below));
  }
  std::sort(drawn.begin(), drawn.end());
  return {ratio(a.sum(), b.sum()), drawn[kDraws / 40], drawn[kDraws - 1 - kDraws / 40]};
}

}  // namespace armcal::choice

// calibration - Gram sums first, streaming QR where they would lose too much.
#include "host_sim/identify/calibration/batch_gram.hpp"

#include <cmath>

#include "host_sim/identify/calibration/information.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kBlockRows = 512;  // the triangle of some 60 columns is a small part of each reduction

Solved FactoriseRows(const codegen::Model& model, const std::vector<const Dataset*>& data, const VectorXd& weight,
                     const VectorXd& committed, std::span<const double> eta, const VectorXd& scale) {
  const int n = model.joints(), columns = model.columns();
  StreamingQr qr(scale, kBlockRows);
  VectorXd row(columns);
  for (const Dataset* d : data)
    model.ForEachBlock(d->s, {committed.data(), static_cast<std::size_t>(columns)}, eta,
                       [&](int begin, int count, std::span<const double* const> root) {
                         for (int j = 0; j < n; ++j)
                           for (int k = 0; k < count; ++k) {
                             if (!d->used(begin + k, j)) continue;
                             for (int c = 0; c < columns; ++c)
                               row[c] = root[static_cast<std::size_t>(j) * columns + c][k];
                             qr.AddRow(row, d->tau(begin + k, j), std::sqrt(weight[j]));
                           }
                       });
  return qr.Solve();
}

}  // namespace

Solved BatchLeastSquares(const codegen::Model& model, const std::vector<const Dataset*>& data, const VectorXd& weight,
                         const VectorXd& committed, std::span<const double> eta) {
  const int n = model.joints(), columns = model.columns();
  MatrixXd gram = MatrixXd::Zero(columns, columns);
  VectorXd right = VectorXd::Zero(columns);
  for (const Dataset* d : data) {
    const Information info = Accumulate(model, *d, committed.head(columns), eta);
    for (int j = 0; j < n; ++j) {
      gram += weight[j] * info.gram[j].topLeftCorner(columns, columns);
      right += weight[j] * info.right[j].head(columns);
    }
  }
  const Solved normal = SolveNormal(gram, right);
  if (normal.condition <= kNormalLimit) return normal;
  VectorXd scale = gram.diagonal().cwiseSqrt();
  for (double& s : scale) s = s > 0 ? 1 / s : 0;
  return FactoriseRows(model, data, weight, committed, eta, scale);
}

}  // namespace armcal::calibration

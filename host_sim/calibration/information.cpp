// calibration - blocks of samples through the model's graph into one Gram matrix a joint.
#include "host_sim/calibration/information.hpp"

#include <algorithm>

namespace armcal::calibration {
namespace {

constexpr int kBlock = 512;  // samples whose regressor is in memory at a time

codegen::Signals Slice(const codegen::Signals& s, int begin, int count) {
  codegen::Signals part;
  part.t = s.t.segment(begin, count);
  part.q = s.q.middleRows(begin, count);
  part.qd = s.qd.middleRows(begin, count);
  part.qdd = s.qdd.middleRows(begin, count);
  if (s.temp.size()) part.temp = s.temp.middleRows(begin, count);
  return part;
}

}  // namespace

Information::Information(int joints, int coordinates)
    : gram(joints, Eigen::MatrixXd::Zero(coordinates, coordinates)),
      right(joints, Eigen::VectorXd::Zero(coordinates)),
      square(Eigen::VectorXd::Zero(joints)),
      rows(Eigen::VectorXi::Zero(joints)) {}

Information& Information::operator+=(const Information& other) {
  for (std::size_t j = 0; j < gram.size(); ++j) gram[j] += other.gram[j], right[j] += other.right[j];
  square += other.square;
  rows += other.rows;
  return *this;
}

double Information::Residual(int j, const Eigen::VectorXd& x) const {
  return std::max(0.0, square[j] - 2 * right[j].dot(x) + x.dot(gram[j] * x));
}

Information Accumulate(const codegen::Model& model, const Dataset& data, const Eigen::VectorXd& p,
                       std::span<const double> eta) {
  const int n = model.joints(), columns = model.columns();
  Information info(n, columns + n);
  const std::span<const double> committed(p.data(), columns);
  std::vector<Eigen::MatrixXd> row;
  for (int begin = 0; begin < data.samples(); begin += kBlock) {
    const int count = std::min(kBlock, data.samples() - begin);
    model.Regressor(Slice(data.s, begin, count), committed, eta, row);
    for (int j = 0; j < n; ++j) {
      Eigen::MatrixXd A(count, columns + 1);
      Eigen::VectorXd y(count);
      int used = 0;
      for (int k = 0; k < count; ++k) {
        if (!data.used(begin + k, j)) continue;
        A.row(used).head(columns) = row[j].row(k);
        y[used++] = data.tau(begin + k, j);
      }
      if (used == 0) continue;
      A.col(columns).head(used) = A.topLeftCorner(used, columns) * p.head(columns);  // d tau / d kappa_j
      const auto a = A.topRows(used);
      const Eigen::MatrixXd gram = a.transpose() * a;
      const Eigen::VectorXd right = a.transpose() * y.head(used);
      info.gram[j].topLeftCorner(columns, columns) += gram.topLeftCorner(columns, columns);
      info.gram[j].col(columns + j).head(columns) += gram.col(columns).head(columns);
      info.gram[j].row(columns + j).head(columns) += gram.row(columns).head(columns);
      info.gram[j](columns + j, columns + j) += gram(columns, columns);
      info.right[j].head(columns) += right.head(columns);
      info.right[j][columns + j] += right[columns];
      info.square[j] += y.head(used).squaredNorm();
      info.rows[j] += used;
    }
  }
  return info;
}

Eigen::MatrixXd Predict(const codegen::Model& model, const Dataset& data, const Eigen::VectorXd& x,
                        std::span<const double> eta) {
  const int n = model.joints(), columns = model.columns();
  Eigen::MatrixXd tau(data.samples(), n);
  std::vector<Eigen::MatrixXd> row;
  for (int begin = 0; begin < data.samples(); begin += kBlock) {
    const int count = std::min(kBlock, data.samples() - begin);
    model.Regressor(Slice(data.s, begin, count), {x.data(), static_cast<std::size_t>(columns)}, eta, row);
    for (int j = 0; j < n; ++j) tau.col(j).segment(begin, count) = (1 + x[columns + j]) * (row[j] * x.head(columns));
  }
  return tau;
}

}  // namespace armcal::calibration

// filter - a small layout, random whitened rows and dense double oracles; the filter tests' bench.
#pragma once

#include <Eigen/Dense>
#include <cstring>
#include <random>
#include <vector>

#include "armcal/filter/prior.hpp"
#include "armcal/filter/slices.hpp"

namespace armcal::filter::test {

// Three joints with 2, 0 and 3 front columns and seven dense ones.
struct Small {
  static constexpr int kJoints = 3, kFront = 5, kDense = 7, kColumns = 12, kNonlinear = 0;
  static constexpr int kFrontBegin[4] = {0, 2, 2, 5};
  static constexpr int kRowBegin[3] = {0, 2, 4};
};
inline constexpr std::uint32_t kAll = 7;  // every joint of it moves

struct Row {
  int joint;
  float front[Small::kFront] = {};
  float dense[Small::kDense] = {};
  float y = 0;
};

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

template <class Layout>
Vector Full(const Row& row) {
  Vector h = Vector::Zero(Layout::kColumns);
  for (int k = Layout::kFrontBegin[row.joint]; k < Layout::kFrontBegin[row.joint + 1]; ++k)
    h(k) = row.front[k - Layout::kFrontBegin[row.joint]];
  for (int k = 0; k < Layout::kDense; ++k) h(Layout::kFront + k) = row.dense[k];
  return h;
}

// Rows of a known truth with unit noise. Elements of size `size`.
struct Bench {
  std::mt19937 random{11};
  std::normal_distribution<float> normal;
  Prior<Small> prior;
  Vector truth;
  float size = 1.0f;

  Bench() {
    // A correlated dense prior with unit variances, random.
    Matrix w = Matrix::NullaryExpr(Small::kDense, Small::kDense + 3, [&] { return normal(random); });
    for (int i = 0; i < Small::kDense; ++i) w.row(i).normalize();
    Eigen::Matrix<double, -1, -1, Eigen::RowMajor> rows = w;
    double ud[math::UdSize(Small::kDense)];
    math::UdFromSquareRoot<Small::kDense, Small::kDense + 3>(rows.data(), ud);
    for (int k = 0; k < math::UdSize(Small::kDense); ++k) prior.dense_ud[k] = static_cast<float>(ud[k]);
    for (int k = 0; k < Small::kColumns; ++k) {
      prior.active[k] = ~0u;
      prior.lambda[k] = 1.0f;
    }
    truth = Vector::NullaryExpr(Small::kColumns, [&] { return normal(random); });
  }
  Row Next(int joint) {
    Row row;
    row.joint = joint;
    const int width = Small::kFrontBegin[joint + 1] - Small::kFrontBegin[joint];
    for (int k = 0; k < width; ++k) row.front[k] = size * normal(random);
    for (int k = Small::kRowBegin[joint]; k < Small::kDense; ++k) row.dense[k] = size * normal(random);
    row.y = static_cast<float>(Full<Small>(row).dot(truth)) + normal(random);
    return row;
  }
  std::vector<Row> Rows(int samples) {
    std::vector<Row> rows;
    for (int s = 0; s < samples; ++s)
      for (int j = 0; j < Small::kJoints; ++j) rows.push_back(Next(j));
    return rows;
  }
};

// Prior covariance (prior units) of the full state.
template <class Layout>
Matrix PriorCovariance(const Prior<Layout>& prior) {
  constexpr int n = Layout::kColumns;
  Matrix u = Matrix::Identity(n, n), d = Matrix::Zero(n, n);
  for (int k = 0; k < Layout::kFront; ++k) d(k, k) = prior.active[k] != 0 ? 1 : 0;
  for (int j = 0; j < Layout::kDense; ++j) {
    d(Layout::kFront + j, Layout::kFront + j) = prior.dense_ud[math::UdIndex(j, j)];
    for (int i = 0; i < j; ++i) u(Layout::kFront + i, Layout::kFront + j) = prior.dense_ud[math::UdIndex(i, j)];
  }
  return u * d * u.transpose();
}

// Batch least squares in double by QR of [P0^-1/2; rows].
struct Posterior {
  Vector x, sd;
};
inline Posterior SolveBatch(const Matrix& prior_covariance, const Matrix& rows, const Vector& y) {
  const int n = static_cast<int>(prior_covariance.rows());
  const Matrix half = prior_covariance.llt().matrixL();
  Matrix a(n + rows.rows(), n);
  a << half.triangularView<Eigen::Lower>().solve(Matrix::Identity(n, n)), rows;
  Vector b = Vector::Zero(n + y.size());
  b.tail(y.size()) = y;
  const Eigen::HouseholderQR<Matrix> qr(a);
  const Matrix r = qr.matrixQR().topRows(n).triangularView<Eigen::Upper>();
  const Matrix inverse = r.triangularView<Eigen::Upper>().solve(Matrix::Identity(n, n));
  Posterior p;
  p.x = inverse * (qr.householderQ().transpose() * b).head(n);
  p.sd = inverse.rowwise().norm();
  return p;
}
template <class Layout>
Posterior SolveBatch(const Prior<Layout>& prior, const std::vector<Row>& rows) {
  Matrix h(rows.size(), Layout::kColumns);
  Vector y(rows.size());
  for (std::size_t k = 0; k < rows.size(); ++k) {
    h.row(k) = Full<Layout>(rows[k]);
    y(k) = rows[k].y;
  }
  return SolveBatch(PriorCovariance(prior), h, y);
}

// Largest difference of estimate and oracle in the oracle's standard deviations.
template <class Layout>
double Distance(const float* x, const Posterior& oracle) {
  double worst = 0;
  for (int k = 0; k < Layout::kColumns; ++k) worst = std::max(worst, std::abs(x[k] - oracle.x(k)) / oracle.sd(k));
  return worst;
}

template <class Filter>
typename Filter::ReadOut Read(const Filter& filter) {
  typename Filter::ReadOut out;
  filter.BeginReadOut(out);
  for (bool done = false; !done;) {
    int credit = kSliceCredit;
    done = filter.StepReadOut(out, credit);
  }
  return out;
}

// Every bit that a filter keeps from row to row. What one row leaves in the work space has no say in the next: the
// rows after must come out the same, too, which the tests of a refused row let them.
// The rows of a sample, one of each joint, with `credit` more for each slice. Returns how many slices it took.
template <class Filter>
int TakeRows(Filter& filter, const Row* rows, int credit = kNoSlices) {
  int slices = 1, left = credit;
  const auto finish = [&](auto step) {
    for (; !step(left); left += credit) ++slices;
  };
  for (const Row* r = rows; r < rows + Small::kJoints; ++r) {
    filter.BeginRow(r->joint, r->front, r->dense, r->y, true);
    finish([&](int& c) { return filter.StepRow(c); });
  }
  finish([&](int& c) { return filter.StepRows(c); });
  return slices;
}

template <class Estimate>
std::vector<unsigned char> EstimateBytes(const Estimate& e) {
  std::vector<float> all(e.elements(), e.elements() + Estimate::Columns::kElements);
  for (int p = 0; p < Estimate::kSize; ++p) all.push_back(e.x(p));
  std::vector<unsigned char> bytes(all.size() * sizeof(float));
  std::memcpy(bytes.data(), all.data(), bytes.size());
  return bytes;
}

}  // namespace armcal::filter::test

// physical - a filter's result made by dense double algebra from any amount of data; the tests' bench.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <memory>
#include <random>

#include "armcal/estimator/adopted_table.hpp"
#include "armcal/physical/map_read_out.hpp"

namespace armcal::physical::test {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// U D U' of a packed float factor, in double.
inline Matrix Covariance(const float* ud, int n) {
  Matrix u = Matrix::Identity(n, n);
  Vector d(n);
  for (int j = 0; j < n; ++j) {
    d(j) = ud[math::UdIndex(j, j)];
    for (int i = 0; i < j; ++i) u(i, j) = ud[math::UdIndex(i, j)];
  }
  return u * d.asDiagonal() * u.transpose();
}

// A table, and what a filter would say after rows of a made-up regressor; its rounding to float included.
template <class Model>
struct Case {
  static constexpr int kColumns = Model::kColumns;
  estimator::Table<Model> table = estimator::DefaultTable<Model>();
  std::unique_ptr<physical::RigidPrior<Model, float>> rigid = std::make_unique<physical::RigidPrior<Model, float>>();
  std::unique_ptr<estimator::AdoptedTable<Model>> adopted = std::make_unique<estimator::AdoptedTable<Model>>();
  std::vector<float> x = std::vector<float>(kColumns), ud = std::vector<float>(math::UdSize(kColumns));

  core::Status Build() {
    const core::Status status = estimator::BuildAdoptedTable<Model>(table, 1, *rigid, *adopted);
    ud = Before();
    std::fill(x.begin(), x.end(), 0.0f);
    return status;
  }
  // The prior's factor of all columns.
  std::vector<float> Before() const {
    std::vector<float> whole(math::UdSize(kColumns));
    for (int k = 0; k < Model::kFront; ++k) whole[math::UdIndex(k, k)] = adopted->prior.active[k] ? 1.0f : 0.0f;
    for (int j = 0; j < Model::kDense; ++j)
      for (int i = 0; i <= j; ++i)
        whole[math::UdIndex(Model::kFront + i, Model::kFront + j)] = adopted->prior.dense_ud[math::UdIndex(i, j)];
    return whole;
  }
  // Rows h' x = y of variance 1 in prior units, by Bierman's update in double.
  void Take(const Matrix& h, const Vector& y) {
    std::vector<double> factor(ud.begin(), ud.end());
    Vector mean = Eigen::Map<Eigen::VectorXf>(x.data(), kColumns).cast<double>();
    for (int r = 0; r < h.rows(); ++r) {
      const Vector row = h.row(r);
      Vector gain = Vector::Zero(kColumns);
      double alpha = 1;
      for (int j = 0; j < kColumns; ++j) {
        double* u = factor.data() + math::UdIndex(0, j);
        const double d = u[j];
        u[j] = 1;
        Eigen::Map<Vector> column(u, j + 1);
        const double f = column.dot(row.head(j + 1)), next = alpha + d * f * f;
        const Vector before = column;
        column.head(j) -= f / alpha * gain.head(j);
        gain.head(j + 1) += d * f * before;
        u[j] = d * alpha / next;
        alpha = next;
      }
      mean += gain * ((y(r) - row.dot(mean)) / alpha);
    }
    for (std::size_t k = 0; k < ud.size(); ++k) ud[k] = static_cast<float>(factor[k]);
    for (int k = 0; k < kColumns; ++k) x[k] = static_cast<float>(mean(k));
  }
  MapPrior<Model> prior() const {
    return {rigid->mean, rigid->sd, adopted->committed.p, adopted->scale, adopted->prior.dense_ud};
  }
  template <class ReadOut>
  core::Status HandOver(ReadOut& out, bool warm = false) const {
    core::Status status = out.Begin(prior(), x.data(), warm);
    for (int j = 0; j < kColumns && core::IsOk(status); ++j) {
      float column[kColumns] = {};
      for (int i = 0; i < j; ++i) column[i] = ud[math::UdIndex(i, j)];
      column[j] = 1;
      status = out.AddSpread(ud[math::UdIndex(j, j)], column);
    }
    return status;
  }
};

template <class Model>
using ReadOut = MapReadOut<Model, double>;

// A drawn truth, `size` times the prior's spread, and 300 rows of it. In prior units a row of `weight` says in each
// column as much as the prior for 1, a million times more for 1000. What the truth says need not be physical.
template <class Model>
std::unique_ptr<Case<Model>> Draw(unsigned seed, double weight, double size) {
  auto c = std::make_unique<Case<Model>>();
  EXPECT_EQ(c->Build(), core::Status::kOk);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  const Eigen::SelfAdjointEigenSolver<Matrix> prior(Covariance(c->ud.data(), Model::kColumns));
  const Vector z = Vector::NullaryExpr(Model::kColumns, [&] { return normal(random); });
  const Vector root = prior.eigenvalues().cwiseMax(0).cwiseSqrt();
  const Vector truth = size * prior.eigenvectors() * (root.asDiagonal() * z);
  Matrix h(300, Model::kColumns);
  for (int k = 0; k < Model::kColumns; ++k)
    for (int r = 0; r < h.rows(); ++r) h(r, k) = c->adopted->prior.active[k] ? weight * normal(random) : 0;
  c->Take(h, h * truth + Vector::NullaryExpr(h.rows(), [&] { return normal(random); }));
  return c;
}

// A hundred rows of noise about the prior.
template <class Model>
void TakeNoise(Case<Model>& c, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Matrix h = Matrix::Zero(100, Model::kColumns);
  for (int k = 0; k < Model::kColumns; ++k)
    for (int r = 0; r < h.rows(); ++r) h(r, k) = c.adopted->prior.active[k] ? 0.3 * normal(random) : 0;
  c.Take(h, Vector::NullaryExpr(h.rows(), [&] { return normal(random); }));
}

template <class Model>
const typename ReadOut<Model>::Result& Solve(ReadOut<Model>& read_out, const Case<Model>& c, bool warm = false) {
  EXPECT_EQ(c.HandOver(read_out, warm), core::Status::kOk);
  while (!read_out.Step()) {
  }
  return read_out.result();
}

// Largest difference of two sets of bodies' central coordinates, in prior standard deviations.
template <class Model>
double Distance(const Case<Model>& c, const double* a, const double* b) {
  double worst = 0;
  for (int at = 0; at < Model::kBodyParameters; at += 11) {
    double ca[11], cb[11];
    ToCentral(a + at, ca);
    ToCentral(b + at, cb);
    ca[10] = a[at + 10], cb[10] = b[at + 10];
    for (int k = 0; k < 11; ++k)
      if (const double sd = c.rigid->sd[at + k]; sd > 0) worst = std::max(worst, std::abs(ca[k] - cb[k]) / sd);
  }
  return worst;
}

template <class Model>
bool PhysicalInATable(const double* body) {
  bool good = true;
  for (int at = 0; at < Model::kBodyParameters; at += 11) {
    float entry[11];
    std::copy(body + at, body + at + 11, entry);
    good &= CanExist(entry);
  }
  return good;
}

}  // namespace armcal::physical::test

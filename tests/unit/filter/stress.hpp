// filter - collinear rows of the six-axis size and the filters' recursions in double, written plainly; the stress
// tests' bench. One list of checks for a short and a long run.
#pragma once

#include <gtest/gtest.h>

#include <memory>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "tests/unit/filter/rows.hpp"

namespace armcal::filter::test {

// 36 base columns and three friction columns a joint.
struct SixAxis {
  static constexpr int kJoints = 6, kFront = 18, kDense = 36, kColumns = 54, kNonlinear = 0;
  static constexpr int kFrontBegin[7] = {0, 3, 6, 9, 12, 15, 18};
  static constexpr int kRowBegin[6] = {0, 1, 8, 15, 22, 29};
};

// Dense columns of a row mixed by a matrix of the given condition: collinear, not only badly scaled.
struct Collinear {
  std::mt19937 random{5};
  std::normal_distribution<float> normal;
  Matrix mix;  // block upper: keeps the leading zeros of each row
  Vector truth;
  explicit Collinear(double condition) {
    const auto any = [&] { return static_cast<double>(normal(random)); };
    mix = Matrix::Zero(SixAxis::kDense, SixAxis::kDense);
    const int begin[8] = {0, 1, 8, 15, 22, 29, 36};
    for (int b = 0; b < 6; ++b) {
      const int size = begin[b + 1] - begin[b];
      const Matrix q1 = Eigen::HouseholderQR<Matrix>(Matrix::NullaryExpr(size, size, any)).householderQ();
      const Matrix q2 = Eigen::HouseholderQR<Matrix>(Matrix::NullaryExpr(size, size, any)).householderQ();
      Vector s(size);
      for (int k = 0; k < size; ++k) s(k) = std::pow(condition, size > 1 ? -static_cast<double>(k) / (size - 1) : 0.0);
      mix.block(begin[b], begin[b], size, size) = q1 * s.asDiagonal() * q2;
    }
    truth = Vector::NullaryExpr(SixAxis::kColumns, any);
  }
  void Next(int joint, float* front, float* dense, float& y) {
    constexpr float kSize = 30.0f;  // torque of one prior standard deviation over torque noise
    Vector row = Vector::Zero(SixAxis::kDense);
    for (int k = SixAxis::kRowBegin[joint]; k < SixAxis::kDense; ++k) row(k) = kSize * normal(random);
    row = mix.transpose() * row;
    double sum = normal(random);
    for (int k = 0; k < SixAxis::kDense; ++k) {
      dense[k] = static_cast<float>(row(k));
      sum += dense[k] * truth(SixAxis::kFront + k);
    }
    for (int k = 0; k < 3; ++k) {
      front[k] = kSize * normal(random);
      sum += front[k] * truth(3 * joint + k);
    }
    y = static_cast<float>(sum);
  }
};

inline Prior<SixAxis> Independent(float lambda, float noise, float floor) {
  Prior<SixAxis> prior;
  for (int k = 0; k < SixAxis::kColumns; ++k) {
    prior.active[k] = ~0u;
    prior.lambda[k] = lambda;
    prior.noise[k] = k < SixAxis::kFront ? noise : 0.0f;
  }
  for (int k = 0; k < SixAxis::kDense; ++k) prior.dense_ud[math::UdIndex(k, k)] = 1.0f;
  prior.link_floor = floor;
  return prior;
}

// Bierman and Agee-Turner on a full triangle, columns in the order of the filter's factor: the floor under D has a
// meaning only in an order.
struct DoubleUd {
  static constexpr int n = SixAxis::kColumns;
  Matrix u = Matrix::Identity(n, n);
  Vector d = Vector::Ones(n), x = Vector::Zero(n);
  void Measure(const Vector& h, double y) {
    const Vector f = u.transpose() * h;
    Vector gain = Vector::Zero(n);
    double alpha = 1;
    const double innovation = y - h.dot(x);
    for (int j = 0; j < n; ++j) {
      const double v = d(j) * f(j), next = alpha + v * f(j);
      d(j) *= alpha / next;
      const Vector old = u.col(j).head(j);
      u.col(j).head(j) -= f(j) / alpha * gain.head(j);
      gain.head(j) += v * old;
      gain(j) = v;
      alpha = next;
    }
    x += gain * (innovation / alpha);
  }
  void AddNoise(int position, double c) {
    Vector a = Vector::Unit(n, position);
    for (int j = position; j >= 0; --j) {
      const double old = d(j), aj = a(j);
      d(j) += c * aj * aj;
      a.head(j) -= aj * u.col(j).head(j);
      u.col(j).head(j) += c * aj / d(j) * a.head(j);
      c *= old / d(j);
    }
  }
  Vector Sd() const { return (u * d.asDiagonal() * u.transpose()).diagonal().cwiseSqrt(); }
};

// R' R by Givens rotations on a full triangle, [front, dense, z].
struct DoubleTriangle {
  static constexpr int n = SixAxis::kColumns;
  Eigen::Matrix<double, -1, -1, Eigen::RowMajor> r = std::sqrt(1e-6) * Matrix::Identity(n, n + 1);
  void Add(const Vector& h, double y) {
    Vector row(n + 1);
    row << h, y;
    for (int k = 0; k < n; ++k) {
      if (row(k) == 0) continue;
      const double length = std::hypot(r(k, k), row(k)), c = r(k, k) / length, s = row(k) / length;
      const Vector top = r.row(k).tail(n + 1 - k), rest = row.tail(n + 1 - k);
      r.row(k).tail(n + 1 - k) = c * top + s * rest;
      row.tail(n + 1 - k) = c * rest - s * top;
    }
  }
  // With the prior of unit variance, less the floor that the triangle started from.
  Posterior Solve() const {
    Matrix a(2 * n, n);
    a << Matrix(r.leftCols(n)).triangularView<Eigen::Upper>().toDenseMatrix(),
        std::sqrt(1 - 1e-6) * Matrix::Identity(n, n);
    Vector b = Vector::Zero(2 * n);
    b.head(n) = r.col(n);
    const Eigen::HouseholderQR<Matrix> qr(a);
    const Matrix top = qr.matrixQR().topRows(n).triangularView<Eigen::Upper>();
    const Matrix inverse = top.triangularView<Eigen::Upper>().solve(Matrix::Identity(n, n));
    return {inverse * (qr.householderQ().transpose() * b).head(n), inverse.rowwise().norm()};
  }
};

// Both filters beside their recursions in double, on the same float32 rows.
struct Stress {
  static constexpr std::uint32_t kAll = 63;
  static constexpr int n = SixAxis::kColumns;
  using Kalman = KalmanFilter<SixAxis, Form::kBlock>;

  Collinear rows;
  Prior<SixAxis> prior;
  std::unique_ptr<Kalman> kalman = std::make_unique<Kalman>();
  std::unique_ptr<ForgettingFilter<SixAxis>> forgetting = std::make_unique<ForgettingFilter<SixAxis>>();
  DoubleUd kalman_oracle;
  DoubleTriangle triangle_oracle;
  int noisy = 0;

  Stress(double condition, float lambda, float noise, float floor)
      : rows(condition), prior(Independent(lambda, noise, floor)) {
    kalman->Restart(prior);
    forgetting->Restart(prior);
  }
  template <class Filter>
  static void Begin(Filter& filter, int joint, const float* front, const float* dense, float y) {
    int all = kNoSlices;
    filter.BeginRow(joint, front, dense, y, true);
    ASSERT_TRUE(filter.StepRow(all));
  }
  template <class Filter>
  static void Finish(Filter& filter) {
    int all = kNoSlices;
    ASSERT_TRUE(filter.StepRows(all));
    for (int j = 0; j < SixAxis::kJoints; ++j) ASSERT_TRUE(filter.report(j).accepted);
    filter.EndSample(kAll);
  }
  void Sample() {
    const auto& at = Kalman::Columns::kAt;
    float front[3], dense[SixAxis::kDense], y;
    for (int j = 0; j < SixAxis::kJoints; ++j) {
      rows.Next(j, front, dense, y);
      Begin(*kalman, j, front, dense, y);
      Begin(*forgetting, j, front, dense, y);
      Vector h = Vector::Zero(n), ordered = Vector::Zero(n);
      for (int k = 0; k < 3; ++k) h(3 * j + k) = front[k];
      for (int k = 0; k < SixAxis::kDense; ++k) h(SixAxis::kFront + k) = dense[k];
      for (int k = 0; k < n; ++k) ordered(at.position[k]) = h(k);
      kalman_oracle.Measure(ordered, y);
      triangle_oracle.Add(h, y);
    }
    Finish(*kalman);
    Finish(*forgetting);
    for (int k = SixAxis::kFront; k < n; ++k) {
      double& d = kalman_oracle.d(at.position[k]);
      d = std::max(d, static_cast<double>(prior.link_floor));
    }
    // Front columns in the order of the factor, which for this layout is their own.
    if (prior.noise[0] > 0)
      kalman_oracle.AddNoise(at.position[noisy++ % SixAxis::kFront],
                             static_cast<double>(prior.noise[0]) * SixAxis::kFront);
    triangle_oracle.r *= std::sqrt(static_cast<double>(prior.lambda[0]));
    for (int p = 0; p < n; ++p) ASSERT_GT(kalman->estimate().d(p), 0.0f);
    for (int k = 0; k < n; ++k) ASSERT_GT(forgetting->weights()[k], 0.0f);
  }
  // Largest difference to the recursion in double, in its standard deviations.
  double KalmanDistance() const {
    const Vector sd = kalman_oracle.Sd();
    double worst = 0;
    for (int p = 0; p < n; ++p) worst = std::max(worst, std::abs(kalman->estimate().x(p) - kalman_oracle.x(p)) / sd(p));
    return worst;
  }
  double ForgettingDistance() const { return Distance<SixAxis>(Read(*forgetting).x, triangle_oracle.Solve()); }
};

}  // namespace armcal::filter::test

// estimator - dense double algebra for any model: regressor, prior, batch and forgetting solutions; the tests' judge.
#pragma once

#include <Eigen/Dense>
#include <cstring>
#include <memory>
#include <vector>

#include "armcal/estimator/estimator.hpp"
#include "tests/unit/filter/moving_joints.hpp"

namespace armcal::estimator::test {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

// All rows of the regressor at a sample, computed in double: [kJoints x kColumns].
template <class Model>
Matrix Regressor(const model::Sample<Model::kJoints>& s) {
  constexpr int n = Model::kJoints;
  model::ModelInput<double, n> x = {};
  for (int i = 0; i < n; ++i) {
    x.q[i] = s.q[i];
    x.qd[i] = s.qd[i];
    x.qdd[i] = s.qdd[i];
  }
  std::vector<double> eta(Model::kNonlinear + 1), front(Model::kFront + 1), dense(n * Model::kDense);
  for (int e = 0; e < Model::kNonlinear; ++e) eta[e] = Model::kInfo[Model::kParameters - Model::kNonlinear + e].mean;
  Model::template Regressor<double>(x, nullptr, eta.data(), nullptr, nullptr, front.data(), dense.data());
  Matrix y = Matrix::Zero(n, Model::kColumns);
  for (int j = 0; j < n; ++j) {
    for (int k = Model::kFrontBegin[j]; k < Model::kFrontBegin[j + 1]; ++k) y(j, k) = front[k];
    for (int k = 0; k < Model::kDense; ++k) y(j, Model::kFront + k) = dense[j * Model::kDense + k];
  }
  return y;
}

// Prior of the filter coordinates from the table; the bodies' derivative by differences of the parallel-axis rule.
template <class Model>
Matrix PriorCovariance(const Table<Model>& table) {
  const auto uncertain = [&](int k) {
    const model::ParameterState s = table.parameter[k].state;
    return s == model::ParameterState::kEstimated || s == model::ParameterState::kConsidered;
  };
  constexpr double kStep = 1e-6;
  Matrix p = Matrix::Zero(Model::kColumns, Model::kColumns),
         spread = Matrix::Zero(Model::kRigid, Model::kBodyParameters);
  for (int k = 0; k < Model::kBodyParameters; ++k) {
    if (!uncertain(k)) continue;
    Vector base[2] = {Vector(Model::kRigid), Vector(Model::kRigid)};
    for (int side = 0; side < 2; ++side) {
      double body[Model::kBodyParameters], central[10];
      for (int e = 0; e < Model::kBodyParameters; ++e) body[e] = table.parameter[e].mean;
      const int own = k % model::kBodyBlock;
      double* block = body + k - own;
      const double step = side == 0 ? -kStep : kStep;
      if (own == model::kRotor) {
        block[own] += step;
      } else {
        physical::ToCentral(block, central);
        central[own] += step;
        physical::FromCentral(central, block);
      }
      physical::MapBodies<Model>(body, base[side].data());
    }
    spread.col(k) = (base[1] - base[0]) / (2 * kStep) * table.parameter[k].sd;
  }
  p.block(Model::kFront, Model::kFront, Model::kRigid, Model::kRigid) = spread * spread.transpose();
  for (int k = 0; k < Model::kColumns; ++k) {
    if (k >= Model::kFront && k < Model::kFront + Model::kRigid) continue;
    const int entry = Model::kBodyParameters + (k < Model::kFront ? k : k - Model::kRigid);
    if (uncertain(entry)) p(k, k) = static_cast<double>(table.parameter[entry].sd) * table.parameter[entry].sd;
  }
  return p;
}

// Least squares of all whitened rows whose joint may update, against b0, with the prior, by Householder QR on the
// active columns. lambda: per column, forgetting gated as the filter states it; empty: none.
template <class Model>
struct Oracle {
  std::vector<int> active;
  Vector x, sd;  // [kColumns]; sd 0 where inactive

  Oracle(const Table<Model>& table, const Vector& b0, const std::vector<model::Sample<Model::kJoints>>& samples,
         const std::vector<double>& lambda = {}) {
    const Matrix p = PriorCovariance<Model>(table);
    for (int k = 0; k < Model::kColumns; ++k)
      if (p(k, k) > 0) active.push_back(k);
    const int n = static_cast<int>(active.size());
    const int batch = lambda.empty() ? 100 : 1;
    Matrix r = Matrix::Zero(n, n + 1), stacked = Matrix::Zero(n + batch * Model::kJoints, n + 1);
    for (std::size_t at = 0; at < samples.size(); ++at) {
      const int slot = static_cast<int>(at) % batch;
      std::uint32_t moving = 0;
      stacked.middleRows(n + slot * Model::kJoints, Model::kJoints) = Rows(table, b0, samples[at], moving);
      if (slot + 1 < batch && at + 1 < samples.size()) continue;
      stacked.topRows(n) = r;
      r = Eigen::HouseholderQR<Matrix>(stacked).matrixQR().topRows(n).template triangularView<Eigen::Upper>();
      stacked.setZero();
      for (int k = 0; k < n && !lambda.empty(); ++k) {
        const std::uint32_t needed = filter::test::JointsOf<Model>(active[k]);
        if ((moving & needed) == needed) r.row(k) *= std::sqrt(lambda[active[k]]);
      }
    }
    Solve(p, b0, r);
  }

  // Largest difference in standard deviations.
  double Distance(const float* value) const {
    double worst = 0;
    for (const int k : active) worst = std::max(worst, std::abs(value[k] - x(k)) / sd(k));
    return worst;
  }

 private:
  Matrix Rows(const Table<Model>& table, const Vector& b0, const model::Sample<Model::kJoints>& s,
              std::uint32_t& moving) const {
    const int n = static_cast<int>(active.size());
    const Matrix y = Regressor<Model>(s);
    Matrix rows = Matrix::Zero(Model::kJoints, n + 1);
    for (int j = 0; j < Model::kJoints; ++j) {
      if ((s.flags[j] & 3) != (model::kValid | model::kMoving)) continue;
      moving |= 1u << j;
      for (int k = 0; k < n; ++k) rows(j, k) = y(j, active[k]) / table.joint[j].sigma_Nm;
      rows(j, n) = (s.tau[j] - y.row(j).dot(b0)) / table.joint[j].sigma_Nm;
    }
    return rows;
  }
  void Solve(const Matrix& p, const Vector& b0, const Matrix& r) {
    const int n = static_cast<int>(active.size());
    Matrix prior(n, n), all = Matrix::Zero(2 * n, n + 1);
    for (int i = 0; i < n; ++i)
      for (int k = 0; k < n; ++k) prior(i, k) = p(active[i], active[k]);
    const Matrix half = prior.llt().matrixL();
    all.topLeftCorner(n, n) = half.template triangularView<Eigen::Lower>().solve(Matrix::Identity(n, n));
    all.bottomRows(n) = r;
    const Eigen::HouseholderQR<Matrix> qr(all);
    const Matrix top = qr.matrixQR().topRows(n).template triangularView<Eigen::Upper>();
    const Matrix inverse = top.leftCols(n).template triangularView<Eigen::Upper>().solve(Matrix::Identity(n, n));
    const Vector solution = inverse * top.col(n), spread = inverse.rowwise().norm();
    x = b0;
    sd = Vector::Zero(Model::kColumns);
    for (int k = 0; k < n; ++k) {
      x(active[k]) += solution(k);
      sd(active[k]) = spread(k);
    }
  }
};

// Every bit of a result.
template <class T>
std::vector<unsigned char> Bits(const T& result) {
  std::vector<unsigned char> bytes(sizeof result);
  std::memcpy(bytes.data(), &result, sizeof result);
  return bytes;
}

// An estimator with its adopted, fed sample by sample until idle, as a host does.
template <class Model, class Filter>
struct Host {
  Table<Model> table = DefaultTable<Model>();
  physical::RigidPrior<Model, float> rigid;
  AdoptedTable<Model> adopted;
  Estimator<Model, Filter> estimator;
  Estimates<Model> estimates;

  core::Status Adopt(std::uint32_t generation = 1) {
    const core::Status status = BuildAdoptedTable<Model>(table, generation, rigid, adopted);
    if (core::IsOk(status)) estimator.Adopt(adopted, 0);
    return status;
  }
  void Drain() {
    while (estimator.Step()) {
    }
  }
  core::Status Feed(const model::Sample<Model::kJoints>& s) {
    const core::Status status = estimator.PushSample(s);
    Drain();
    return status;
  }
  const Estimates<Model>& Read() {
    Drain();
    estimator.RequestReadOut();
    Drain();
    estimator.Take(estimates);
    return estimates;
  }
  Vector b0() const {
    return Eigen::Map<const Eigen::VectorXf>(adopted.committed.p, Model::kColumns).template cast<double>();
  }
};

}  // namespace armcal::estimator::test

// tests - the emitted C++ of every record that a model can hold: against the graph, and its gradients against complex
// steps through the emitted code itself.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include <every_effect/model.hpp>
#include "tests/unit/codegen/complex_step.hpp"
#include "tests/unit/codegen/every_effect.hpp"

namespace armcal::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using M = generated::EveryEffect;
constexpr int n = M::kJoints, kSamples = 150;

const codegen::Model& EveryEffectModel() {
  static const codegen::Model m = EveryEffect();
  return m;
}

// Smooth motion with reversals, rounded to float so that both sides read the same numbers.
codegen::Signals Motion() {
  codegen::Signals s;
  s.t = VectorXd::LinSpaced(kSamples, 0.0, 0.008 * (kSamples - 1)).array() + 0.05;
  const auto fill = [](double phase, double size) {
    return MatrixXd(MatrixXd::NullaryExpr(kSamples, n, [=](Eigen::Index k, Eigen::Index j) {
      return static_cast<double>(static_cast<float>(size * std::sin(0.04 * (j + 1.3) * k + phase * (j + 1))));
    }));
  };
  s.q = fill(0.3, 1.4), s.qd = fill(1.1, 1.2), s.qdd = fill(2.0, 3.0), s.temp = fill(0.7, 8).array() + 32;
  return s;
}

VectorXd Coordinates(double seed) {  // some value for every filter coordinate
  return VectorXd::NullaryExpr(M::kColumns, [=](Eigen::Index k) { return std::sin(seed + 1.7 * k); });
}

VectorXd Eta() {
  VectorXd eta(M::kNonlinear);
  for (int k = 0; k < M::kNonlinear; ++k) eta[k] = EveryEffectModel().table()[M::kParameters - M::kNonlinear + k].mean;
  return eta;
}

// The emitted model over the motion: every column in every row, and d tau / d eta.
template <class T>
struct Emitted {
  std::vector<std::vector<T>> column;    // [sample][row * kColumns + column]
  std::vector<std::vector<T>> jacobian;  // [sample][row * kNonlinear + eta]

  Emitted(const codegen::Signals& s, const VectorXd& committed, const VectorXd& coordinates,
          const std::vector<T>& eta) {
    const std::vector<T> c(committed.begin(), committed.end()), p(coordinates.begin(), coordinates.end());
    constexpr int kCarried = M::kStates + M::kSensitivities;
    std::vector<T> state(kCarried, T(0)), next(kCarried, T(0));
    std::vector<T> front(M::kFront, T(0)), dense(n * M::kDense, T(0)), j(n * M::kNonlinear, T(0));
    for (int k = 0; k < kSamples; ++k) {
      model::ModelInput<T, n> x{};
      for (int i = 0; i < n; ++i)
        x.q[i] = T(s.q(k, i)), x.qd[i] = T(s.qd(k, i)), x.qdd[i] = T(s.qdd(k, i)), x.temp[i] = T(s.temp(k, i));
      x.t = T(s.t[k]), x.dt = T(0.008);
      if (k == 0) M::InitialState(x, c.data(), eta.data(), state.data());
      M::Regressor(x, c.data(), eta.data(), state.data(), next.data(), front.data(), dense.data());
      M::Jacobian(x, c.data(), eta.data(), p.data(), state.data(), next.data(), j.data());
      std::swap(state, next);
      std::vector<T> all(n * M::kColumns, T(0));
      for (int i = 0; i < n; ++i) {
        for (int f = M::kFrontBegin[i]; f < M::kFrontBegin[i + 1]; ++f) all[i * M::kColumns + f] = front[f];
        for (int d = 0; d < M::kDense; ++d) all[i * M::kColumns + M::kFront + d] = dense[i * M::kDense + d];
      }
      column.push_back(all);
      jacobian.push_back(j);
    }
  }
};

template <class T>
std::vector<T> As(const VectorXd& v) {
  return {v.begin(), v.end()};
}

std::string Effect(const std::string& parameter) { return parameter.substr(0, parameter.find('.')); }

// share: of the largest value of the same effect over the run, in any row: the splines of one sum are rounded alike,
// and so are the rows of one sum of gravity's terms.
template <class T>
void Compare(const std::vector<std::vector<T>>& emitted, const std::vector<MatrixXd>& graph, double share,
             const std::function<std::string(int)>& name) {
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < graph[i].cols(); ++c) {
      double largest = 0;
      for (int other = 0; other < graph[i].cols(); ++other)
        if (Effect(name(other)) == Effect(name(c)))
          for (const MatrixXd& row : graph) largest = std::max(largest, row.col(other).cwiseAbs().maxCoeff());
      for (int k = 0; k < kSamples; ++k)
        ASSERT_NEAR(static_cast<double>(emitted[k][i * graph[i].cols() + c]), graph[i](k, c), share * largest + 1e-30)
            << name(c) << " in row " << i << ", sample " << k;
    }
}

template <class T>
void CompareWithGraph(double share) {
  ASSERT_EQ(M::kColumns, EveryEffectModel().columns());
  ASSERT_EQ(M::kNonlinear, EveryEffectModel().nonlinear());
  const codegen::Signals s = Motion();
  const VectorXd committed = Coordinates(0.2), p = Coordinates(0.9), eta = Eta();
  const Emitted<T> emitted(s, committed, p, As<T>(eta));
  std::vector<MatrixXd> rows, slopes;
  const auto base = As<double>(committed), at = As<double>(p), e = As<double>(eta);
  EveryEffectModel().Regressor(s, base, e, rows);
  EveryEffectModel().Jacobian(s, base, at, e, slopes);
  auto columns = emitted.column;  // the rigid ones are compared elsewhere
  for (int i = 0; i < n; ++i)
    for (int c = 0; c < M::kColumns; ++c) {
      if (!EveryEffectModel().is_rigid(c) && (c >= M::kFront || EveryEffectModel().column_joint(c) == i)) continue;
      rows[i].col(c).setZero();
      for (auto& at_sample : columns) at_sample[i * M::kColumns + c] = T(0);
    }
  Compare<T>(columns, rows, share, [](int k) { return EveryEffectModel().column_name(k); });
  Compare<T>(emitted.jacobian, slopes, 4 * share, [](int k) { return EveryEffectModel().unknowns()[k].name; });
}

// The same operations in another order: some hundred roundings, in states up to 150 samples deep.
TEST(EmittedEffects, InDouble_EqualTheGraph) { CompareWithGraph<double>(1e-10); }

// Rounding 2^-24 of an angle of 1.4 rad, through cos(20 q) and the division by a gap of 5e-3: 2e-5 to 1e-4.
TEST(EmittedEffects, InFloat_StayWithinTheirRounding) { CompareWithGraph<float>(1e-3); }

// tau = sum of p times columns, run with one eta after the other moved by a complex step.
TEST(EmittedEffects, Jacobian_EqualsComplexStepsOfTheEmittedCode) {
  const codegen::Signals s = Motion();
  const VectorXd committed = Coordinates(0.2), p = Coordinates(0.9), eta = Eta();
  const Emitted<double> emitted(s, committed, p, As<double>(eta));
  int seen = 0;
  for (int e = 0; e < M::kNonlinear; ++e) {
    std::vector<Complex> wiggled = As<Complex>(eta);
    wiggled[e] = Complex(eta[e], kComplexStep);
    const Emitted<Complex> stepped(s, committed, p, wiggled);
    MatrixXd slope(kSamples, n);
    for (int k = 0; k < kSamples; ++k)
      for (int i = 0; i < n; ++i) {
        Complex tau = 0;
        for (int c = 0; c < M::kColumns; ++c) tau = tau + Complex(p[c]) * stepped.column[k][i * M::kColumns + c];
        slope(k, i) = Slope(tau);
      }
    seen += slope.cwiseAbs().maxCoeff() > 0;
    for (int k = 0; k < kSamples; ++k)
      for (int i = 0; i < n; ++i)
        ASSERT_NEAR(emitted.jacobian[k][i * M::kNonlinear + e], slope(k, i),
                    1e-10 * slope.cwiseAbs().maxCoeff() + 1e-30)
            << EveryEffectModel().unknowns()[e].name << " in row " << i << ", sample " << k;
  }
  EXPECT_EQ(seen, M::kNonlinear);
}

}  // namespace
}  // namespace armcal::tests

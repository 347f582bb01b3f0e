// estimator - the extended filter on generated six-axis models, against Gauss-Newton over all rows in double.
#include <gtest/gtest.h>

#include <cstring>
#include <random>
#include <with_presliding_dahl/model.hpp>
#include <with_stribeck/model.hpp>

#include "armcal/filter/kalman_filter.hpp"
#include "tests/unit/estimator/motion.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using Stribeck = generated::WithStribeck;
using Dahl = generated::WithPreslidingDahl;
using Samples = std::vector<model::Sample<6>>;

// Torque of a run in double at filter coordinates p and eta: all rows of all samples, states running from the first.
template <class Model>
Vector Torque(const Samples& samples, const Vector& p, const Vector& eta, Matrix* columns = nullptr) {
  constexpr int n = Model::kJoints;
  Vector tau(n * samples.size());
  if (columns != nullptr) columns->setZero(tau.size(), Model::kColumns);
  std::vector<double> front(Model::kFront), dense(n * Model::kDense), state(Model::kStates + 1), next(state);
  for (std::size_t s = 0; s < samples.size(); ++s) {
    model::ModelInput<double, n> x = {};
    for (int i = 0; i < n; ++i) x.q[i] = samples[s].q[i], x.qd[i] = samples[s].qd[i], x.qdd[i] = samples[s].qdd[i];
    x.dt = Model::kSampleTicks / static_cast<double>(Model::kTickRate_Hz);
    if (s == 0) Model::template InitialState<double>(x, p.data(), eta.data(), state.data());
    Model::template Regressor<double>(x, p.data(), eta.data(), state.data(), next.data(), front.data(), dense.data());
    state = next;
    for (int j = 0; j < n; ++j) {
      Vector row = Vector::Zero(Model::kColumns);
      for (int k = Model::kFrontBegin[j]; k < Model::kFrontBegin[j + 1]; ++k) row(k) = front[k];
      for (int k = 0; k < Model::kDense; ++k) row(Model::kFront + k) = dense[j * Model::kDense + k];
      tau(n * s + j) = row.dot(p);
      if (columns != nullptr) columns->row(n * s + j) = row;
    }
  }
  return tau;
}

// Three harmonics, then the same again at a tenth of the speed: the falling part of the Stribeck curve needs it.
template <class Model>
Samples Record(int count) {
  Samples samples(count);
  const double tone[6] = {0.9, 1.1, 1.3, 1.9, 2.3, 2.9}, size[6] = {1.0, 0.5, 0.7, 0.9, 0.9, 1.2};
  for (int k = 0; k < count; ++k) {
    auto& s = samples[k];
    s.tick = k * Model::kSampleTicks;
    for (int i = 0; i < 6; ++i) {
      const double t = 0.008 * k;
      double motion[3] = {};
      for (int h = 1; h <= 4; ++h) {
        const double w = h == 4 ? 0.1 * tone[i] : h * tone[i], a = h == 4 ? size[i] : size[i] / (h * h);
        motion[0] += a * std::sin(w * t + 0.7 * i + h);
        motion[1] += a * w * std::cos(w * t + 0.7 * i + h);
        motion[2] -= a * w * w * std::sin(w * t + 0.7 * i + h);
      }
      s.q[i] = static_cast<float>(motion[0]);
      s.qd[i] = static_cast<float>(motion[1]);
      s.qdd[i] = static_cast<float>(motion[2]);
      const bool moving = std::abs(s.qd[i]) > Model::kAxes[i].v_min_radps;
      s.flags[i] = static_cast<std::uint8_t>(model::kValid | (moving ? model::kMoving : 0));
    }
  }
  return samples;
}

// A truth per draw, in the table's own prior; noise on the torque.
template <class Model>
struct FrictionRun {
  static constexpr int kAll = Model::kColumns + Model::kNonlinear;
  using Filter = filter::ExtendedKalmanFilter<Model, filter::Form::kBlock>;
  std::unique_ptr<Host<Model, Filter>> host = std::make_unique<Host<Model, Filter>>();
  std::mt19937 random;
  std::normal_distribution<double> normal;
  Samples samples;
  Vector truth, eta_truth = Vector::Zero(Model::kNonlinear);

  explicit FrictionRun(int seed) : random(seed) {
    for (model::ParameterEntry& p : host->table.parameter) p.process_noise = 0;
  }
  model::ParameterEntry& eta_entry(int e) { return host->table.parameter[Model::kParameters - Model::kNonlinear + e]; }
  model::ParameterEntry& front_entry(int k) { return host->table.parameter[Model::kBodyParameters + k]; }
  double Uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); }

  void DrawRigid() {
    truth = host->b0();
    const Matrix p = PriorCovariance<Model>(host->table);
    const Eigen::SelfAdjointEigenSolver<Matrix> eigen(
        Matrix(p.block(Model::kFront, Model::kFront, Model::kRigid, Model::kRigid)));
    const Vector z = Vector::NullaryExpr(Model::kRigid, [&] { return normal(random); });
    truth.segment(Model::kFront, Model::kRigid) +=
        0.5 * eigen.eigenvectors() * (eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * z);
  }
  void Feed(int count) {
    samples = Record<Model>(count);
    const Vector tau = Torque<Model>(samples, truth, eta_truth);
    for (int s = 0; s < count; ++s) {
      for (int i = 0; i < 6; ++i)
        samples[s].tau[i] = static_cast<float>(tau(6 * s + i) + Model::kAxes[i].sigma_Nm * normal(random));
      ASSERT_EQ(host->Feed(samples[s]), core::Status::kOk);
    }
  }

  // Least squares of prior and rows in [p, ln or plain eta] by Gauss-Newton, derivatives of eta by differences.
  struct Batch {
    Vector p, eta, sd;
  };
  Batch GaussNewton(int first = 0) {
    const Vector b0 = host->b0();
    const Matrix prior = PriorCovariance<Model>(host->table);
    Vector x = Vector::Zero(kAll), sd = Vector::Zero(kAll);
    const auto eta_of = [&](const Vector& v) {
      Vector eta(Model::kNonlinear);
      for (int e = 0; e < Model::kNonlinear; ++e) eta(e) = eta_entry(e).mean * std::exp(v(Model::kColumns + e));
      return eta;
    };
    std::vector<int> active;
    for (int k = 0; k < Model::kColumns; ++k)
      if (prior(k, k) > 0) active.push_back(k);
    const int linear = static_cast<int>(active.size());
    for (int e = 0; e < Model::kNonlinear; ++e)
      if (eta_entry(e).state == model::ParameterState::kEstimated && eta_entry(e).sd > 0)
        active.push_back(Model::kColumns + e);
    const int m = static_cast<int>(active.size());
    Matrix p0 = Matrix::Zero(m, m);
    for (int i = 0; i < m; ++i)
      for (int k = 0; k < m; ++k) {
        if (i < linear && k < linear) p0(i, k) = prior(active[i], active[k]);
        else if (i == k) {
          const auto& entry = eta_entry(active[i] - Model::kColumns);
          p0(i, i) = std::pow(entry.sd / entry.mean, 2);
        }
      }
    const Matrix half = Matrix(p0.llt().matrixL()).triangularView<Eigen::Lower>().solve(Matrix::Identity(m, m));
    for (int iteration = 0; iteration < 12; ++iteration) {
      Matrix columns;
      const Vector p = b0 + x.head(Model::kColumns), eta = eta_of(x);
      const Vector tau = Torque<Model>(samples, p, eta, &columns);
      Matrix a = Matrix::Zero(m + tau.size(), m);
      Vector b = Vector::Zero(m + tau.size());
      a.topRows(m) = half;
      for (int i = 0; i < m; ++i) b.head(m) -= half.col(i) * x(active[i]);
      std::vector<Vector> slope;
      for (int i = linear; i < m; ++i) {
        Vector up = x, down = x;
        up(active[i]) += 1e-4;
        down(active[i]) -= 1e-4;
        slope.push_back((Torque<Model>(samples, p, eta_of(up)) - Torque<Model>(samples, p, eta_of(down))) / 2e-4);
      }
      for (int r = 6 * first; r < tau.size(); ++r) {
        const auto& s = samples[r / 6];
        const int j = r % 6;
        if ((s.flags[j] & model::kMoving) == 0) continue;
        const double sigma = host->table.joint[j].sigma_Nm;
        for (int i = 0; i < m; ++i) a(m + r, i) = (i < linear ? columns(r, active[i]) : slope[i - linear](r)) / sigma;
        b(m + r) = (s.tau[j] - tau(r)) / sigma;
      }
      const Eigen::HouseholderQR<Matrix> qr(a);
      const Matrix top = qr.matrixQR().topRows(m).triangularView<Eigen::Upper>();
      const Matrix inverse = top.triangularView<Eigen::Upper>().solve(Matrix::Identity(m, m));
      const Vector step = inverse * (qr.householderQ().transpose() * b).head(m);
      for (int i = 0; i < m; ++i) x(active[i]) += step(i), sd(active[i]) = inverse.row(i).norm();
      if (step.cwiseQuotient(inverse.rowwise().norm()).cwiseAbs().maxCoeff() < 1e-3) break;
    }
    return {b0 + x.head(Model::kColumns), eta_of(x), sd};
  }
};

// Survey (4): per joint Fc, Fv, dFs = Fs - Fc, vs. Friction of the table 20 % off, Fs / Fc 1.1 .. 1.5, vs .05 .. .2.
struct StribeckRun : FrictionRun<Stribeck> {
  explicit StribeckRun(int seed, int count = 1250) : FrictionRun(seed) {
    for (int k = 0; k < Stribeck::kFront; ++k) {
      model::ParameterEntry& entry = front_entry(k);
      const bool breakaway = k % 3 == 2;
      if (breakaway) entry.mean = 0.25f * front_entry(k - 2).mean;
      entry.sd = (breakaway ? 0.6f : 0.2f) * entry.mean;
    }
    for (int e = 0; e < Stribeck::kNonlinear; e += 2) {
      eta_entry(e) = {0.1f, 0.05f, 0, model::ParameterState::kEstimated, 2};
      eta_truth(e) = 0.05 * std::pow(4, Uniform(0, 1));
      eta_truth(e + 1) = 2;
    }
    EXPECT_EQ(host->Adopt(), core::Status::kOk);
    DrawRigid();
    for (int k = 0; k < Stribeck::kFront; ++k)
      truth(k) = k % 3 == 2 ? Uniform(0.1, 0.5) * truth(k - 2) : front_entry(k).mean * Uniform(0.8, 1.2);
    Feed(count);
  }
  // The survey's e_f: mean of |estimate - truth| / truth over Fc, Fs, qs, Fv of all joints.
  double FrictionError(const float* value, const float* eta) const {
    double sum = 0;
    for (int j = 0; j < 6; ++j) {
      const double fs = value[3 * j] + value[3 * j + 2], fs_truth = truth(3 * j) + truth(3 * j + 2);
      sum += std::abs(value[3 * j] / truth(3 * j) - 1) + std::abs(fs / fs_truth - 1) +
             std::abs(value[3 * j + 1] / truth(3 * j + 1) - 1) + std::abs(eta[2 * j] / eta_truth(2 * j) - 1);
    }
    return sum / 24;
  }
};

TEST(Extended, StribeckOfEachJoint_IsTheGaussNewtonSolution) {
  StribeckRun run(1, 3000);
  const Estimates<Stribeck>& e = run.host->Read();
  const auto batch = run.GaussNewton();
  for (int j = 0; j < 6; ++j) {
    // One pass, each row linearised at what was known then; Gauss-Newton linearises all rows at the end.
    EXPECT_LT(std::abs(std::log(e.eta[2 * j] / batch.eta(2 * j))), 3 * batch.sd(Stribeck::kColumns + 2 * j)) << j;
    EXPECT_NEAR(e.eta_sd[2 * j] / e.eta[2 * j] / batch.sd(Stribeck::kColumns + 2 * j), 1, 0.4) << j;
    for (int k = 3 * j; k < 3 * j + 3; ++k) {
      EXPECT_LT(std::abs(e.value[k] - batch.p(k)), 3 * batch.sd(k)) << k;
    }
    EXPECT_NEAR(e.nis[j], 1, 0.15) << j;
    EXPECT_EQ(e.eta[2 * j + 1], 2.0f);  // fixed
    EXPECT_EQ(e.eta_sd[2 * j + 1], 0.0f);
  }
  EXPECT_LT(run.FrictionError(e.value, e.eta), 0.06);
}

TEST(Extended, TwentyDrawsOfStribeckFriction_AreFound) {
  double sum = 0, worst = 0;
  for (int seed = 100; seed < 120; ++seed) {
    StribeckRun run(seed);
    const Estimates<Stribeck>& e = run.host->Read();
    const double error = run.FrictionError(e.value, e.eta);
    sum += error / 20;
    worst = std::max(worst, error);
  }
  RecordProperty("mean_error", std::to_string(sum));
  RecordProperty("largest_error", std::to_string(worst));
  EXPECT_LT(sum, 0.06);
  EXPECT_LT(worst, 0.2);
}

// Friction with memory: its column runs through a state, d tau / d x0 through the state's sensitivity.
TEST(Extended, PreslidingLengthOfEachJoint_IsTheGaussNewtonSolution) {
  FrictionRun<Dahl> run(3);
  for (int e = 0; e < Dahl::kNonlinear; ++e) {
    run.eta_entry(e) = {3e-3f, 2e-3f, 0, model::ParameterState::kEstimated, 2};
    run.eta_truth(e) = 3e-3 * run.Uniform(0.5, 2);
  }
  ASSERT_EQ(run.host->Adopt(), core::Status::kOk);
  run.DrawRigid();
  for (int k = 0; k < Dahl::kFront; ++k) run.truth(k) *= run.Uniform(0.8, 1.2);
  run.Feed(3000);
  const Estimates<Dahl>& e = run.host->Read();
  const auto batch = run.GaussNewton(30);  // rows wait until the states have forgotten their start: some 20 samples
  for (int j = 0; j < 6; ++j) {
    // A filter linearises as it goes, and friction next to a reversal is far from linear in x0: within a tenth, which
    // is more than its standard deviation says.
    EXPECT_LT(std::abs(std::log(e.eta[j] / batch.eta(j))), 0.1) << j;
    EXPECT_LT(std::abs(std::log(e.eta[j] / run.eta_truth(j))), 0.2) << j;
    EXPECT_NEAR(e.nis[j], 1, 0.2) << j;
  }
}

TEST(Extended, ConsideredFixedAndStandbyEta_StayAndCountAsTheOthersDo) {
  using Filter = filter::ExtendedKalmanFilter<TwoLink>;
  const auto run = [](model::ParameterState state) {
    auto host = std::make_unique<Host<TwoLink, Filter>>();
    host->table.parameter[28].state = model::ParameterState::kEstimated;  // Fs2
    host->table.parameter[28].mean = 1.5f;
    host->table.parameter[30] = {0.1f, 0.05f, 0, state, 2};
    EXPECT_EQ(host->Adopt(), core::Status::kOk);
    Motion motion;
    motion.truth(6) = 1.5;
    for (int k = 0; k < 2000; ++k) EXPECT_EQ(host->Feed(motion.Next()), core::Status::kOk);
    return host->Read();
  };
  const auto estimated = run(model::ParameterState::kEstimated), considered = run(model::ParameterState::kConsidered);
  const auto fixed = run(model::ParameterState::kFixed), standby = run(model::ParameterState::kStandby);
  EXPECT_LT(estimated.eta_sd[0], 0.03f);
  EXPECT_NE(estimated.eta[0], 0.1f);
  EXPECT_EQ(considered.eta[0], 0.1f);
  EXPECT_NEAR(considered.eta_sd[0], 0.05f, 1e-4f);
  EXPECT_GT(considered.sd[6], 1.2f * fixed.sd[6]);  // its uncertainty counts
  EXPECT_EQ(fixed.eta[0], 0.1f);
  EXPECT_EQ(fixed.eta_sd[0], 0.0f);
  EXPECT_EQ(std::memcmp(&fixed, &standby, sizeof fixed), 0);
}

TEST(Extended, EtaThatRunsIntoItsBound_StaysThereAndIsCounted) {
  using Filter = filter::ExtendedKalmanFilter<TwoLink>;
  auto host = std::make_unique<Host<TwoLink, Filter>>();
  host->table.parameter[28] = {1.5f, 0.1f, 0, model::ParameterState::kEstimated, 2};
  host->table.parameter[30] = {0.9f, 0.9f, 0, model::ParameterState::kEstimated, 2};
  ASSERT_EQ(host->Adopt(), core::Status::kOk);
  Motion motion;
  motion.truth(3) += 1.5;  // Coulomb friction looks like a Stribeck speed without end
  for (int k = 0; k < 3000; ++k) ASSERT_EQ(host->Feed(motion.Next()), core::Status::kOk);
  const auto& e = host->Read();
  EXPECT_LE(e.eta[0], 1.0f + 1e-6f);
  EXPECT_GT(e.clamps, 0u);
  for (const float v : e.value) EXPECT_TRUE(std::isfinite(v));
}

// The two-link model with its eta made a constant.
struct NoEta : armcal::test::TwoLink {
  static constexpr int kNonlinear = 0, kParameters = TwoLink::kParameters - 1;
  template <class T>
  static void Regressor(const model::ModelInput<T, 2>& x, const T* p, const T*, const T* state, T* next, T* front,
                        T* dense) {
    const T eta[1] = {T(0.1f)};
    TwoLink::Regressor(x, p, eta, state, next, front, dense);
  }
};

// Without nonlinear parameters there is nothing to linearise, so both filters are the same up to rounding.
TEST(Extended, ModelWithoutEta_IsThePlainKalmanFilter) {
  const auto rigid = std::make_unique<physical::RigidPrior<NoEta, float>>();
  const auto table = std::make_unique<AdoptedTable<NoEta>>();
  ASSERT_EQ(BuildAdoptedTable<NoEta>(DefaultTable<NoEta>(), 1, *rigid, *table), core::Status::kOk);
  Estimator<NoEta, filter::KalmanFilter<NoEta>> plain;
  Estimator<NoEta, filter::ExtendedKalmanFilter<NoEta>> extended;
  plain.Adopt(*table, 0), extended.Adopt(*table, 0);
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  model::Sample<2> sample;
  for (int k = 0; k < 500; ++k, sample.tick += 8) {
    for (int i = 0; i < 2; ++i) {
      sample.q[i] = normal(random), sample.qd[i] = 1 + normal(random) / 4, sample.qdd[i] = normal(random);
      sample.tau[i] = 20 * normal(random), sample.flags[i] = model::kValid | model::kMoving;
    }
    ASSERT_EQ(plain.PushSample(sample), core::Status::kOk);
    ASSERT_EQ(extended.PushSample(sample), core::Status::kOk);
    while (plain.Step()) {
    }
    while (extended.Step()) {
    }
  }
  plain.RequestReadOut(), extended.RequestReadOut();
  while (plain.Step()) {
  }
  while (extended.Step()) {
  }
  Estimates<NoEta> a, b;
  ASSERT_TRUE(plain.Take(a) && extended.Take(b));
  EXPECT_GT(a.rows_used[0], 400u);
  for (int k = 0; k < NoEta::kColumns; ++k) {
    EXPECT_NEAR(a.value[k], b.value[k], 0.01 * a.sd[k] + 1e-6) << k;
    EXPECT_NEAR(a.sd[k], b.sd[k], 1e-3 * a.sd[k]) << k;
  }
}

}  // namespace
}  // namespace armcal::estimator

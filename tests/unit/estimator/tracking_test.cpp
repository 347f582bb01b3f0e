// estimator - viscous friction that changes while the arm moves (the survey's Figure 4): the bank of models, its modes
// fixed beforehand, against exponential forgetting in double at the best factor of a sweep on the same data.
#include <gtest/gtest.h>

#include <random>

#include "armcal/filter/model_bank.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "tests/unit/estimator/oracle.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using Model = generated::Er20Like;
using Bank = Host<Model, filter::ModelBank<Model>>;
using SixAxisSample = model::Sample<6>;
constexpr int kJoints = Model::kJoints, kRun = 30 * 125, kSettled = 5 * 125;
int Fv(int joint) { return Model::kFrontBegin[joint] + 1; }

// 30 s of periodic motion, friction 20 % and bodies most of a standard deviation off the table.
struct Drift {
  std::unique_ptr<Bank> host = std::make_unique<Bank>();
  std::vector<SixAxisSample> samples;
  std::vector<Matrix> regressor;
  std::vector<Vector> viscous;  // true, by sample

  Drift(double (*growth)(double share_of_run), int seed) : samples(kRun) {
    EXPECT_EQ(host->Adopt(), core::Status::kOk);
    std::mt19937 random(seed);
    std::normal_distribution<double> normal;
    std::uniform_real_distribution<double> off(0.8, 1.2), angle(0, 2 * M_PI);
    Vector truth = host->b0();
    const Matrix p = PriorCovariance<Model>(host->table);
    const Eigen::SelfAdjointEigenSolver<Matrix> rigid(
        Matrix(p.block(Model::kFront, Model::kFront, Model::kRigid, Model::kRigid)));
    const Vector z = Vector::NullaryExpr(Model::kRigid, [&] { return normal(random); });
    truth.tail(Model::kRigid) +=
        0.7 * rigid.eigenvectors() * (rigid.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal() * z);
    for (int k = 0; k < Model::kFront; ++k) truth(k) *= off(random);
    const double size[kJoints] = {1.1, 0.6, 0.8, 1.3, 1.0, 1.4};
    double phase[kJoints][4];
    for (auto& joint : phase)
      for (double& a : joint) a = angle(random);
    for (int k = 0; k < kRun; ++k) {
      SixAxisSample& s = samples[k];
      s.tick = k * Model::kSampleTicks;
      for (int i = 0; i < kJoints; ++i) {
        double motion[3] = {};
        for (int h = 1; h <= 4; ++h) {
          const double w = 0.2 * M_PI * h, a = size[i] / h, at = w * 0.008 * k + phase[i][h - 1];
          motion[0] += a * std::sin(at);
          motion[1] += a * w * std::cos(at);
          motion[2] -= a * w * w * std::sin(at);
        }
        s.q[i] = static_cast<float>(motion[0]);
        s.qd[i] = static_cast<float>(motion[1]);
        s.qdd[i] = static_cast<float>(motion[2]);
        const bool moving = std::abs(s.qd[i]) > Model::kAxes[i].v_min_radps;
        s.flags[i] = static_cast<std::uint8_t>(model::kValid | (moving ? model::kMoving : 0));
      }
      Vector now = truth, beta(kJoints);
      for (int i = 0; i < kJoints; ++i) beta(i) = now(Fv(i)) *= growth(static_cast<double>(k) / kRun);
      viscous.push_back(beta);
      regressor.push_back(Regressor<Model>(s));
      const Vector tau = regressor.back() * now;
      for (int i = 0; i < kJoints; ++i)
        s.tau[i] = static_cast<float>(tau(i) + Model::kAxes[i].sigma_Nm * normal(random));
    }
  }

  // RMS of the relative error of beta after five seconds.
  double OfBank() {
    host->estimator.SetPublishEvery(1u << 30);
    double square = 0;
    for (int k = 0; k < kRun; ++k) {
      EXPECT_EQ(host->Feed(samples[k]), core::Status::kOk);
      for (int i = 0; i < kJoints && k >= kSettled; ++i) {
        const double found =
            host->adopted.committed.p[Fv(i)] + host->adopted.scale[Fv(i)] * host->estimator.filter().x(Fv(i));
        square += std::pow(found / viscous[k](i) - 1, 2) / (kJoints * (kRun - kSettled));
      }
    }
    return std::sqrt(square);
  }
  // (23) in base coordinates: from the table's prior with the true R, or as printed: from zero, P0 = 100, R = 1.
  double OfForgetting(double mu, bool prior) const {
    const Matrix p0 = PriorCovariance<Model>(host->table);
    std::vector<int> active;
    for (int k = 0; k < Model::kColumns; ++k)
      if (p0(k, k) > 0) active.push_back(k);
    const int m = static_cast<int>(active.size());
    Matrix p = 100 * Matrix::Identity(m, m);
    Vector x = Vector::Zero(m);
    for (int i = 0; i < m && prior; ++i) {
      x(i) = host->b0()(active[i]);
      for (int k = 0; k < m; ++k) p(i, k) = p0(active[i], active[k]);
    }
    double square = 0;
    for (int k = 0; k < kRun; ++k) {
      for (int j = 0; j < kJoints; ++j) {
        if (!(samples[k].flags[j] & model::kMoving)) continue;
        Vector h(m);
        for (int i = 0; i < m; ++i) h(i) = regressor[k](j, active[i]);
        const double r = prior ? std::pow(Model::kAxes[j].sigma_Nm, 2) : 1, innovation = samples[k].tau[j] - h.dot(x);
        const Vector gain = p * h / (h.dot(p * h) + r);
        x += gain * innovation;
        p -= gain * (p * h).transpose();
      }
      p = Matrix((p + p.transpose()) / (2 * mu));
      for (int i = 0, at = 0; i < m && k >= kSettled; ++i)
        if (active[i] < Model::kFront && active[i] == Fv(at))
          square += std::pow(x(i) / viscous[k](at++) - 1, 2) / (kJoints * (kRun - kSettled));
    }
    return std::isfinite(square) ? std::sqrt(square) : std::numeric_limits<double>::infinity();
  }
  double OfBestForgetting() const {
    double best = std::numeric_limits<double>::infinity();
    for (const double mu : {0.98, 0.985, 0.99, 0.993, 0.995, 0.997, 0.998, 0.999, 0.9995})
      for (const bool prior : {false, true}) best = std::min(best, OfForgetting(mu, prior));
    return best;
  }
};

struct Profile {
  const char* name;
  double (*growth)(double);
};
class Tracking : public testing::TestWithParam<Profile> {};

TEST_P(Tracking, Bank_IsThreeTimesAsCloseAsTheBestForgetting) {
  double bank = 0, forgetting = 0;
  for (const int seed : {901, 902}) {
    Drift drift(GetParam().growth, seed);
    bank += drift.OfBank() / 2;
    forgetting += drift.OfBestForgetting() / 2;
  }
  RecordProperty("bank", std::to_string(bank));
  RecordProperty("best_forgetting", std::to_string(forgetting));
  EXPECT_LT(bank, forgetting / 3);
}

INSTANTIATE_TEST_SUITE_P(Figure4, Tracking,
                         testing::Values(Profile{"ramp", [](double u) { return 1 + 0.5 * u; }},
                                         Profile{"second_order", [](double u) { return 1 + 0.5 * u * u; }},
                                         Profile{"step", [](double u) { return u < 1.0 / 3 ? 1.0 : 1.3; }}),
                         [](const auto& profile) { return profile.param.name; });

}  // namespace
}  // namespace armcal::estimator

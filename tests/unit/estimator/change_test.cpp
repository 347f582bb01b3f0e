// estimator - rest, partial motion and a picked-up load, on a small and on a six-axis arm.
#include <gtest/gtest.h>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "tests/unit/estimator/moving_arm.hpp"
#include "tests/unit/estimator/two_link_model.hpp"

namespace armcal::estimator {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using core::Status;
using SixAxis = generated::Er20Like;
using armcal::test::TwoLink;

constexpr int kPerSecond = 125;

template <class ModelType, class FilterType>
struct Case {
  using Model = ModelType;
  using Filter = FilterType;
};

template <class Case>
struct Change : testing::Test {
  using Arm = MovingArm<typename Case::Model>;
  using Drive = Host<typename Case::Model, typename Case::Filter>;
  std::unique_ptr<Drive> host = std::make_unique<Drive>();
  Arm arm;
  void SetUp() override { ASSERT_EQ(host->Adopt(), Status::kOk); }
  void Feed(int samples, std::uint32_t moving = Arm::kAll) {
    for (int k = 0; k < samples; ++k) ASSERT_EQ(host->Feed(arm.Next(moving)), Status::kOk);
  }
};
using Cases =
    testing::Types<Case<TwoLink, filter::ForgettingFilter<TwoLink>>, Case<TwoLink, filter::KalmanFilter<TwoLink>>,
                   Case<SixAxis, filter::ForgettingFilter<SixAxis>>, Case<SixAxis, filter::KalmanFilter<SixAxis>>>;
TYPED_TEST_SUITE(Change, Cases);

// The table's friction is a quarter off; the hour shows torque anywhere in the friction band.
TYPED_TEST(Change, AfterAnHourOfRest_FrictionIsRightToATenthWithinTenSeconds) {
  using Model = typename TypeParam::Model;
  this->host->estimator.SetPublishEvery(1u << 30);
  std::vector<typename MovingArm<Model>::Sample> rest;
  for (int k = 0; k < 1000; ++k) rest.push_back(this->arm.Next(0));
  for (int k = 0; k < 3600 * kPerSecond; ++k) ASSERT_EQ(this->host->Feed(rest[k % rest.size()]), Status::kOk);
  this->Feed(10 * kPerSecond);
  const Estimates<Model>& e = this->host->Read();
  for (int i = 0; i < Model::kJoints; ++i) EXPECT_LT(this->arm.FrictionError(e.value, i), 0.1) << i;
}

// All joints, then for ten minutes the last half of them alone.
TYPED_TEST(Change, OfTheLastJointsAlone_LeavesTheFrictionOfTheOthers) {
  using Model = typename TypeParam::Model;
  this->Feed(60 * kPerSecond);
  const Estimates<Model> before = this->host->Read();
  constexpr int kResting = Model::kJoints / 2;
  this->Feed(600 * kPerSecond, MovingArm<Model>::kAll & ~((1u << kResting) - 1u));
  const Estimates<Model>& after = this->host->Read();
  for (int i = 0; i < kResting; ++i) {
    EXPECT_EQ(after.rows_used[i], before.rows_used[i]);
    for (int k = Model::kFrontBegin[i]; k < Model::kFrontBegin[i + 1]; ++k) {
      if (!MovingArm<Model>::Estimated(k)) continue;
      EXPECT_LT(std::abs(after.value[k] / before.value[k] - 1), 0.01) << k;
    }
  }
}

// Exponential forgetting in double, in every sample, whatever moves: normal equations, and the prior at the read-out.
template <class Model>
struct PlainForgetting {
  Matrix information = Matrix::Zero(Model::kColumns, Model::kColumns);
  Vector right = Vector::Zero(Model::kColumns);
  Matrix prior;
  const AdoptedTable<Model>& adopted;
  explicit PlainForgetting(const Table<Model>& table, const AdoptedTable<Model>& i) : adopted(i) {
    prior = PriorCovariance<Model>(table);
  }
  void Add(const model::Sample<Model::kJoints>& s, const Vector& b0, double lambda) {
    const Matrix y = Regressor<Model>(s);
    for (int i = 0; i < Model::kJoints; ++i) {
      if ((s.flags[i] & model::kMoving) == 0) continue;
      const Vector h = y.row(i).transpose() / adopted.sigma_Nm[i];
      information += h * h.transpose();
      right += h * ((s.tau[i] - y.row(i) * b0) / adopted.sigma_Nm[i]);
    }
    information *= lambda;
    right *= lambda;
  }
  Vector Solve(const Vector& b0) const {
    // (P^-1 + A)^-1 r = P (1 + A P)^-1 r, so that a column without prior variance stays.
    const Matrix a = Matrix::Identity(Model::kColumns, Model::kColumns) + information * prior;
    return b0 + prior * a.partialPivLu().solve(right);
  }
};

// Noise-free torque error over two seconds of motion, in the table's noise, all joints together.
template <class Model>
double TorqueError(MovingArm<Model> arm, const AdoptedTable<Model>& adopted, const Vector& value) {
  double sum = 0;
  for (int k = 0; k < 2 * kPerSecond; ++k) {
    const Matrix y = Regressor<Model>(arm.Next());
    for (int i = 0; i < Model::kJoints; ++i) sum += std::pow(y.row(i).dot(value - arm.truth) / adopted.sigma_Nm[i], 2);
  }
  return std::sqrt(sum / (2 * kPerSecond * Model::kJoints));
}

template <class Model>
struct Load : testing::Test {};
using Models = testing::Types<TwoLink, SixAxis>;
TYPED_TEST_SUITE(Load, Models);

// One arm, learned by the filter and by plain forgetting beside it.
template <class Model>
struct Racing {
  static constexpr float kLambda = 0.998f;  // four seconds
  static constexpr std::uint32_t kLast = MovingArm<Model>::kAll & ~((1u << Model::kJoints / 2) - 1u);
  std::unique_ptr<Host<Model, filter::ForgettingFilter<Model>>> host =
      std::make_unique<Host<Model, filter::ForgettingFilter<Model>>>();
  std::unique_ptr<PlainForgetting<Model>> plain;
  MovingArm<Model> arm;
  Vector b0;
  Racing() {
    for (float& lambda : host->table.forgetting) lambda = kLambda;
    EXPECT_EQ(host->Adopt(), Status::kOk);
    b0 = host->b0();
    plain = std::make_unique<PlainForgetting<Model>>(host->table, host->adopted);
  }
  void Move(int seconds, std::uint32_t moving) {
    for (int k = 0; k < seconds * kPerSecond; ++k) {
      const auto s = arm.Next(moving);
      ASSERT_EQ(host->Feed(s), Status::kOk);
      plain->Add(s, b0, kLambda);
    }
  }
  double OurError() {
    const Eigen::VectorXf value = Eigen::Map<const Eigen::VectorXf>(host->Read().value, Model::kColumns);
    return TorqueError<Model>(arm, host->adopted, value.template cast<double>());
  }
  double PlainError() { return TorqueError<Model>(arm, host->adopted, plain->Solve(b0)); }
  // Both errors, summed over half a minute of which all joints move.
  std::pair<double, double> Relearn() {
    double ours = 0, others = 0;
    for (int second = 0; second < 30; ++second) {
      Move(1, arm.kAll);
      ours += OurError(), others += PlainError();
    }
    return {ours, others};
  }
};

TYPED_TEST(Load, PickedUpInMotion_IsLearnedAsFastAsByPlainForgetting) {
  Racing<TypeParam> race;
  race.Move(30, race.arm.kAll);
  race.Move(20, race.kLast);  // what rests forgets nothing, which must not make it slow afterwards
  race.Move(10, race.arm.kAll);
  const double before = race.OurError();
  race.arm.PickUp(10);
  EXPECT_GT(race.OurError(), 10 * before);
  const auto [ours, plain] = race.Relearn();
  EXPECT_LT(ours, 1.1 * plain);
}

// What rests forgets nothing, of the old load either. The innovations of the others tell of the new one; a reset of the
// bodies then takes it out of what the resting joints know, too.
TYPED_TEST(Load, PickedUpWhileTheFirstJointsRest_ShowsAtOnce_AndAResetOfTheBodiesFollowsIt) {
  Racing<TypeParam> race;
  race.Move(30, race.arm.kAll);
  race.Move(5, race.kLast);
  ASSERT_FALSE(race.host->Read().inconsistent);
  race.arm.PickUp(10);
  race.Move(3, race.kLast);
  ASSERT_TRUE(race.host->Read().inconsistent);
  ASSERT_EQ(race.host->estimator.Reset(TypeParam::kJoints), Status::kOk);
  race.Move(17, race.kLast);
  const auto [ours, plain] = race.Relearn();
  EXPECT_LT(ours, 1.1 * plain);
}

}  // namespace
}  // namespace armcal::estimator

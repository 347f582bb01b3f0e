// estimator - several filters on one intake: each gives what it gives alone, and the model is evaluated once a sample.
#include <gtest/gtest.h>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "tests/unit/estimator/motion.hpp"

namespace armcal::estimator::shared_intake {
namespace {
using namespace estimator::test;  // NOLINT: the bench of these tests
using core::Status;

// The two-link arm, which counts how often its regressor is asked for.
struct CountedTwoLink : TwoLink {
  static inline int calls = 0;
  template <class T>
  static void Regressor(const model::ModelInput<T, 2>& x, const T* committed, const T* eta, const T* state, T* next,
                        T* front, T* dense) {
    ++calls;
    TwoLink::Regressor(x, committed, eta, state, next, front, dense);
  }
};
using Model = CountedTwoLink;
using Forgetting = filter::ForgettingFilter<Model>;
using Kalman = filter::KalmanFilter<Model>;
using Extended = filter::ExtendedKalmanFilter<Model>;

// Three filters on one intake.
struct Together {
  template <class Filter>
  using Shared = Estimator<Model, Filter, Intake<Model>&>;

  Table<Model> table = DefaultTable<Model>();
  physical::RigidPrior<Model, float> rigid;
  AdoptedTable<Model> adopted[2];
  Intake<Model> intake;
  Shared<Forgetting> forgetting{intake};
  Shared<Kalman> kalman{intake};
  Shared<Extended> extended{intake};

  Status Adopt(std::uint32_t generation) {
    AdoptedTable<Model>& next = adopted[generation % 2];
    const Status status = BuildAdoptedTable<Model>(table, generation, rigid, next);
    if (!core::IsOk(status)) return status;
    forgetting.Restart(next, 0);
    kalman.Restart(next, 0);
    extended.Restart(next, 0);
    intake.Adopt(next, 0);
    return status;
  }
  // One call each; budgets in elements of a column.
  bool Step(int first, int second, int third) {
    bool busy = forgetting.Step(first);
    busy |= kalman.Step(second);
    busy |= extended.Step(third);
    return busy;
  }
  void Drain() {
    while (Step(200, 50, 1000)) {
    }
  }
  template <class Filter>
  Estimates<Model> Read(Shared<Filter>& estimator) {
    Estimates<Model> estimates;
    Drain();
    estimator.RequestReadOut();
    Drain();
    estimator.Take(estimates);
    return estimates;
  }
};

template <class Filter>
Estimates<Model> Alone(const std::vector<Sample>& samples) {
  const auto host = std::make_unique<Host<Model, Filter>>();
  EXPECT_EQ(host->Adopt(1), Status::kOk);
  for (const Sample& s : samples) EXPECT_EQ(host->Feed(s), Status::kOk);
  return host->Read();
}

std::vector<Sample> Moved(int count) {
  Motion run;
  std::vector<Sample> samples;
  for (int k = 0; k < count; ++k) {
    samples.push_back(run.Next());
    if (k % 50 == 7) samples.back().flags[1] = model::kValid;  // at rest
    if (k % 70 == 9) run.tick += 16;                           // a gap
  }
  return samples;
}

TEST(SharedIntake, FiltersBesideEachOther_GiveBitForBitWhatEachGivesAlone) {
  const std::vector<Sample> samples = Moved(600);
  const auto arm = std::make_unique<Together>();
  ASSERT_EQ(arm->Adopt(1), Status::kOk);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    ASSERT_EQ(arm->intake.PushSample(samples[k]), Status::kOk);
    for (int call = 0; call < 1000 && arm->Step(300, 10, k % 3 == 0 ? 1 : 4000); ++call) {
      if (call > 5 && arm->intake.pending() < 8) break;  // they need not be done before the next one comes
    }
  }
  EXPECT_EQ(Bits(arm->Read(arm->forgetting)), Bits(Alone<Forgetting>(samples)));
  EXPECT_EQ(Bits(arm->Read(arm->kalman)), Bits(Alone<Kalman>(samples)));
  EXPECT_EQ(Bits(arm->Read(arm->extended)), Bits(Alone<Extended>(samples)));
}

// The extended filter asks once more, because it linearises at an estimate of its own.
TEST(SharedIntake, TheRegressorIsEvaluatedOnceASample_AndOnceForEachExtendedFilter) {
  const std::vector<Sample> samples = Moved(100);
  const auto arm = std::make_unique<Together>();
  ASSERT_EQ(arm->Adopt(1), Status::kOk);
  Model::calls = 0;
  for (const Sample& s : samples) {
    ASSERT_EQ(arm->intake.PushSample(s), Status::kOk);
    arm->Drain();
  }
  EXPECT_EQ(Model::calls, 2 * 100);
  Model::calls = 0;
  Alone<Kalman>(samples);
  EXPECT_EQ(Model::calls, 100);
}

TEST(SharedIntake, AFilterThatIsBehind_LosesNoSample) {
  const std::vector<Sample> samples = Moved(12);
  const auto arm = std::make_unique<Together>();
  ASSERT_EQ(arm->Adopt(1), Status::kOk);
  arm->Drain();
  for (const Sample& s : samples) ASSERT_EQ(arm->intake.PushSample(s), Status::kOk);
  while (arm->forgetting.Step()) {  // ends when it would need the next sample
  }
  EXPECT_EQ(arm->intake.pending(), 11u);
  for (Estimates<Model> e : {arm->Read(arm->forgetting), arm->Read(arm->kalman), arm->Read(arm->extended)})
    EXPECT_EQ(e.samples, 12u);
}

// However far each filter has come with the sample in work.
TEST(SharedIntake, AnAdoption_StartsAllFiltersAsIfNothingHadBeen) {
  const std::vector<Sample> samples = Moved(40);
  const Estimates<Model> alone = Alone<Kalman>(samples);
  const auto arm = std::make_unique<Together>();
  for (int calls = 0; calls < 120; calls += 7) {
    const auto generation = static_cast<std::uint32_t>(2 * calls + 1);
    ASSERT_EQ(arm->Adopt(generation), Status::kOk);
    arm->Drain();
    for (int k = 0; k < 3; ++k) ASSERT_EQ(arm->intake.PushSample(samples[k]), Status::kOk);
    for (int k = 0; k < calls; ++k) arm->Step(1, 20, 100);
    ASSERT_EQ(arm->Adopt(generation + 1), Status::kOk);
    for (const Sample& s : samples) {
      ASSERT_EQ(arm->intake.PushSample(s), Status::kOk);
      arm->Drain();
    }
    Estimates<Model> e = arm->Read(arm->kalman);
    e.stale = alone.stale, e.generation = alone.generation;
    EXPECT_EQ(Bits(e), Bits(alone)) << calls;
  }
}

}  // namespace
}  // namespace armcal::estimator::shared_intake

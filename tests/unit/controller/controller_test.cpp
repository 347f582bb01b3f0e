// controller - a whole controller without a bus: what it does, and what it refuses.
#include "armcal/controller/controller.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "port/mps2/application/pretend_axes.hpp"
#include "tests/unit/table/nor_flash.hpp"

namespace {

using namespace armcal;
using core::Status;
using Model = generated::Er20Like;
using Axes = application::PretendAxes<Model>;
namespace reg = link::reg;

constexpr int n = Model::kJoints;
constexpr std::uint32_t kAllAxes = (1u << n) - 1;

// A controller in front of axes that are as its model says, and a client without a wire.
template <class... Filters>
struct Bench {
  Bench() { booted = controller.Boot(); }

  void Run(int ticks) {
    for (; ticks > 0; --ticks, ++now) {
      model::RawSample<n> raw;
      controller::SetPoint<n> set;
      (void)axes.Read(now, raw, set);
      const int sign = now / Model::kSampleTicks % 2 == 0 ? 1 : -1;  // from sample to sample
      for (std::int16_t& current : raw.current) current = static_cast<std::int16_t>(current + sign * disturbance_LSB);
      torque = controller.FeedForward(set, raw.temperature_degC, tau_Nm);
      ASSERT_EQ(controller.Push(raw), Status::kOk);
      Idle();
    }
  }
  void Idle() {  // an adoption that stays refused would keep it busy until a time-out
    for (int k = 0; k < 100000 && controller.Step(); ++k) {
    }
  }

  Status Write(std::uint16_t first, std::vector<std::uint16_t> words) {
    return controller.map().Write(first, static_cast<std::uint16_t>(words.size()), words.data());
  }
  std::vector<std::uint16_t> Read(link::RegisterKind kind, std::uint16_t first, std::uint16_t count) {
    std::vector<std::uint16_t> words(count);
    EXPECT_EQ(controller.map().Read(kind, first, count, words.data()), Status::kOk);
    return words;
  }
  std::uint16_t Of(std::uint16_t status_register) { return Read(link::RegisterKind::kInput, status_register, 1)[0]; }
  std::uint32_t RowsUsed() { return core::GetU32(Read(link::RegisterKind::kInput, 0x0060, 2).data()); }
  void Unlock() { ASSERT_EQ(Write(reg::kUnlock, Halves({reg::kUnlockKey})), Status::kOk); }

  static std::vector<std::uint16_t> Halves(std::initializer_list<std::uint32_t> numbers) {
    std::vector<std::uint16_t> words;
    for (const std::uint32_t x : numbers) {
      words.push_back(static_cast<std::uint16_t>(x >> 16));
      words.push_back(static_cast<std::uint16_t>(x));
    }
    return words;
  }
  Status Command(std::uint32_t command, std::uint32_t crc) {
    std::vector<std::uint16_t> words = Halves({++sequence, command, Model::kSchema});
    for (const std::uint16_t w : {kWords, std::uint16_t{0}}) words.push_back(w);
    for (const std::uint16_t w : Halves({crc})) words.push_back(w);
    return Write(reg::kCommand, words);
  }
  // Status of the first step that is refused; kOk: stored, and adopted as far as the status registers say.
  Status Flash(const estimator::Table<Model>& table) {
    std::vector<std::uint16_t> words(kWords);
    model::Encode(table, words.data());
    Unlock();
    if (const Status opened = Command(reg::kOpen, 0); !core::IsOk(opened)) return opened;
    for (std::uint16_t i = 0; i < kWords; ++i)
      if (const Status s = Write(static_cast<std::uint16_t>(reg::kStaged + i), {words[i]}); !core::IsOk(s)) return s;
    std::uint32_t crc = 0;
    for (const std::uint16_t w : words) {
      const std::uint8_t bytes[2] = {static_cast<std::uint8_t>(w >> 8), static_cast<std::uint8_t>(w)};
      crc = core::Crc32(bytes, 2, crc);
    }
    if (const Status checked = Command(reg::kCheck, crc); !core::IsOk(checked)) return checked;
    const Status saved = Command(reg::kSave, crc);
    Idle();
    return saved;
  }

  static constexpr std::uint16_t kWords = estimator::Table<Model>::kWords;
  test::NorFlash flash{{2, 16384, 8, 0xFF}};
  std::uint32_t now = 0, sequence = 0;
  port::Clock clock{&now, [](void* t) { return *static_cast<std::uint32_t*>(t); },
                    [](void* t) { return *static_cast<std::uint32_t*>(t); }};
  Axes axes;
  controller::Controller<Model, Filters...> controller{flash.storage(), clock};
  Status booted = Status::kOk, torque = Status::kOk;
  float tau_Nm[n] = {};
  int disturbance_LSB = 0;
};

using Forgetting = filter::ForgettingFilter<Model>;
using Block = filter::KalmanFilter<Model, filter::Form::kBlock>;
constexpr std::uint16_t kFeedForwardState = 0x0043, kGeneration = 0x0045, kHealth = 0x005F;

TEST(Controller, WithoutAStoredTable_LearnsFromTheDefaultsAndFeedsNothingForward) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  EXPECT_EQ(bench->booted, Status::kBlank);
  bench->Run(2000);
  EXPECT_EQ(bench->torque, Status::kEmpty);
  EXPECT_EQ(bench->Of(kFeedForwardState), 0);
  EXPECT_GT(bench->RowsUsed(), 0u);
}

TEST(Controller, ATableFlashed_IsInForceAndStaysSoAfterPowerUp) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  ASSERT_EQ(bench->Flash(estimator::DefaultTable<Model>()), Status::kOk);
  bench->Run(1);
  EXPECT_EQ(bench->torque, Status::kOk);
  EXPECT_EQ(bench->Of(kFeedForwardState), 1);
  EXPECT_EQ(bench->Of(kGeneration), 2);
  EXPECT_EQ(bench->controller.adopted().committed.generation, 2u);

  controller::Controller<Model, Forgetting> again(bench->flash.storage(), bench->clock);
  EXPECT_EQ(again.Boot(), Status::kOk);
  EXPECT_EQ(again.generation(), 1u);
}

TEST(Controller, WhileAxesAreEnabled_AdoptsABumplessTableOnly) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  bench->controller.SetEnabledAxes(kAllAxes);
  auto table = estimator::DefaultTable<Model>();
  EXPECT_EQ(bench->Flash(table), Status::kAxisEnabled);
  EXPECT_EQ(bench->controller.generation(), 1u);
  table.flags |= model::kFlagBumpless;
  EXPECT_EQ(bench->Flash(table), Status::kOk);
  EXPECT_EQ(bench->controller.generation(), 2u);
}

TEST(Controller, ATableThatAFilterCannotHold_IsRefusedAndNothingChanges) {
  const auto bench = std::make_unique<Bench<Forgetting, Block>>();
  auto table = estimator::DefaultTable<Model>();
  for (int k = 0; k < Model::kBodyParameters; ++k)  // links that are not to be learnt, only allowed for
    table.parameter[k].state = model::ParameterState::kConsidered;
  EXPECT_EQ(bench->Flash(table), Status::kOutOfRange);
  EXPECT_EQ(bench->controller.generation(), 1u);
}

TEST(Controller, OnHold_UsesNoRowUntilReleased) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  EXPECT_EQ(bench->Write(reg::kLearningHold, {1}), Status::kLocked);
  bench->Unlock();
  ASSERT_EQ(bench->Write(reg::kLearningHold, {1}), Status::kOk);
  bench->Run(3000);
  EXPECT_EQ(bench->RowsUsed(), 0u);
  ASSERT_EQ(bench->Write(reg::kLearningHold, {0}), Status::kOk);
  bench->Run(3000);
  EXPECT_GT(bench->RowsUsed(), 0u);
}

TEST(Controller, AJointReset_IsAsUncertainAsBeforeIt) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  const auto deviations = [&] {
    bench->controller.estimator<0>().RequestReadOut();
    bench->Idle();
    std::vector<float> sd;
    const auto words = bench->Read(link::RegisterKind::kInput, reg::kDeviationA, 2 * Model::kFrontBegin[3]);
    for (std::size_t k = 0; k < words.size(); k += 2) sd.push_back(core::GetF32(&words[k]));
    return sd;
  };
  const auto before = deviations();
  bench->Run(8000);
  const auto learnt = deviations();
  bench->Unlock();
  ASSERT_EQ(bench->Write(reg::kLearningReset, {2}), Status::kOk);
  const auto after = deviations();
  for (int k = 0; k < Model::kFrontBegin[3]; ++k) {
    if (!(before[k] > 0.0f)) continue;  // not estimated
    const bool reset = k >= Model::kFrontBegin[1] && k < Model::kFrontBegin[2];
    EXPECT_LT(learnt[k], 0.5f * before[k]) << k;
    EXPECT_NEAR(after[k] / (reset ? before[k] : learnt[k]), 1.0f, reset ? 0.01f : 0.05f) << k;
  }
}

TEST(Controller, ATraceThatAClientArms_HoldsWhatTheTickWasGiven) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  const auto trace = std::make_unique<controller::RawTrace<Model, 8192>>();
  const auto capabilities = [&] {
    return core::GetU32(bench->Read(link::RegisterKind::kInput, reg::kIdentity + 20, 2).data());
  };
  EXPECT_EQ(capabilities() & reg::kHasRawTrace, 0u);
  ASSERT_EQ(bench->controller.Record(*trace), Status::kOk);
  EXPECT_EQ(capabilities() & reg::kHasRawTrace, reg::kHasRawTrace);
  EXPECT_EQ(bench->controller.Record(*trace), Status::kBadAddress);  // once
  bench->Run(50);                                                    // nobody has asked
  EXPECT_EQ(bench->Read(link::RegisterKind::kInput, reg::kTracePage[0] + 6, 1)[0], 0);

  const std::uint32_t channels = controller::kRawAll, start = bench->now + 10;
  constexpr std::uint16_t kTicks = 3;               // a record, so that a mean has to be rounded
  std::vector<std::uint16_t> arm{7, 2, kTicks, 0};  // streaming
  for (const std::uint16_t half : bench->Halves({start, 0, channels})) arm.push_back(half);
  ASSERT_EQ(bench->Write(reg::kTraceArm[0], arm), Status::kOk);
  bench->Run(10 + 3 * kTicks);
  const auto header = bench->Read(link::RegisterKind::kInput, reg::kTracePage[0], reg::kPageHeaderCount);
  EXPECT_EQ(core::GetU32(&header[2]), start);
  EXPECT_EQ(header[6], 3);
  ASSERT_EQ(header[7], 11 * n);
  const auto words = bench->Read(link::RegisterKind::kInput, reg::kTracePage[0] + reg::kPageData, 3 * 11 * n);
  for (int record = 0; record < 3; ++record)
    for (int j = 0; j < n; ++j) {
      double counts = 0, current = 0, told = 0;
      for (std::uint32_t k = 0; k < kTicks; ++k) {
        model::RawSample<n> raw;
        controller::SetPoint<n> set;
        (void)bench->axes.Read(start + kTicks * record + k, raw, set);
        counts += raw.counts[j], current += raw.current[j], told += static_cast<double>(set.q[j]);
      }
      const std::uint16_t* w = &words[11 * (n * record + j)];
      EXPECT_NEAR(static_cast<std::int32_t>(core::GetU32(w)) / 16.0, counts / kTicks, 1.0 / 32);
      EXPECT_NEAR(static_cast<std::int32_t>(core::GetU32(w + 2)) / 16.0, current / kTicks, 1.0 / 32);
      EXPECT_EQ(w[6], model::kEnabled);
      EXPECT_NEAR(core::GetF32(w + 7), told / kTicks, 1e-6);
      EXPECT_EQ(core::GetF32(w + 9), 0.0f);  // no table: no feed-forward
    }
}

TEST(Controller, NoiseFarBeyondTheTables_IsServedAsTheFiltersHealth) {
  const auto bench = std::make_unique<Bench<Forgetting, Block>>();
  bench->Run(9000);
  EXPECT_EQ(bench->Of(kHealth), 0);
  bench->disturbance_LSB = 3000;
  bench->Run(9000);
  EXPECT_EQ(bench->Of(kHealth), 3);
}

TEST(Controller, FiltersBesideEachOther_GiveBitForBitWhatEachGivesAlone) {
  const auto both = std::make_unique<Bench<Forgetting, Block>>();
  const auto first = std::make_unique<Bench<Forgetting>>();
  const auto second = std::make_unique<Bench<Block>>();
  const auto work = [](auto& bench) {
    bench.Run(4000);
    bench.controller.template estimator<0>().RequestReadOut();
    bench.Idle();
  };
  work(*first);
  work(*second);
  both->Run(4000);
  both->controller.estimator<0>().RequestReadOut();
  both->controller.estimator<1>().RequestReadOut();
  both->Idle();
  const auto floats = [](auto& bench, std::uint16_t first_register) {
    std::vector<std::uint16_t> words;
    for (int k = 0; k < 2 * Model::kColumns; k += 2)
      for (const std::uint16_t w :
           bench.Read(link::RegisterKind::kInput, static_cast<std::uint16_t>(first_register + k), 2))
        words.push_back(w);
    return words;
  };
  EXPECT_EQ(floats(*both, reg::kEstimateA), floats(*first, reg::kEstimateA));
  EXPECT_EQ(floats(*both, reg::kDeviationA), floats(*first, reg::kDeviationA));
  EXPECT_EQ(floats(*both, reg::kEstimateB), floats(*second, reg::kEstimateA));
  EXPECT_EQ(floats(*both, reg::kDeviationB), floats(*second, reg::kDeviationA));
}

// The example arm, which counts how often its regressor is asked for.
struct CountedModel : Model {
  static inline int calls = 0;
  template <class T>
  static void Regressor(const model::ModelInput<T, n>& x, const T* committed, const T* eta, const T* state, T* next,
                        T* front, T* dense) {
    ++calls;
    Model::Regressor(x, committed, eta, state, next, front, dense);
  }
};

TEST(Controller, WithTwoFilters_EvaluatesTheModelOnceASample) {
  using Two = controller::Controller<CountedModel, filter::ForgettingFilter<CountedModel>,
                                     filter::KalmanFilter<CountedModel, filter::Form::kBlock>>;
  test::NorFlash flash{{2, 16384, 8, 0xFF}};
  std::uint32_t now = 0;
  const auto count = [](void* t) { return *static_cast<std::uint32_t*>(t); };
  const auto two = std::make_unique<Two>(flash.storage(), port::Clock{&now, count, count});
  EXPECT_EQ(two->Boot(), Status::kBlank);
  Axes axes;
  CountedModel::calls = 0;
  for (; now < 800; ++now) {
    model::RawSample<n> raw;
    controller::SetPoint<n> set;
    (void)axes.Read(now, raw, set);
    ASSERT_EQ(two->Push(raw), Status::kOk);
    while (two->Step()) {
    }
  }
  EXPECT_EQ(CountedModel::calls, 800 / 8 - 4);  // a sample is the middle one of five averages
}

}  // namespace

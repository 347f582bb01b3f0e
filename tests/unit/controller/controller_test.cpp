// controller - a whole controller without a bus: it does what a drive does and refuses what a drive must refuse.
#include "armcal/controller/controller.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <vector>

#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "tests/unit/controller/bench.hpp"
#include "tests/unit/table/nor_flash.hpp"

namespace {

using namespace armcal;
using core::Status;
using test::Bench;
using Model = generated::Er20Like;
using Axes = application::PretendAxes<Model>;
namespace reg = link::reg;

constexpr int n = Model::kJoints;
constexpr std::uint32_t kAllAxes = (1u << n) - 1;

using Forgetting = filter::ForgettingFilter<Model>;
using Block = filter::KalmanFilter<Model, filter::Form::kBlock>;

TEST(Controller, WithoutAStoredTable_LearnsFromTheDefaultsAndFeedsNothingForward) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  EXPECT_EQ(bench->booted, Status::kBlank);
  bench->Run(2000);
  EXPECT_EQ(bench->torque, Status::kEmpty);
  EXPECT_EQ((bench->Value<reg::kFeedForwardState>()), 0);
  EXPECT_GT(bench->Value<reg::kRowsUsedA>(), 0u);
}

// One tick with a count that is far off, and later ten ticks with a wrong torque: a register counts each.
TEST(Controller, WhatIsRefused_IsServedInRegisters) {
  const auto bench = std::make_unique<Bench<Forgetting, Block>>();
  bench->Run(4000);
  EXPECT_EQ((bench->Read<reg::kDoubtBlock>().template Get<reg::kImplausibleTicks>()), 0u);
  const auto push = [&](auto change) {
    model::RawSample<n> raw;
    controller::SetPoint<n> set;
    (void)bench->axes.Read(bench->now, raw, set);
    change(raw);
    ASSERT_EQ(bench->controller.Push(raw), Status::kOk);
    ++bench->now;
    bench->Idle();
  };
  push([](auto& raw) { raw.counts[1] ^= 1 << 20; });
  bench->Run(999);
  for (int k = 0; k < 10; ++k)
    push([](auto& raw) { raw.current[1] = static_cast<std::int16_t>(raw.current[1] + 4000); });
  bench->Run(2000);
  const auto doubt = bench->Read<reg::kDoubtBlock>();
  EXPECT_EQ(doubt.template Get<reg::kImplausibleTicks>(), 1u);
  EXPECT_GT(doubt.template Get<reg::kRowsOutsideA>(), 0u);
  EXPECT_LE(doubt.template Get<reg::kRowsOutsideA>(), 6u);
  EXPECT_EQ(doubt.template Get<reg::kRowsOutsideB>(), doubt.template Get<reg::kRowsOutsideA>());
  EXPECT_EQ(doubt.template Get<reg::kTableFallbacks>(), 0u);
}

TEST(Controller, ATableFlashed_IsInForceAndStaysSoAfterPowerUp) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  ASSERT_EQ(bench->Flash(estimator::DefaultTable<Model>()), Status::kOk);
  bench->Run(1);
  EXPECT_EQ(bench->torque, Status::kOk);
  EXPECT_EQ((bench->Value<reg::kFeedForwardState>()), 1);
  EXPECT_EQ((bench->Value<reg::kGeneration>()), 2u);
  EXPECT_EQ(bench->controller.adopted().committed.generation, 2u);

  controller::Controller<Model, Forgetting> again(bench->flash.storage(), bench->clock);
  EXPECT_EQ(again.Boot(), Status::kOk);
  EXPECT_EQ(again.generation(), 1u);
}

// The filters restart one after the other, and work on no sample in between.
TEST(Controller, AfterAFlash_BothFiltersBeginAnew) {
  const auto bench = std::make_unique<Bench<Forgetting, Block>>();
  bench->Run(4000);
  const std::uint32_t before = bench->Value<reg::kRowsUsedB>();
  ASSERT_EQ(bench->Flash(estimator::DefaultTable<Model>()), Status::kOk);
  bench->Run(2000);
  EXPECT_GT(bench->Value<reg::kRowsUsedB>(), 0u);
  EXPECT_LT(bench->Value<reg::kRowsUsedB>(), before);
  EXPECT_EQ(bench->Value<reg::kRowsUsedB>(), bench->Value<reg::kRowsUsedA>());
}

// What check has built waits for save. A table that was checked and left, or refused, must not be adopted in its place.
TEST(Controller, OfTablesCheckedOneAfterTheOther_TheOneThatIsSavedComesIntoForce) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  const auto table = [](float sigma_Nm) {
    auto t = estimator::DefaultTable<Model>();
    t.joint[0].sigma_Nm = sigma_Nm;
    return t;
  };
  ASSERT_EQ(bench->Flash(table(1.0f)), Status::kOk);
  std::uint32_t crc = 0;
  ASSERT_EQ(bench->Check(table(2.0f), crc), Status::kOk);
  EXPECT_EQ(bench->controller.adopted().sigma_Nm[0], 1.0f) << "checked is not adopted";
  auto unphysical = table(3.0f);
  unphysical.parameter[2 * model::kBodyBlock + model::kIxx].mean = 1e-6f;  // Iyy and Izz are not alike
  EXPECT_EQ(bench->Check(unphysical, crc), Status::kUnphysical);
  EXPECT_EQ(bench->Command(reg::kSave, crc), Status::kWrongOrder);
  ASSERT_EQ(bench->Check(table(4.0f), crc), Status::kOk);
  ASSERT_EQ(bench->Check(table(5.0f), crc), Status::kOk);
  ASSERT_EQ(bench->Command(reg::kSave, crc), Status::kOk);
  bench->Idle();
  EXPECT_EQ(bench->controller.adopted().sigma_Nm[0], 5.0f);
  EXPECT_EQ(bench->controller.generation(), 3u);  // the defaults, and two tables
  EXPECT_EQ(core::GetF32(&bench->Read(SpanOf(reg::kActiveTable, Bench<Forgetting>::kWords))[model::kHeaderWords]),
            5.0f);

  controller::Controller<Model, Forgetting> again(bench->flash.storage(), bench->clock);
  ASSERT_EQ(again.Boot(), Status::kOk);
  EXPECT_EQ(again.adopted().sigma_Nm[0], 5.0f);
}

TEST(Controller, WhileAxesAreEnabled_AdoptsABumplessTableOnly) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  bench->controller.SetEnabledAxes(kAllAxes);
  auto table = estimator::DefaultTable<Model>();
  EXPECT_EQ(bench->Flash(table), Status::kAxisEnabled);
  EXPECT_EQ(bench->controller.generation(), 1u);
  table.flags |= model::kFlagBumpless;
  EXPECT_EQ(bench->Flash(table), Status::kBeyondCeiling) << "without a fade";
  table.blend_ms = 500;
  EXPECT_EQ(bench->Flash(table), Status::kOk);
  EXPECT_EQ(bench->controller.generation(), 2u);
}

// The background adopts a table while all axes are disabled. Then, before the next tick, an axis is enabled.
TEST(Controller, ATableAdoptedJustBeforeAnAxisIsEnabled_FadesOverTheLeastTime) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  auto table = estimator::DefaultTable<Model>();
  ASSERT_EQ(bench->Flash(table), Status::kOk);
  const controller::SetPoint<n> outstretched = {};
  const float degC[n] = {30, 30, 30, 30, 30, 30};
  float before[n], after[n];
  const auto torque = [&](float* tau) { return bench->controller.FeedForward(outstretched, degC, tau); };
  ASSERT_EQ(torque(before), Status::kOk);
  ASSERT_GT(std::abs(before[1]), 100.0f) << "gravity";
  table.joint[1].torque_limit_Nm = 10.0f;
  ASSERT_EQ(bench->Flash(table), Status::kOk);
  bench->controller.SetEnabledAxes(kAllAxes);
  constexpr auto kTicks = static_cast<float>(Model::kCeilings.table.least_fade_ms);  // of 1 ms
  const float most = (std::abs(before[1]) + 10.0f) / kTicks;
  for (int tick = 0; tick < 2000; ++tick) {
    (void)torque(after);
    ASSERT_LE(std::abs(after[1] - before[1]), most * 1.001f) << "tick " << tick;
    before[1] = after[1];
  }
  EXPECT_FLOAT_EQ(std::abs(after[1]), 10.0f);
}

TEST(Controller, OnABoardThatDoesNotAllowIt_RefusesABumplessTable) {
  test::NorFlash flash{{2, 16384, 8, 0xFF}};
  std::uint32_t now = 0;
  const auto count = [](void* t) { return *static_cast<std::uint32_t*>(t); };
  auto table = estimator::DefaultTable<Model>();
  table.flags = model::kFlagBumpless, table.blend_ms = 500;
  std::vector<std::uint16_t> words(Bench<Forgetting>::kWords);
  model::Encode(table, words.data());
  table::TableStore store(flash.storage(), Model::kSchema, Bench<Forgetting>::kWords);
  std::vector<std::uint16_t> unused(words.size());
  ASSERT_EQ(store.Load(unused.data()), Status::kBlank);
  ASSERT_EQ(store.Save(words.data()), Status::kOk);
  while (store.Step() == Status::kBusy) {
  }
  const auto drive =
      std::make_unique<controller::Controller<Model, Forgetting>>(flash.storage(), hardware::Clock{&now, count, count});
  EXPECT_EQ(drive->Boot(), Status::kForbidden) << "not even from storage";
}

// Sectors of 128 KB, which take two seconds to erase. The driver answers kBusy meanwhile.
TEST(Controller, ASaveWhoseEraseTakesTwoSeconds_LosesNoSample) {
  constexpr int kSteps = 4, kErase_ticks = 2000;
  const auto bench = std::make_unique<Bench<Forgetting>>(
      Bench<Forgetting>::Rules(), link::Identity{}, test::NorFlash({2, 131072, 8, 0xFF, 0, kSteps * kErase_ticks}));
  auto table = estimator::DefaultTable<Model>();
  ASSERT_EQ(bench->Flash(table), Status::kOk);
  bench->steps = kSteps;
  bench->Run(1000);
  table.joint[0].sigma_Nm *= 1.5f;
  std::uint32_t crc = 0;
  ASSERT_EQ(bench->Check(table, crc), Status::kOk);
  ASSERT_EQ(bench->Command(reg::kSave, crc), Status::kOk);
  const std::uint32_t used = bench->Value<reg::kRowsUsedA>();
  int ticks = 0;
  for (; bench->Value<reg::kTransactionState>() == static_cast<int>(link::TransactionState::kCommitting); ++ticks) {
    ASSERT_LT(ticks, 2 * kErase_ticks);
    bench->Run(1);
    if (ticks == kErase_ticks - 200) {
      EXPECT_GT(bench->Value<reg::kRowsUsedA>(), used) << "it learns meanwhile";
    }
  }
  EXPECT_GE(ticks, kErase_ticks);
  EXPECT_EQ(bench->Value<reg::kSampleGaps>(), 0u);
  EXPECT_EQ(bench->controller.estimator<0>().tick_gaps(), 0u);
  EXPECT_EQ(bench->controller.adopted().sigma_Nm[0], table.joint[0].sigma_Nm);
  EXPECT_FALSE(bench->flash.misused());
}

// The board allows five saves, then one a minute.
TEST(Controller, Saves_AreAllowedInABurstAndThenOneAMinute) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  const auto save = [&] { return bench->Flash(estimator::DefaultTable<Model>()); };
  for (int k = 0; k < 5; ++k) ASSERT_EQ(save(), Status::kOk) << k;
  EXPECT_EQ(save(), Status::kTooSoon);
  EXPECT_EQ(bench->controller.generation(), 6u);
  EXPECT_EQ((bench->Value<reg::kSaveWait>()), 60);
  bench->now += 59999;
  bench->Idle();
  EXPECT_EQ(save(), Status::kTooSoon);
  bench->now += 1;
  bench->Idle();
  EXPECT_EQ((bench->Value<reg::kSaveWait>()), 0);
  EXPECT_EQ(save(), Status::kOk);
  EXPECT_EQ(save(), Status::kTooSoon);
  for (int minute = 0; minute < 20; ++minute) {
    bench->now += 60000;
    bench->Idle();
  }
  for (int k = 0; k < 5; ++k) EXPECT_EQ(save(), Status::kOk) << "after a pause a burst again, and no more";
  EXPECT_EQ(save(), Status::kTooSoon);
}

TEST(Controller, ATableThatAFilterCannotHold_IsRefusedAndNothingChanges) {
  const auto bench = std::make_unique<Bench<Forgetting, Block>>();
  auto table = estimator::DefaultTable<Model>();
  for (int k = 0; k < Model::kBodyParameters; ++k)  // the links are not learnt, only considered
    table.parameter[k].state = model::ParameterState::kConsidered;
  EXPECT_EQ(bench->Flash(table), Status::kOutOfRange);
  EXPECT_EQ(bench->controller.generation(), 1u);
}

TEST(Controller, OnHold_UsesNoRowUntilReleased) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  EXPECT_EQ(bench->WriteValue<reg::kLearningHold>(1), Status::kLocked);
  bench->Unlock();
  ASSERT_EQ(bench->WriteValue<reg::kLearningHold>(1), Status::kOk);
  bench->Run(3000);
  EXPECT_EQ(bench->Value<reg::kRowsUsedA>(), 0u);
  ASSERT_EQ(bench->WriteValue<reg::kLearningHold>(0), Status::kOk);
  bench->Run(3000);
  EXPECT_GT(bench->Value<reg::kRowsUsedA>(), 0u);
}

TEST(Controller, AJointReset_IsAsUncertainAsBeforeIt) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  const auto deviations = [&] {
    bench->controller.estimator<0>().RequestReadOut();
    bench->Idle();
    std::vector<float> sd;
    const auto words = bench->Read(SpanOf(reg::kDeviationA, Model::kFrontBegin[3]));
    for (std::size_t k = 0; k < words.size(); k += 2) sd.push_back(core::GetF32(&words[k]));
    return sd;
  };
  const auto before = deviations();
  bench->Run(8000);
  const auto learnt = deviations();
  bench->Unlock();
  ASSERT_EQ(bench->WriteValue<reg::kLearningReset>(2), Status::kOk);
  const auto after = deviations();
  for (int k = 0; k < Model::kFrontBegin[3]; ++k) {
    if (!(before[k] > 0.0f)) continue;  // not estimated
    const bool reset = k >= Model::kFrontBegin[1] && k < Model::kFrontBegin[2];
    EXPECT_LT(learnt[k], 0.5f * before[k]) << k;
    EXPECT_NEAR(after[k] / (reset ? before[k] : learnt[k]), 1.0f, reset ? 0.01f : 0.05f) << k;
  }
}

TEST(Controller, WithBothFiltersAndTraces_HasRoomForEightBlocksOfTheIntegrator) {
  const auto bench = std::make_unique<Bench<Forgetting, Block>>();
  const auto raw = std::make_unique<controller::RawTrace<Model, 8192>>();
  const auto words = [](void*, std::uint32_t channels) { return controller::SampleRecordWords<n>(channels); };
  const auto samples = std::make_unique<link::TraceRing<>>(Model::kSampleTicks, words, nullptr);
  ASSERT_EQ(bench->controller.Record(*raw), Status::kOk);
  ASSERT_EQ(samples->Serve(bench->controller.map(), 1), Status::kOk);
  for (int k = 0; k < 8; ++k) {
    link::Block own{};
    own.kind = link::RegisterKind::kInput;
    own.first = static_cast<std::uint16_t>(reg::kVendor + k), own.count = 1;
    EXPECT_EQ(bench->controller.map().Add(own), Status::kOk) << k;
  }
}

TEST(Controller, ATraceThatAClientStarts_HoldsWhatTheTickWasGiven) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  const auto trace = std::make_unique<controller::RawTrace<Model, 8192>>();
  EXPECT_EQ(bench->Value<reg::kCapabilities>() & reg::kHasRawTrace, 0u);
  ASSERT_EQ(bench->controller.Record(*trace), Status::kOk);
  EXPECT_EQ(bench->Value<reg::kCapabilities>() & reg::kHasRawTrace, reg::kHasRawTrace);
  EXPECT_EQ(bench->controller.Record(*trace), Status::kBadAddress);  // once
  bench->Run(50);                                                    // no client has started a recording
  EXPECT_EQ(bench->Value<reg::kTraceCount>(), 0);

  const std::uint32_t start = bench->now + 10;
  constexpr std::uint16_t kTicks = 3;  // a record, so that a mean has to be rounded
  link::Words<reg::kTraceStartBlock> w;
  w.Set<reg::kTraceRecording>(std::uint16_t{7});
  w.Set<reg::kTraceMode>(link::TraceMode::kStreaming);
  w.Set<reg::kTraceDecimation>(kTicks);
  w.Set<reg::kTraceStartTick>(start);
  w.Set<reg::kTraceChannelMask>(controller::kRawAll);
  ASSERT_EQ(bench->Write(w), Status::kOk);
  bench->Run(10 + 3 * kTicks);
  const auto page = bench->Read<reg::kTracePageBlock>();
  EXPECT_EQ(page.Get<reg::kTraceFirstTick>(), start);
  EXPECT_EQ(page.Get<reg::kTraceCount>(), 3);
  ASSERT_EQ(page.Get<reg::kTraceRecordWords>(), 11 * n);
  const auto words = bench->Read(SpanOf(reg::kTraceData, 3 * 11 * n));
  for (int record = 0; record < 3; ++record)
    for (int j = 0; j < n; ++j) {
      double counts = 0, current = 0, told = 0;
      for (std::uint32_t k = 0; k < kTicks; ++k) {
        model::RawSample<n> raw;
        controller::SetPoint<n> set;
        (void)bench->axes.Read(start + kTicks * record + k, raw, set);
        counts += raw.counts[j], current += raw.current[j], told += static_cast<double>(set.q[j]);
      }
      const std::uint16_t* r = &words[11 * (n * record + j)];
      EXPECT_NEAR(static_cast<std::int32_t>(core::GetU32(r)) / 16.0, counts / kTicks, 1.0 / 32);
      EXPECT_NEAR(static_cast<std::int32_t>(core::GetU32(r + 2)) / 16.0, current / kTicks, 1.0 / 32);
      EXPECT_EQ(r[6], model::kEnabled);
      EXPECT_NEAR(core::GetF32(r + 7), told / kTicks, 1e-6);
      EXPECT_EQ(core::GetF32(r + 9), 0.0f);  // no table: no feed-forward
    }
}

// Positions, currents and states lie where SPEC.md has them.
TEST(Controller, APackedRecord_HoldsTheLowBitsOfAllJointsAndTheHighBitsOfOne) {
  const auto bench = std::make_unique<Bench<Forgetting>>();
  const auto trace = std::make_unique<controller::RawTrace<Model, 8192>>();
  ASSERT_EQ(bench->controller.Record(*trace), Status::kOk);
  EXPECT_EQ(bench->Value<reg::kCapabilities>() & reg::kHasPacked, reg::kHasPacked);
  constexpr int kWords = 2 * n + (n + 1) / 2 + 1;
  for (std::uint16_t recording = 1; recording <= 2; ++recording) {  // the second one begins anew, in another place
    const std::uint32_t start = bench->now + 10;
    link::Words<reg::kTraceStartBlock> w;
    w.Set<reg::kTraceRecording>(recording);
    w.Set<reg::kTraceMode>(link::TraceMode::kStreaming);
    w.Set<reg::kTraceDecimation>(std::uint16_t{1});
    w.Set<reg::kTraceStartTick>(start);
    w.Set<reg::kTraceChannelMask>(controller::kRawPacked);
    ASSERT_EQ(bench->Write(w), Status::kOk);
    bench->Run(10 + 2 * n + 1);
    const auto page = bench->Read<reg::kTracePageBlock>();
    ASSERT_EQ(page.Get<reg::kTraceRecordWords>(), kWords);
    ASSERT_GE(page.Get<reg::kTraceCount>(), 2 * n);
    const auto words = bench->Read(SpanOf(reg::kTraceData, 2 * n * kWords));
    for (int record = 0; record < 2 * n; ++record) {
      model::RawSample<n> raw;
      controller::SetPoint<n> set;
      (void)bench->axes.Read(start + static_cast<std::uint32_t>(record), raw, set);
      const std::uint16_t* r = &words[kWords * record];
      for (int j = 0; j < n; ++j) {
        const auto p = static_cast<std::uint32_t>(raw.counts[j]) * 16u;
        const auto current = static_cast<std::uint32_t>(4 * raw.current[j]) & 0x3FFFFu;
        const unsigned byte = j % 2 == 0 ? r[2 * n + j / 2] >> 8 : r[2 * n + j / 2] & 0xFFu;
        EXPECT_EQ(r[j], p & 0xFFFFu);
        EXPECT_EQ(r[n + j], current & 0xFFFFu);
        EXPECT_EQ(byte >> 4, p >> 16 & 0xFu);
        EXPECT_EQ(byte >> 2 & 3u, current >> 16);
        EXPECT_EQ(byte & 3u, 1u) << "enabled, and no change is out of range, record " << record;
        EXPECT_TRUE(r[kWords - 1] >> 12 != j || (r[kWords - 1] & 0xFFFu) == p >> 20);
      }
      EXPECT_EQ(r[kWords - 1] >> 12, record % n);
    }
    bench->Run(500);
  }
}

TEST(Controller, APackedRecord_MarksWhatAReaderCannotContinue) {
  controller::PackedHistory<n> history;
  const auto state = [&](std::int32_t counts, std::uint8_t flags) {
    model::RawSample<n> raw;
    raw.counts[0] = counts, raw.flags[0] = flags;
    const float nothing[n] = {};
    controller::RawRecord<n> record;
    record.Add(raw, nothing, nothing);
    std::uint16_t words[2 * n + (n + 1) / 2 + 1];
    record.WritePacked(history, words);
    return words[2 * n] >> 8 & 3;
  };
  EXPECT_EQ(state(0, model::kEnabled), 1);
  EXPECT_EQ(state(1000000, model::kEnabled), 1) << "a reader has no two values yet";
  EXPECT_EQ(state(2000000 + 32767, model::kEnabled), 1);
  EXPECT_EQ(state(3000000 + 2 * 32767 + 32768, model::kEnabled), 3);
  EXPECT_EQ(state(4000000 + 3 * 32767 + 2 * 32768 - 32768, model::kEnabled), 1);
  EXPECT_EQ(state(5000000 + 4 * 32767 + 3 * 32768 - 2 * 32768 - 32769, model::kEnabled), 3);
  history = {};
  EXPECT_EQ(state(0, 0), 0);
  EXPECT_EQ(state(0, model::kSaturated), 0);
  EXPECT_EQ(state(0, model::kEnabled | model::kSaturated), 2);
  EXPECT_EQ(state(0, model::kEnabled | model::kStale), 3);
}

TEST(Controller, NoiseFarBeyondTheTables_IsServedAsTheFiltersHealth) {
  const auto bench = std::make_unique<Bench<Forgetting, Block>>();
  bench->Run(9000);
  EXPECT_EQ((bench->Value<reg::kHealth>()), 0);
  bench->disturbance_LSB = 3000;
  bench->Run(9000);
  EXPECT_EQ((bench->Value<reg::kHealth>()), 3);
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
  const auto floats = [](auto& bench, const auto& estimates) { return bench.Read(SpanOf(estimates, Model::kColumns)); };
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
  const auto two = std::make_unique<Two>(flash.storage(), hardware::Clock{&now, count, count});
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

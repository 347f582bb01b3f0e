// link - a drive without a robot arm: an application with switches, a flash memory, traces and the whole register map.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <utility>
#include <vector>

#include "armcal/core/crc.hpp"
#include "armcal/core/words.hpp"
#include "armcal/link/device.hpp"
#include "armcal/link/trace.hpp"
#include "tests/unit/table/nor_flash.hpp"

namespace armcal::test {

inline constexpr std::uint32_t kSchema = 0x5C4E3A21;
inline constexpr std::uint16_t kTableWords = 260;  // more than two requests long
inline constexpr std::uint16_t kAxes = 6, kColumns = 40;
inline constexpr std::uint32_t kBadPhysics = 0xDEAD;  // word 5 of a table that the application calls unphysical

inline std::vector<std::uint16_t> MakeTable(int number, std::uint32_t schema = kSchema) {
  std::vector<std::uint16_t> words(kTableWords);
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = static_cast<std::uint16_t>(number * 37 + 3 * i);
  core::PutU32(words.data(), schema);
  return words;
}

// What the application of the drive does with a table. Another thread may turn the switches.
struct FakeApplication {
  std::atomic<bool> enabled{false};         // an axis is enabled
  std::atomic<bool> enable_on_save{false};  // becomes enabled between permission and adoption
  std::atomic<int> busy{0};                 // answers kBusy this many times before it adopts
  std::atomic<bool> refuse_check{false};    // every check refuses
  std::atomic<int> slices{1};               // calls that a check needs
  std::atomic<int> checks{0}, adoptions{0};
  std::atomic<core::Status> doubts{core::Status::kOk};  // about a table on trial
  int slices_done = 0;
  std::vector<std::uint16_t> built, adopted;  // by the last check; by the last adoption
  std::vector<std::uint16_t> before;          // what was in force before a trial

  link::TableApplication Functions() { return {this, &Check, &Permit, &Adopt, &TryOut, &GiveBack, &Doubt}; }

  static core::Refusal Check(void* self, const std::uint16_t* words, std::uint16_t count, bool first) {
    auto& a = *static_cast<FakeApplication*>(self);
    if (first) a.slices_done = 0;
    if (++a.slices_done < a.slices) return {core::Status::kBusy};
    ++a.checks;
    a.built.clear();
    if (a.refuse_check || words[5] == kBadPhysics) return {core::Status::kUnphysical, 5, 1.0f, 0.0f};
    a.built.assign(words, words + count);
    return {};
  }
  static core::Status Permit(void* self) {
    auto& a = *static_cast<FakeApplication*>(self);
    if (a.enabled) return core::Status::kAxisEnabled;
    if (a.enable_on_save) a.enabled = true;
    return core::Status::kOk;
  }
  static core::Status Adopt(void* self) {
    auto& a = *static_cast<FakeApplication*>(self);
    if (a.enabled) return core::Status::kAxisEnabled;
    if (a.busy > 0 && a.busy-- > 0) return core::Status::kBusy;
    a.adopted = a.built;
    ++a.adoptions;
    return core::Status::kOk;
  }
  static core::Status TryOut(void* self) {
    auto& a = *static_cast<FakeApplication*>(self);
    a.before = a.adopted;
    a.adopted = a.built;
    return core::Status::kOk;
  }
  static void GiveBack(void* self) {
    auto& a = *static_cast<FakeApplication*>(self);
    a.adopted = a.before;
    a.before.clear();
  }
  static core::Status Doubt(void* self) { return static_cast<FakeApplication*>(self)->doubts; }
};

// What the application of the drive does about learning and about residual statistics.
struct FakeEstimator {
  core::Status answer = core::Status::kOk;
  std::vector<bool> holds;
  std::vector<int> resets;
  int snapshots_taken = 0;
  std::atomic<bool> key_switch{true};  // clients may write

  link::ClientRequests Functions() { return {this, &Hold, &Reset, &TakeResiduals, &MayWrite}; }

  static bool MayWrite(void* self) { return static_cast<FakeEstimator*>(self)->key_switch; }

  static core::Status Hold(void* self, bool hold) {
    static_cast<FakeEstimator*>(self)->holds.push_back(hold);
    return static_cast<FakeEstimator*>(self)->answer;
  }
  static core::Status Reset(void* self, int block) {
    static_cast<FakeEstimator*>(self)->resets.push_back(block);
    return static_cast<FakeEstimator*>(self)->answer;
  }
  // The statistics of a joint are recognisable figures that change with every snapshot.
  static void TakeResiduals(void* self, int joint, link::ResidualPage& page) {
    auto& e = *static_cast<FakeEstimator*>(self);
    page.generation = 3;
    page.elapsed_s = 4000;
    page.sigma_Nm = 0.5f;
    ++e.snapshots_taken;
    for (int k = 0; k < link::reg::kResidualValues; ++k)
      page.values[k] = static_cast<float>(10000 * e.snapshots_taken + 1000 * joint + k);
  }
};

// A record has as many words as its channel mask has bits. Masks of more than 8 bits are not served.
inline std::uint16_t RecordWords(void*, std::uint32_t channels) {
  if (channels > 0xFF) return 0;
  std::uint16_t words = 0;
  for (std::uint32_t m = channels; m != 0; m &= m - 1) ++words;
  return words;
}

struct TestDevice {
  TestDevice() {
    boot_status = transaction.Boot();
    for (int i = 0; i < kColumns; ++i) {
      estimate[i] = 0.5f * static_cast<float>(i);
      deviation[i] = NAN;
    }
    namespace reg = link::reg;
    bool served = true;
    for (const auto& [list, values] :
         std::initializer_list<std::pair<link::Span, const float*>>{{SpanOf(reg::kEstimateA, kColumns), estimate},
                                                                    {SpanOf(reg::kDeviationA, kColumns), deviation},
                                                                    {SpanOf(reg::kEstimateB, kColumns), estimate},
                                                                    {SpanOf(reg::kDeviationB, kColumns), deviation},
                                                                    {SpanOf(reg::kResidualRms, kAxes), estimate},
                                                                    {SpanOf(reg::kConsistency, kAxes), estimate}})
      served = served && core::IsOk(device.Serve(list, values));
    served = served && core::IsOk(raw.Serve(device.map(), 0));
    all_served = served && core::IsOk(samples.Serve(device.map(), 1));
  }

  NorFlash flash{{2, 2048, 8, 0xFF}};
  table::TableStore store{flash.storage(), kSchema, kTableWords};
  FakeApplication application;
  std::vector<std::uint16_t> staged = std::vector<std::uint16_t>(kTableWords);
  std::vector<std::uint16_t> active = std::vector<std::uint16_t>(kTableWords);
  link::TableTransaction transaction{application.Functions(), store,       kSchema, staged.data(),
                                     active.data(),           kTableWords, {1, 0}};
  link::Identity identity{kSchema,  0x00010002, 77,   kAxes, 30,
                          kColumns, 15 + 64,    1000, 8,     {"armcal", "test_arm", "1.0"}};
  link::LiveStatus live;
  float estimate[kColumns], deviation[kColumns];
  link::TraceRing<1024> raw{1, &RecordWords, nullptr};
  link::TraceRing<1024> samples{8, &RecordWords, nullptr};
  FakeEstimator estimator;
  link::Device device{identity, live, transaction, estimator.Functions()};
  core::Status boot_status = core::Status::kOk;
  bool all_served = false;
};

}  // namespace armcal::test

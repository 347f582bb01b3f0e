// link - a drive without an arm: a table application with switches, flash, traces and the whole map; knows no
// transport.
#pragma once

#include <atomic>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <tuple>
#include <vector>

#include "armcal/core/crc.hpp"
#include "armcal/core/words.hpp"
#include "armcal/link/device.hpp"
#include "armcal/link/learning_registers.hpp"
#include "armcal/link/residual_registers.hpp"
#include "armcal/link/trace_registers.hpp"
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

// What the drive's application does with a table. Switches may be turned from another thread.
struct FakeApplication {
  std::atomic<bool> enabled{false};         // an axis is enabled
  std::atomic<bool> enable_on_save{false};  // becomes enabled between permission and adoption
  std::atomic<int> busy{0};                 // answers kBusy so many times before it adopts
  std::atomic<int> adoptions{0};
  std::vector<std::uint16_t> adopted;

  link::TableApplication Functions() { return {this, &Check, &Permit, &Adopt}; }

  static core::Status Check(void*, const std::uint16_t* words, std::uint32_t) {
    return words[5] == kBadPhysics ? core::Status::kUnphysical : core::Status::kOk;
  }
  static core::Status Permit(void* self, const std::uint16_t*, std::uint32_t) {
    auto& a = *static_cast<FakeApplication*>(self);
    if (a.enabled) return core::Status::kAxisEnabled;
    if (a.enable_on_save) a.enabled = true;
    return core::Status::kOk;
  }
  static core::Status Adopt(void* self, const std::uint16_t* words, std::uint32_t count) {
    auto& a = *static_cast<FakeApplication*>(self);
    if (a.enabled) return core::Status::kAxisEnabled;
    if (a.busy > 0 && a.busy-- > 0) return core::Status::kBusy;
    a.adopted.assign(words, words + count);
    ++a.adoptions;
    return core::Status::kOk;
  }
};

// What the drive's application does about learning.
struct FakeLearning {
  core::Status answer = core::Status::kOk;
  std::vector<bool> holds;
  std::vector<int> resets;

  link::LearningApplication Functions() { return {this, &Hold, &Reset}; }

  static core::Status Hold(void* self, bool hold) {
    static_cast<FakeLearning*>(self)->holds.push_back(hold);
    return static_cast<FakeLearning*>(self)->answer;
  }
  static core::Status Reset(void* self, int block) {
    static_cast<FakeLearning*>(self)->resets.push_back(block);
    return static_cast<FakeLearning*>(self)->answer;
  }
};

// Records of channel mask m have as many words as m has bits; masks beyond 8 bits are not served.
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
    bool served = true;
    for (const auto& [first, values, count] : std::initializer_list<std::tuple<std::uint16_t, const float*, int>>{
             {link::reg::kEstimateA, estimate, kColumns},
             {link::reg::kDeviationA, deviation, kColumns},
             {link::reg::kEstimateB, estimate, kColumns},
             {link::reg::kDeviationB, deviation, kColumns},
             {link::reg::kResidualRms, estimate, kAxes},
             {link::reg::kConsistency, estimate, kAxes}})
      served = served && core::IsOk(device.AddFloats(first, values, static_cast<std::uint16_t>(count)));
    served = served && core::IsOk(link::ServeTrace(device.map(), 0, raw));
    served = served && core::IsOk(link::ServeTrace(device.map(), 1, samples));
    served = served && core::IsOk(residuals.Serve(device.map()));
    served = served && core::IsOk(learning.Serve());
    all_served = served;
  }

  // The statistics of a joint: recognisable figures that change with every snapshot.
  static void TakeResiduals(void* self, int joint, link::ResidualPage& page) {
    auto& t = *static_cast<TestDevice*>(self);
    page.generation = 3;
    page.elapsed_s = 4000;
    page.sigma_Nm = 0.5f;
    ++t.snapshots_taken;
    for (int k = 0; k < link::reg::kResidualValueCount; ++k)
      page.values[k] = static_cast<float>(10000 * t.snapshots_taken + 1000 * joint + k);
  }

  NorFlash flash{{2, 2048, 8, 0xFF}};
  table::TableStore store{flash.storage(), kSchema, kTableWords};
  FakeApplication application;
  std::vector<std::uint16_t> staged = std::vector<std::uint16_t>(kTableWords);
  std::vector<std::uint16_t> active = std::vector<std::uint16_t>(kTableWords);
  link::TableTransaction transaction{application.Functions(), store,         kSchema,
                                     staged.data(),           active.data(), kTableWords};
  link::Identity identity{kSchema,  0x00010002, 77,   kAxes, 30,
                          kColumns, 15 + 64,    1000, 8,     {"armcal", "test_arm", "1.0"}};
  link::LiveStatus live;
  float estimate[kColumns], deviation[kColumns];
  link::TraceRing<1024> raw{1, &RecordWords, nullptr};
  link::TraceRing<1024> samples{8, &RecordWords, nullptr};
  link::Device device{identity, live, transaction};
  link::ResidualPages residuals{&TakeResiduals, this, kAxes};
  FakeLearning learner;
  link::LearningRegisters learning{learner.Functions(), device, kAxes};
  int snapshots_taken = 0;
  core::Status boot_status = core::Status::kOk;
  bool all_served = false;
};

}  // namespace armcal::test

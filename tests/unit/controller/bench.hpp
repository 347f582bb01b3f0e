// controller - a whole controller without a bus, on axes that are as its model says, and a client that needs no wire.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <vector>

#include "armcal/controller/controller.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "port/mps2/application/pretend_axes.hpp"
#include "tests/unit/table/nor_flash.hpp"

namespace armcal::test {

template <class... Filters>
struct Bench {
  using Status = core::Status;
  using Model = generated::Er20Like;
  static constexpr int n = Model::kJoints;

  explicit Bench(const controller::BoardRules& rules = Rules(), const link::Identity& identity = {},
                 const NorFlash& stored = NorFlash({2, 16384, 8, 0xFF}))
      : flash(stored), controller(flash.storage(), clock, identity, rules) {
    booted = controller.Boot();
  }

  void Run(int ticks) {
    for (; ticks > 0; --ticks, ++now) {
      model::RawSample<n> raw;
      controller::SetPoint<n> set;
      (void)axes.Read(now, raw, set);
      const int sign = now / Model::kSampleTicks % 2 == 0 ? 1 : -1;  // changes from sample to sample
      for (std::int16_t& current : raw.current) current = static_cast<std::int16_t>(current + sign * disturbance_LSB);
      torque = controller.FeedForward(set, raw.temperature_degC, tau_Nm);
      ASSERT_EQ(controller.Push(raw), Status::kOk);
      Idle();
    }
  }
  void Idle() {
    for (int k = 0; k < steps && controller.Step(); ++k) {
    }
  }

  template <const auto& kBlock>
  Status Write(const link::Words<kBlock>& words) {
    return controller.map().Write(words.span().first, words.size(), words.data());
  }
  template <const link::Register& kRegister>
  Status WriteValue(link::ValueOf<kRegister> value) {
    link::Words<kRegister> words;
    words.template Set<kRegister>(value);
    return Write(words);
  }
  std::vector<std::uint16_t> Read(const link::Span& span) {
    std::vector<std::uint16_t> words(span.count);
    EXPECT_EQ(controller.map().Read(span.kind, span.first, span.count, words.data()), Status::kOk);
    return words;
  }
  template <const auto& kBlock>
  link::Words<kBlock> Read() {
    return link::Words<kBlock>(Read(link::SpanOf(kBlock)).data());
  }
  template <const link::Register& kRegister>
  link::ValueOf<kRegister> Value() {
    return Read<kRegister>().template Get<kRegister>();
  }
  void Unlock() { ASSERT_EQ(WriteValue<link::reg::kUnlock>(link::reg::kUnlockKey), Status::kOk); }

  Status Command(std::uint32_t command, std::uint32_t crc, std::uint16_t words = kWords) {
    link::Words<link::reg::kCommandBlock> w;
    w.template Set<link::reg::kSequence>(++sequence);
    w.template Set<link::reg::kCommand>(command);
    w.template Set<link::reg::kCommandSchema>(Model::kSchema);
    w.template Set<link::reg::kCommandWords>(words);
    w.template Set<link::reg::kCommandCrc>(crc);
    Status status = Write(w);
    for (; status == Status::kUnfinished; status = Write(w)) EXPECT_TRUE(controller.Step());
    return status;
  }
  Status Command(std::uint32_t command, const std::vector<std::uint16_t>& words) {
    return Command(command, core::Crc32Words(words.data(), words.size()), static_cast<std::uint16_t>(words.size()));
  }
  // Stages a table and checks it. Answers the status of the first step that is refused.
  Status Check(const std::vector<std::uint16_t>& words) {
    Unlock();
    if (const Status opened = Command(link::reg::kOpen, words); !core::IsOk(opened)) return opened;
    for (std::size_t at = 0; at < words.size(); at += 100) {
      const auto count = static_cast<std::uint16_t>(std::min<std::size_t>(100, words.size() - at));
      const Status s = controller.map().Write(link::reg::kStagedTable + static_cast<int>(at), count, &words[at]);
      if (!core::IsOk(s)) return s;
    }
    return Command(link::reg::kCheck, words);
  }
  Status Check(const estimator::Table<Model>& table, std::uint32_t& crc) {
    std::vector<std::uint16_t> words(kWords);
    model::Encode(table, words.data());
    crc = core::Crc32Words(words.data(), words.size());
    return Check(words);
  }
  // Also saves it. kOk: it is stored, and adopted as far as the status registers say.
  Status Flash(const std::vector<std::uint16_t>& words) {
    if (const Status checked = Check(words); !core::IsOk(checked)) return checked;
    const Status saved = Command(link::reg::kSave, words);
    Idle();
    return saved;
  }
  // Also saves it. kOk: it is stored, and adopted as far as the status registers say.
  Status Flash(const estimator::Table<Model>& table) {
    std::uint32_t crc = 0;
    if (const Status checked = Check(table, crc); !core::IsOk(checked)) return checked;
    const Status saved = Command(link::reg::kSave, crc);
    Idle();
    return saved;
  }

  static constexpr std::uint16_t kWords = estimator::Table<Model>::kWords;
  NorFlash flash;
  std::uint32_t now = 0, sequence = 0;
  hardware::Clock clock{&now, [](void* t) { return *static_cast<std::uint32_t*>(t); },
                        [](void* t) { return *static_cast<std::uint32_t*>(t); }};
  application::PretendAxes<Model> axes;
  static controller::BoardRules Rules() {
    controller::BoardRules rules;
    rules.adopt_while_enabled = true;
    return rules;
  }
  controller::Controller<Model, Filters...> controller;
  Status booted = Status::kOk, torque = Status::kOk;
  float tau_Nm[n] = {};
  int disturbance_LSB = 0;
  int steps = 100000;  // of the background in a tick, at most: an adoption that stays refused never ends
};

}  // namespace armcal::test

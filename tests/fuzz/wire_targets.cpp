// fuzz - framers, the engine with a whole device, the trajectory player's registers, and the check of a table.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <memory>
#include <utility>
#include <vector>

#include "armcal/controller/controller.hpp"
#include "armcal/estimator/adopted_table.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/link/rtu.hpp"
#include "armcal/link/tcp.hpp"
#include "armcal/model/ceilings.hpp"
#include "armcal/model/parameters.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "codegen/generated/two_link/model.hpp"
#include "host_sim/machine/drive/vendor_block.hpp"
#include "tests/fuzz/targets.hpp"
#include "tests/unit/link/test_device.hpp"

namespace armcal::fuzz {
namespace {

void Must(bool holds, const char* what) {
  if (holds) return;
  std::fprintf(stderr, "must never happen: %s\n", what);
  std::abort();
}

// Takes numbers off the front; zeros when nothing is left.
struct Source {
  const std::uint8_t* bytes;
  std::size_t left;
  std::uint8_t Byte() { return left == 0 ? std::uint8_t{0} : (--left, *bytes++); }
  std::uint16_t Word() {
    const auto high = static_cast<std::uint16_t>(Byte() << 8);
    return static_cast<std::uint16_t>(high | Byte());
  }
};

template <class Model>
std::vector<std::uint16_t> OwnTable() {
  std::vector<std::uint16_t> words(estimator::Table<Model>::kWords);
  model::Encode(estimator::DefaultTable<Model>(), words.data());
  return words;
}

// Requests of three connections to the engine of a device. step: what the device's background does.
class Clients {
 public:
  Clients(link::PduEngine& engine, std::function<void()> step, std::uint32_t schema)
      : engine_(engine),
        step_(std::move(step)),
        schema_(schema),
        session_{0, engine.sessions().Begin(), engine.sessions().Begin()} {}

  void Choose(unsigned session) { now_ = session_[session % 3]; }
  void Ask(const std::vector<std::uint8_t>& pdu) {
    std::uint8_t reply[link::kMaxPdu];
    std::size_t length = engine_.Handle(pdu.data(), pdu.size(), reply, now_);
    for (int turn = 0; turn < 100 && length == link::kReplyLater; ++turn) {
      step_();
      length = engine_.Handle(pdu.data(), pdu.size(), reply, now_);
    }
    Must(length <= link::kMaxPdu && (pdu.empty() ? length == 0 : length >= 2), "a reply of impossible length");
  }
  void Write(std::size_t first, const std::vector<std::uint16_t>& words) {
    std::vector<std::uint8_t> pdu{
        16, static_cast<std::uint8_t>(first >> 8),   static_cast<std::uint8_t>(first),
        0,  static_cast<std::uint8_t>(words.size()), static_cast<std::uint8_t>(2 * words.size())};
    pdu.reserve(pdu.size() + 2 * words.size());
    for (const std::uint16_t w : words)
      pdu.push_back(static_cast<std::uint8_t>(w >> 8)), pdu.push_back(static_cast<std::uint8_t>(w));
    Ask(pdu);
  }
  void Unlock() { Write(link::reg::kUnlock.address, {0x6B6C, 0x6E75}); }
  void Command(std::uint32_t name, const std::vector<std::uint16_t>& stage) {
    namespace reg = link::reg;
    link::Words<reg::kCommandBlock> w;
    w.Set<reg::kSequence>(++sequence_);
    w.Set<reg::kCommand>(name);
    w.Set<reg::kCommandSchema>(schema_);
    w.Set<reg::kCommandWords>(static_cast<std::uint16_t>(stage.size()));
    w.Set<reg::kCommandCrc>(core::Crc32Words(stage.data(), stage.size()));
    Write(reg::kSequence.address, {w.data(), w.data() + w.size()});
  }
  void Stage(const std::vector<std::uint16_t>& stage) {
    for (std::size_t at = 0; at < stage.size(); at += 120)
      Write(link::reg::kStagedTable.address + at,
            {stage.begin() + static_cast<std::ptrdiff_t>(at),
             stage.begin() + static_cast<std::ptrdiff_t>(std::min(at + 120, stage.size()))});
  }
  // What all devices are asked for, by number: 0, 1, 2, 4 or 5.
  void Request(int what, Source& in, const std::vector<std::uint16_t>& stage) {
    namespace reg = link::reg;
    if (what == 0) {
      std::vector<std::uint8_t> pdu(in.Byte());
      for (std::uint8_t& byte : pdu) byte = in.Byte();
      Ask(pdu);
    } else if (what == 1) {
      Unlock();
    } else {
      Command(what == 2 ? reg::kOpen : what == 4 ? reg::kCheck : reg::kSave, stage);
    }
  }

 private:
  link::PduEngine& engine_;
  std::function<void()> step_;
  std::uint32_t schema_, sequence_ = 0, session_[3], now_ = 0;
};

class StillArm final : public drive::PlayedMotion {
 public:
  bool Load(double step_s, std::uint32_t points, const float* q) override {
    Must(step_s > 0 && points > 0, "an empty trajectory is played");
    for (std::uint32_t k = 0; k < 6 * points; ++k) Must(std::isfinite(q[k]), "a point that is not finite is played");
    return true;
  }
  void SetSpeed(double share) override { Must(share > 0 && share <= 1, "a speed beyond 100 %"); }
  void Command(client::PlayerCommand command) override { enabled_ = command != client::PlayerCommand::kDisable; }
  client::PlayerState state() const override {
    return enabled_ ? client::PlayerState::kHolding : client::PlayerState::kDisabled;
  }
  client::StopReason reason() const override { return client::StopReason::kNone; }
  std::uint32_t first_tick() const override { return 0; }
  std::uint32_t last_tick() const override { return 0; }

 private:
  bool enabled_ = false;
};

}  // namespace

void Rtu(const std::uint8_t* bytes, std::size_t count) {
  link::RtuFramer framer(17, 10);
  Source in{bytes, count};
  std::uint32_t now_ms = in.Byte();
  while (in.left > 0) {
    const std::uint8_t how = in.Byte();
    now_ms += how % 16;
    std::size_t part = std::min<std::size_t>(in.left, how / 4u), used = 0;
    const auto result = framer.OnBytes(in.bytes, part, now_ms, used);
    Must(used <= part, "more bytes taken than given");
    if (result != link::RtuFramer::Result::kNothing)
      Must(framer.pdu_bytes() >= 1 && framer.pdu_bytes() <= link::kMaxPdu, "a request of impossible length");
    in.bytes += used, in.left -= used;
  }
}

void Tcp(const std::uint8_t* bytes, std::size_t count) {
  link::TcpFramer framer;
  for (std::size_t at = 0, used = 0; at < count; at += used) {
    const std::size_t part = std::min<std::size_t>(count - at, 1 + bytes[at] % 40u);
    const auto result = framer.OnBytes(bytes + at, part, used);
    if (result == link::TcpFramer::Result::kBroken) return;
    Must(used <= part && used > 0, "a stream that stands still");
    if (result == link::TcpFramer::Result::kFrame)
      Must(framer.pdu_bytes() >= 1 && framer.pdu_bytes() <= link::kMaxPdu, "a request of impossible length");
  }
}

void Engine(const std::uint8_t* bytes, std::size_t count) {
  const auto drive = std::make_unique<test::TestDevice>();
  Source in{bytes, count};
  const std::vector<std::uint16_t> before = drive->active;
  std::vector<std::uint16_t> stage = test::MakeTable(1);
  std::uint32_t now_ms = 0;
  Clients clients(
      drive->device.engine(), [&] { drive->device.Step(now_ms); }, test::kSchema);
  std::vector<std::vector<std::uint16_t>> checked;
  while (in.left > 0) {
    const std::uint8_t what = in.Byte();
    clients.Choose(what / 8);
    switch (what % 8) {
      case 3:
        stage = test::MakeTable(in.Byte());
        stage[2 + in.Byte() % 250u] = in.Word();
        clients.Stage(stage);
        break;
      case 6:
        drive->application.enabled = in.Byte() % 4 == 0;
        now_ms += in.Word();
        break;
      case 7:
        for (int tick = 0; tick < 30; ++tick)
          if (drive->raw.Offer(now_ms + static_cast<std::uint32_t>(tick)).last) {
            const std::uint16_t record[8] = {};
            (void)drive->raw.Push(record, 1);
          }
        break;
      default:
        clients.Request(what % 8, in, stage);
        break;
    }
    const std::vector<std::uint16_t>& built = drive->application.built;
    if (!built.empty() && (checked.empty() || checked.back() != built)) checked.push_back(built);
    // The first step lets the time pass. Further ones matter only while a table is being checked, stored or adopted.
    drive->device.Step(now_ms);
    for (int step = 1; step < 40 && drive->transaction.busy(); ++step) drive->device.Step(now_ms);
    const bool old = drive->active == before;
    Must(old || std::find(checked.begin(), checked.end(), drive->active) != checked.end(),
         "a table in force that nobody has checked");
    Must(old || drive->active == drive->application.adopted ||
             drive->transaction.state() == link::TransactionState::kCommitting,
         "a table in force that was not adopted");
  }
}

void Controller(const std::uint8_t* bytes, std::size_t count) {
  namespace reg = link::reg;
  using Model = generated::TwoLink;
  using Drive = controller::Controller<Model, filter::ForgettingFilter<Model>>;
  constexpr int n = Model::kJoints;
  struct Time {
    std::uint32_t tick = 0;
    static std::uint32_t Read(void* self) { return static_cast<Time*>(self)->tick; }
  } time;
  test::NorFlash flash{{2, 8192, 8, 0xFF}};
  controller::BoardRules rules;
  rules.adopt_while_enabled = true, rules.saves = {100, 0};
  const auto drive =
      std::make_unique<Drive>(flash.storage(), hardware::Clock{&time, Time::Read, Time::Read}, link::Identity{}, rules);
  const auto trace = std::make_unique<controller::RawTrace<Model, 1024>>();
  Must(core::IsOk(drive->Record(*trace)), "a trace that cannot be served");
  (void)drive->Boot();
  static const std::vector<std::uint16_t> usual = OwnTable<Model>();
  std::vector<std::uint16_t> stage = usual;
  Source in{bytes, count};
  Clients clients(
      drive->engine(), [&] { (void)drive->Step(); }, Model::kSchema);
  const auto number = [&in](float size) {
    return size * static_cast<float>(static_cast<std::int8_t>(in.Byte())) / 127.0f;
  };
  while (in.left > 0) {
    const std::uint8_t what = in.Byte();
    clients.Choose(what / 16);
    switch (what % 16) {
      case 3:  // the model's own table, bumpless, with up to three words changed
        stage = usual;
        stage[5] = 1, stage[7] = 500;
        for (unsigned k = in.Byte() % 4u; k > 0; --k) stage[in.Word() % stage.size()] = in.Word();
        clients.Stage(stage);
        break;
      case 6:
        clients.Command(reg::kTrial, stage);
        break;
      case 7:
        clients.Command(reg::kConfirm, stage);
        break;
      case 8:
        clients.Command(reg::kBack, stage);
        break;
      case 9:
        drive->SetEnabledAxes(in.Byte() % 4u);
        break;
      case 10:
        drive->ReportTrackingError();
        break;
      case 11:
        time.tick += in.Word();
        break;
      case 12:
      case 13:
      case 14:
      case 15: {
        controller::SetPoint<n> set;
        model::RawSample<n> raw;
        for (int j = 0; j < n; ++j) {
          set.q[j] = number(7.0f), set.qd[j] = number(30.0f), set.qdd[j] = number(200.0f);
          raw.counts[j] = in.Word() * 8, raw.current[j] = static_cast<std::int16_t>(in.Word());
          raw.flags[j] = in.Byte(), raw.temperature_degC[j] = number(300.0f);
        }
        for (unsigned ticks = 1 + in.Byte() % 20u; ticks > 0; --ticks) {
          float tau_Nm[n];
          (void)drive->FeedForward(set, raw.temperature_degC, tau_Nm);
          for (int j = 0; j < n; ++j)
            Must(std::abs(tau_Nm[j]) <= Model::kCeilings.joint[j].torque_Nm, "a torque beyond the ceiling");
          raw.tick = ++time.tick;
          raw.stamped = (raw.flags[0] & 8u) != 0;
          raw.latch_ns = raw.tick * 1000000u + static_cast<std::uint32_t>(raw.counts[0]);
          for (int j = 0; j < n; ++j) raw.counts[j] += static_cast<std::int32_t>(100.0f * set.qd[j]);
          (void)drive->Push(raw);
        }
        break;
      }
      default:
        clients.Request(what % 16, in, stage);
        break;
    }
    for (int step = 0; step < 40 && drive->Step(); ++step) {
    }
  }
}

// The model's own table, with words changed.
void Table(const std::uint8_t* bytes, std::size_t count) {
  using Model = generated::Er20Like;
  static const std::vector<std::uint16_t> own = OwnTable<Model>();
  std::vector<std::uint16_t> words = own;
  for (Source in{bytes, count}; in.left > 0;) words[in.Word() % words.size()] = in.Word();
  const bool head = core::IsOk(model::CheckHeading<Model::kJoints, Model::kParameters>(
      words.data(), static_cast<int>(words.size()), Model::kSchema));
  if (!head || !core::IsOk(model::CheckWords(model::View(Model::kCeilings), true, words.data()).status)) return;
  estimator::Table<Model> table;
  if (!core::IsOk(model::Decode(words.data(), Model::kSchema, table))) return;
  for (int j = 0; j < Model::kJoints; ++j)
    Must(table.joint[j].torque_limit_Nm > 0 && table.joint[j].torque_limit_Nm <= Model::kCeilings.joint[j].torque_Nm,
         "a torque limit beyond the ceiling is accepted");
  for (const auto& parameter : table.parameter)
    Must(std::isfinite(parameter.mean), "a mean that is not finite is accepted");
}

void Vendor(const std::uint8_t* bytes, std::size_t count) {
  StillArm arm;
  drive::VendorBlock block(arm, 6);
  link::RegisterMap map;
  Must(core::IsOk(block.Serve(map)), "the player's registers do not fit the map");
  Source in{bytes, count};
  while (in.left > 0) {
    constexpr std::uint16_t kFirst[] = {client::kPlayerCommand, client::kPlayerSpeed, client::kPlayerSetup,
                                        client::kPlayerPoints};
    const std::uint8_t how = in.Byte();
    const auto first = static_cast<std::uint16_t>(kFirst[how % 4] + (how < 240 ? 0 : how % 16));
    std::uint16_t words[123] = {};
    const std::size_t most[] = {1, 1, 4, 14};
    const std::size_t number = how < 200 ? most[how % 4] : in.Byte() % 123u;
    for (std::size_t k = 0; k < number; ++k) words[k] = in.Word();
    // Short motions take little time and can be loaded whole. One setup in five is written as it comes.
    if (how < 160 && first == client::kPlayerSetup) words[0] = 0, words[1] %= 64;
    (void)map.Write(first, static_cast<std::uint16_t>(number), words);
    (void)map.Read(how % 2 == 0 ? link::RegisterKind::kInput : link::RegisterKind::kHolding, first, 8, words);
  }
}

}  // namespace armcal::fuzz

// tests - what an estimator takes from the tick and from the background, on an arm whose joints all move; and the
// longest of each call that a firmware makes of a whole controller.
#include <cstring>

#include "armcal/controller/controller.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "port/runner/line.hpp"
#include "tests/target/measure.hpp"
#include "tests/target/raw_ticks.hpp"

namespace armcal::target {
namespace {

using Model = generated::Er20Like;

physical::RigidPrior<Model, float> rigid;
estimator::AdoptedTable<Model> adopted;
const estimator::Table<Model> defaults = estimator::DefaultTable<Model>();

// Push: the tick's share, of a tick that completes a sample and of the others. Sample: all slices of one.
template <class Filter>
void Measure(const char* name) {
  static estimator::Estimator<Model, Filter> arm;
  arm.SetPublishEvery(1000000);
  arm.Adopt(adopted, 0);
  while (arm.Step()) {
  }
  RawTicks<Model::kJoints> ticks;
  Range completing, others, sample, slice;
  for (int k = 0; k < 2000; ++k) {
    const model::RawSample<Model::kJoints>& raw = ticks.Next();
    const std::uint32_t push = CostOf([&] { (void)arm.Push(raw); });
    (arm.pending() != 0 ? completing : others).Add(push);
    if (arm.pending() == 0) continue;
    std::uint32_t sum = 0;
    for (bool busy = true; busy;) {
      const std::uint32_t spent = CostOf([&] { busy = arm.Step(); });
      if (!busy) break;
      slice.Add(spent);
      sum += spent;
    }
    sample.Add(sum);
  }
  port::runner::Line("estimator")
      .Text(name)
      .Value("push", others.most)
      .Value("push_max", completing.most)
      .Value("sample", sample.most)
      .Value("slice_max", slice.most)
      .Value("slice_min", slice.least)
      .Value("state_bytes", sizeof arm)
      .End();
}

// The tick's share of the same ticks with time stamps and without: the instructions must be the same.
void MeasureStamps() {
  static signal::SignalPath<Model::kJoints, Model::kSampleTicks> with(estimator::AxesOf<Model>()),
      without(estimator::AxesOf<Model>());
  RawTicks<Model::kJoints> ticks;
  Range both;
  std::uint32_t stamped = 0, bare = 0;
  for (int k = 0; k < 2000; ++k) {
    model::RawSample<Model::kJoints> raw = ticks.Next();
    bare += CostOf([&] { (void)without.PushTick(raw); });
    raw.latch_ns = raw.tick * model::TickLength_ns(Model::kTickRate_Hz);
    raw.stamped = true;
    stamped += CostOf([&] { (void)with.PushTick(raw); });
  }
  both.Add(stamped), both.Add(bare);
  port::runner::Line("stamps").Text(Model::kName).Value("ticks", both.most).Value("ticks_least", both.least).End();
}

// Two sectors of RAM in the place of a flash memory.
constexpr std::uint32_t kSector = 4096;
std::uint8_t memory[2 * kSector];
std::uint32_t now = 0;

hardware::Storage RamStorage() {
  return {nullptr,
          2,
          kSector,
          8,
          0xFF,
          [](void*, std::uint32_t at, std::uint8_t* bytes, std::uint32_t count) {
            std::memcpy(bytes, memory + at, count);
            return core::Status::kOk;
          },
          [](void*, std::uint32_t at, const std::uint8_t* bytes, std::uint32_t count) {
            std::memcpy(memory + at, bytes, count);
            return core::Status::kOk;
          },
          [](void*, std::uint32_t sector) {
            std::memset(memory + sector * kSector, 0xFF, kSector);
            return core::Status::kOk;
          }};
}
std::uint32_t Now(void*) { return now; }

constexpr std::uint8_t kDriveKey[link::kKeyBytes] = {1, 2, 3};

controller::BoardRules KeyRules() {
  controller::BoardRules rules;
  rules.signing.key = kDriveKey;
  return rules;
}

// A controller with two filters and a key, and a client that flashes signed tables.
struct Drive {
  static constexpr std::uint16_t kWords = estimator::Table<Model>::kWords;

  controller::Controller<Model, filter::ForgettingFilter<Model>, filter::KalmanFilter<Model, filter::Form::kBlock>>
      controller{RamStorage(), {nullptr, Now, Now}, {}, KeyRules()};
  controller::RawTrace<Model, 4096> trace;
  std::uint8_t request[link::kMaxPdu] = {}, reply[link::kMaxPdu] = {};
  std::uint16_t words[kWords] = {};
  std::uint32_t sequence = 0;
  Range step, request_cost;

  // Function 16.
  std::size_t Write(std::uint16_t address, std::uint16_t count, const std::uint16_t* values) {
    request[0] = 16;
    core::PutBytes16(request + 1, address);
    core::PutBytes16(request + 3, count);
    request[5] = static_cast<std::uint8_t>(2 * count);
    for (std::uint16_t k = 0; k < count; ++k) core::PutBytes16(request + 6 + 2 * k, values[k]);
    std::size_t bytes = 0;
    request_cost.Add(CostOf([&] { bytes = controller.engine().Handle(request, 6u + request[5], reply); }));
    return bytes;
  }
  std::size_t Read(std::uint8_t function, std::uint16_t address, std::uint16_t count) {
    request[0] = function;
    core::PutBytes16(request + 1, address);
    core::PutBytes16(request + 3, count);
    std::size_t bytes = 0;
    request_cost.Add(CostOf([&] { bytes = controller.engine().Handle(request, 5, reply); }));
    return bytes;
  }
  bool Step() {
    bool busy = false;
    step.Add(CostOf([&] { busy = controller.Step(); }));
    return busy;
  }
  void Sign(std::uint32_t counter) {
    link::PutSeal({0, counter, link::SealMethod::kHmac}, words, kWords);
    core::HmacSha256 hmac;
    hmac.Begin(kDriveKey, sizeof kDriveKey);
    std::uint8_t bytes[core::Sha256::kDigestBytes];
    constexpr int kCovered = kWords - link::kSignatureWords;
    for (int k = 0; k < kCovered; ++k) {
      core::PutBytes16(bytes, words[k]);
      hmac.Add(bytes, 2);
    }
    hmac.Finish(bytes);
    for (int k = 0; k < 16; ++k) words[kCovered + k] = core::GetBytes16(bytes + 2 * k);
  }
  // Opens, stages and checks the defaults with this counter. Answers whether all was accepted.
  bool Check(std::uint32_t counter) {
    model::Encode(defaults, words);
    Sign(counter);
    bool accepted = Command(link::reg::kOpen);
    for (std::uint16_t at = 0; at < kWords; at = static_cast<std::uint16_t>(at + 123)) {
      const int rest = kWords - at;
      (void)Write(static_cast<std::uint16_t>(link::reg::kStagedTable.address + at),
                  static_cast<std::uint16_t>(rest < 123 ? rest : 123), words + at);
      accepted &= reply[0] == 16;
    }
    step = {};
    return accepted && Command(link::reg::kCheck);
  }
  // Answers whether it was accepted.
  bool Command(std::uint32_t command) {
    link::Words<link::reg::kCommandBlock> w;
    w.Set<link::reg::kSequence>(++sequence);
    w.Set<link::reg::kCommand>(command);
    w.Set<link::reg::kCommandSchema>(Model::kSchema);
    w.Set<link::reg::kCommandWords>(kWords);
    w.Set<link::reg::kCommandCrc>(core::Crc32Words(words, kWords));
    while (Write(w.span().first, w.size(), w.data()) == link::kReplyLater) (void)Step();
    return reply[0] == 16;
  }
};

// Each figure is the longest call: of the tick, of one that takes a new table, of the background while it learns, while
// it resets what it has learnt, while it checks a signed table, and while it stores and adopts one; of a request, those
// that begin and end a trial included; of any other function that a firmware may call after Boot.
void MeasureController() {
  static Drive drive;
  std::memset(memory, 0xFF, sizeof memory);
  auto& c = drive.controller;
  if (!core::IsOk(c.Record(drive.trace)) || c.Boot() != core::Status::kBlank) return;
  RawTicks<Model::kJoints> ticks;
  Range push, feed;
  const auto tick = [&] {
    const model::RawSample<Model::kJoints>& raw = ticks.Next();
    now = raw.tick;
    controller::SetPoint<Model::kJoints> set = {};
    float tau_Nm[Model::kJoints];
    feed.Add(CostOf([&] { (void)c.FeedForward(set, raw.temperature_degC, tau_Nm); }));
    push.Add(CostOf([&] { (void)c.Push(raw); }));
  };
  const auto work = [&] {
    drive.step = {};
    while (drive.Step()) {
    }
    return drive.step.most;
  };
  (void)work();
  std::uint32_t learn = 0;
  for (int k = 0; k < 3000; ++k) {
    tick();
    const std::uint32_t slice = work();
    learn = slice > learn ? slice : learn;
  }

  Range other;
  std::uint32_t reset = 0;
  for (int block = 0; block <= Model::kJoints; ++block) {
    other.Add(CostOf([&] { (void)c.ResetLearning(block); }));
    const std::uint32_t slice = work();
    reset = slice > reset ? slice : reset;
  }
  other.Add(CostOf([&] { c.HoldLearning(true); }));
  other.Add(CostOf([&] { c.HoldLearning(false); }));
  other.Add(CostOf([&] { c.SetEnabledAxes(0); }));

  const std::uint16_t key[] = {link::reg::kUnlockKey >> 16, link::reg::kUnlockKey & 0xFFFF};
  (void)drive.Write(link::reg::kUnlock.address, 2, key);
  bool accepted = drive.Check(1);
  const std::uint32_t check = drive.step.most;
  accepted &= drive.Command(link::reg::kSave);
  const std::uint32_t save = work();
  const std::uint32_t fed = feed.most;
  accepted &= drive.Check(2) && drive.Command(link::reg::kTrial);
  (void)work();
  accepted &= drive.Command(link::reg::kBack);
  (void)work();
  const std::uint32_t read = [&] {
    (void)drive.Read(3, link::reg::kStagedTable.address, 125);
    (void)drive.Read(4, link::reg::kStatusBlock.first, 28);
    (void)drive.Read(4, link::reg::kLogBlock.first, 125);
    const std::uint16_t joint = 1;
    (void)drive.Write(link::reg::kResidualSelect.address, 1, &joint);
    return drive.request_cost.most;
  }();
  feed = {};
  tick();
  other.Add(CostOf([&] { c.ReportTrackingError(); }));
  if (!accepted || c.generation() != 4) return;  // defaults, a save, a trial and back
  port::runner::Line("controller")
      .Text(Model::kName)
      .Value("push", push.most)
      .Value("feed_forward", fed)
      .Value("feed_forward_new", feed.most)
      .Value("step_learning", learn)
      .Value("step_resetting", reset)
      .Value("step_checking", check)
      .Value("step_saving", save)
      .Value("request", read)
      .Value("other", other.most)
      .Value("state_bytes", sizeof c)
      .End();
}

}  // namespace

void MeasureEstimators() {
  MeasureController();
  MeasureStamps();
  if (!core::IsOk(estimator::BuildAdoptedTable(defaults, 1, rigid, adopted))) return;
  Measure<filter::ForgettingFilter<Model>>("forgetting");
  Measure<filter::KalmanFilter<Model, filter::Form::kBlock>>("kalman_block");
  Measure<filter::KalmanFilter<Model>>("kalman_dense");
}

}  // namespace armcal::target

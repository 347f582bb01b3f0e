// controller - the class that firmware uses: it connects intake, estimators, feed-forward, table and Modbus registers.
#pragma once

#include <atomic>
#include <tuple>
#include <utility>

#include "armcal/controller/table_check.hpp"
#include "armcal/controller/trace_records.hpp"
#include "armcal/estimator/estimator.hpp"
#include "armcal/estimator/intake.hpp"
#include "armcal/feedforward/feed_forward.hpp"
#include "armcal/hardware/clock.hpp"
#include "armcal/hardware/storage.hpp"
#include "armcal/link/device.hpp"
#include "armcal/link/table_transaction.hpp"
#include "armcal/link/trace.hpp"
#include "armcal/table/table_store.hpp"

namespace armcal::controller {

static_assert(model::kSealWords == link::kSealWords && model::kLayoutVersion == link::kSealedLayout);

// Where the axes shall be. Shapes: [n], rad (m), rad/s, rad/s^2.
template <int n>
struct SetPoint {
  float q[n], qd[n], qdd[n];
};

// What a board lets a client do. The defaults are the careful ones.
struct BoardRules {
  bool adopt_while_enabled = false;  // a bumpless table may be adopted while axes are enabled
  link::SaveRate saves = {};
  // Whether clients may write now; a register shows the answer. nullptr: they may. See link::ClientRequests.
  bool (*may_write)(void* context) = nullptr;
  void* context = nullptr;  // of may_write
  // Who may change tables. With a key or a function, clients can neither hold nor reset what the estimators learn. The
  // controller fills in the serial number.
  link::Signing signing = {};
};

// One motion controller. It lives as long as the power is on, and takes some 80 KB for six joints. Filters: one or two
// of those that estimator::Estimator takes. Registers call the first one filter A and the second one filter B. Both
// work on the samples of one intake, so the signal path and the regressor run once.
template <class Model, class... Filters>
class Controller {
  static_assert(sizeof...(Filters) == 1 || sizeof...(Filters) == 2);

 public:
  static constexpr int n = Model::kJoints;
  static constexpr int kFilters = sizeof...(Filters);
  static constexpr std::uint16_t kWords = estimator::Table<Model>::kWords,
                                 kFirstWords = estimator::Table<Model>::kFirstWords;  // of layout version 1
  using Ceilings = model::Ceilings<n, Model::kParameters>;

  // `identity`: versions, texts and further capabilities, which are the integrator's. This class fills in the rest from
  // the model. `ceilings`: the hardest values that a table may hold; they outlive this object.
  Controller(const hardware::Storage& storage, const hardware::Clock& clock, const link::Identity& identity = {},
             const BoardRules& rules = {}, const Ceilings& ceilings = Model::kCeilings)
      : clock_(clock),
        rules_(rules),
        ceilings_(model::View(ceilings)),
        store_(storage, Model::kSchema, kWords, kFirstWords),
        transaction_({this, Check, Permit, Adopt, TryOut, GiveBack, Doubt}, store_, Model::kSchema, staged_, active_,
                     kWords, rules.saves, SigningOf(rules, identity)),
        device_(Describe(identity), live_, transaction_, {this, Hold, Reset, TakeResiduals, MayWrite}),
        estimators_(Shared<Filters>()...) {
    model::Encode(estimator::DefaultTable<Model>(), active_, model::kFirstLayout);  // as clients of any age read it
    estimator<0>().SetResiduals(&residuals_);
  }
  Controller(const Controller&) = delete;

  // Call it once, before the first tick. Without a valid table in storage, the estimators start from the model's
  // defaults, and feed-forward stays off. Answers as link::TableTransaction::Boot; a register serves that answer, too.
  // A status of link::RegisterMap::Add means a wrong map. Context: background.
  core::Status Boot() {
    const core::Status served = Serve(std::make_index_sequence<kFilters>());
    if (!core::IsOk(served)) return served;
    const core::Status stored = transaction_.Boot();
    booted_ = true;
    RestartAll();
    if (core::IsOk(stored)) return stored;
    const core::Status built = check_.BuildDefaults(generation_ + 1, &Suits, Spare());
    if (!core::IsOk(built)) return built;
    PutInForce();
    RestartAll();
    return stored;
  }

  // Which axes are under control, a bit each. While an axis is enabled, only a bumpless table is adopted. Context: any.
  void SetEnabledAxes(std::uint32_t axes) { enabled_axes_.store(axes, std::memory_order_relaxed); }

  // The motion controller says that the axes did not follow the set-point. A table on trial is then taken back; without
  // one nothing happens. Context: any.
  void ReportTrackingError() { tracking_error_.store(true, std::memory_order_relaxed); }

  // What learning_hold and learning_reset do for a client, for the firmware itself. `block`: a joint from 0, or the
  // number of joints for what acts on several of them. kOutOfRange: no filter can reset this part. Context: background.
  void HoldLearning(bool hold) { (void)Hold(this, hold); }
  core::Status ResetLearning(int block) { return Reset(this, block); }

  // Lets a client record the raw samples of Push, and of FeedForward the positions of the set-point and the torque that
  // it answered. `ring` must live as long as this object. Call it once, before the first tick. Answers as
  // link::Trace::Serve. Context: background.
  template <std::uint32_t kRingWords>
  core::Status Record(RawTrace<Model, kRingWords>& ring) {
    const core::Status served = ring.Serve(device_.map(), 0);
    if (!core::IsOk(served)) return served;
    device_.Declare(link::reg::kHasRawTrace | link::reg::kHasPacked);
    trace_ = &ring;
    return served;
  }

  // Joint torque of the set-point by the adopted table. temperature_degC: [n], NaN where there is no sensor. tau_Nm:
  // [n], zero without a valid table. Answers as feedforward::FeedForward::Evaluate. Context: tick.
  core::Status FeedForward(const SetPoint<n>& set, const float* temperature_degC, float* tau_Nm) {
    const std::uint32_t since = clock_.Ticks() - adopted_tick_.load(std::memory_order_relaxed);
    const core::Status status =
        feed_forward_.Evaluate(set.q, set.qd, set.qdd, temperature_degC,
                               static_cast<float>(since) / static_cast<float>(Model::kTickRate_Hz), enabled(), tau_Nm);
    feedforward_state_.store(!feed_forward_.valid()     ? 0u
                             : feed_forward_.blending() ? 2u
                                                        : 1u,
                             std::memory_order_relaxed);
    clamp_count_.store(feed_forward_.clamp_count(), std::memory_order_relaxed);
    if (trace_ != nullptr)
      for (int i = 0; i < n; ++i) told_q_[i] = set.q[i], told_Nm_[i] = tau_Nm[i];
    return status;
  }

  // What was measured in one tick. Bounded time; a tick that completes a sample takes longer than others. kFull: the
  // background is late, and the sample that this tick completed is lost and counted. Context: tick.
  core::Status Push(const model::RawSample<n>& raw) {
    const core::Status status = intake_.Push(raw);
    if (trace_ != nullptr) RecordTick(raw);
    return status;
  }

  // One bounded slice of all work that is not the tick's: of a table, of the restart after it, or of one of the
  // estimators. Returns false if nothing was left to do. Context: background.
  bool Step() {
    table_slice_ = transaction_.sealing();
    device_.Step(clock_.Ms());
    bool busy = transaction_.busy() || table_slice_;
    if (restarts_due_ != 0u) busy = RestartNext();
    else if (!table_slice_) busy |= StepEstimator();
    Show(std::make_index_sequence<kFilters>());
    return busy;
  }

  // Context of engine and map: background.
  link::PduEngine& engine() { return device_.engine(); }  // for a link::RtuService or TcpService
  link::RegisterMap& map() { return device_.map(); }      // for blocks of the integrator's, before the first request
  // Estimator number k: 0 is filter A, 1 is filter B. For SetObserver, SetPublishEvery, RequestReadOut and the
  // functions that only read; this class makes the other calls, Take included. Contexts as in estimator::Estimator.
  template <int k>
  auto& estimator() {
    return std::get<k>(estimators_);
  }
  const feedforward::FeedForward<Model>& feed_forward() const { return feed_forward_; }  // context: tick
  // The table in force; after a Boot without a valid table, the model's defaults. It stays unchanged until the next
  // adoption. Context: background.
  const estimator::AdoptedTable<Model>& adopted() const { return adopted_[in_force_.load(std::memory_order_relaxed)]; }
  std::uint32_t generation() const { return generation_; }  // adoptions since power-up; context: background

 private:
  template <class Filter>
  estimator::Intake<Model>& Shared() {
    return intake_;
  }
  template <class Call>
  void ForEach(Call call) {
    std::apply([&](auto&... estimator) { (call(estimator), ...); }, estimators_);
  }

  static link::Signing SigningOf(const BoardRules& rules, const link::Identity& identity) {
    link::Signing signing = rules.signing;
    signing.serial_number = identity.serial_number;
    return signing;
  }
  static link::Identity Describe(link::Identity identity) {
    identity.schema = Model::kSchema;
    identity.axes = n;
    identity.parameters = Model::kParameters;
    identity.columns = Model::kColumns;
    identity.capabilities |= link::reg::kHasFilterA | (kFilters > 1 ? link::reg::kHasFilterB : 0u) |
                             link::reg::kHasFeedForward | link::reg::kHasMonitor | link::reg::kHasResiduals |
                             link::reg::kHasLearning;
    identity.tick_rate_Hz = static_cast<std::uint32_t>(Model::kTickRate_Hz);
    identity.sample_ticks = Model::kSampleTicks;
    if (*identity.texts.product == '\0') identity.texts.product = Model::kName;
    return identity;
  }

  // The lists of floats that a client may read.
  template <std::size_t... k>
  core::Status Serve(std::index_sequence<k...>) {
    namespace reg = link::reg;
    core::Status served = core::Status::kOk;
    const auto serve = [&](const link::Span& list, const float* values) {
      if (core::IsOk(served)) served = device_.Serve(list, values);
    };
    constexpr link::Span kEstimate[] = {SpanOf(reg::kEstimateA, Model::kColumns),
                                        SpanOf(reg::kEstimateB, Model::kColumns)},
                         kDeviation[] = {SpanOf(reg::kDeviationA, Model::kColumns),
                                         SpanOf(reg::kDeviationB, Model::kColumns)};
    (serve(kEstimate[k], estimates_[k].value), ...);
    (serve(kDeviation[k], estimates_[k].sd), ...);
    serve(SpanOf(reg::kResidualRms, n), estimates_[0].residual_rms_Nm);
    serve(SpanOf(reg::kConsistency, n), estimates_[kFilters - 1].nis);
    return served;
  }

  template <std::size_t... k>
  void Show(std::index_sequence<k...>) {
    live_.feedforward_state = static_cast<std::uint16_t>(feedforward_state_.load(std::memory_order_relaxed));
    live_.generation = generation_;
    live_.tick = clock_.Ticks();
    live_.enabled_axes = enabled_axes_.load(std::memory_order_relaxed);
    live_.clamp_count = clamp_count_.load(std::memory_order_relaxed);
    live_.sample_gaps = intake_.refused();
    live_.implausible_ticks = intake_.implausible();
    (Show(k, estimator<k>()), ...);
  }
  template <class Estimator>
  void Show(std::size_t k, Estimator& estimator) {
    estimator::Estimates<Model>& e = estimates_[k];
    if (!estimator.Take(e)) return;
    live_.rows_used[k] = live_.rows_gated[k] = live_.rows_outside[k] = 0;
    for (int i = 0; i < n; ++i) {
      live_.rows_used[k] += e.rows_used[i];
      live_.rows_gated[k] += e.rows_gated[i];
      live_.rows_outside[k] += e.rows_outside[i];
    }
    const auto bit = static_cast<std::uint16_t>(1u << k);
    live_.health = static_cast<std::uint16_t>(e.inconsistent ? live_.health | bit : live_.health & ~bit);
  }

  // Context: tick. A full ring refuses the record and counts that.
  void RecordTick(const model::RawSample<n>& raw) {
    const link::TraceTurn turn = trace_->Offer(raw.tick);
    if (!turn.recording) return;
    if (turn.first) record_.Clear();
    record_.Add(raw, told_q_, told_Nm_);
    if (!turn.last) return;
    static_assert(RawRecordWords<n>(kRawAll) >= PackedRecordWords<n>());
    std::uint16_t words[RawRecordWords<n>(kRawAll)];
    const std::uint32_t channels = trace_->recording().channels;
    if (trace_->pushed() == 0) packed_ = {};
    if (channels == kRawPacked) record_.WritePacked(packed_, words);
    else record_.Write(channels, words);
    (void)trace_->Push(words, feed_forward_.generation());
  }

  // The calls of link::ClientRequests, which link::Device makes when a client asks. Context: background.
  static void TakeResiduals(void* self, int joint, link::ResidualPage& page) {
    static_assert(monitor::ResidualBins::kValues == link::reg::kResidualBinValues &&
                  monitor::ResidualStatistics<n>::kValues == link::reg::kResidualValues);
    const auto& c = *static_cast<const Controller*>(self);
    page.generation = c.generation_;
    page.elapsed_s = c.residuals_.elapsed_s();
    page.sigma_Nm = c.adopted().sigma_Nm[joint];
    c.residuals_.Write(joint, page.values);
  }
  static core::Status Hold(void* self, bool hold) {
    static_cast<Controller*>(self)->ForEach([&](auto& estimator) { estimator.Hold(hold); });
    return core::Status::kOk;
  }
  // Resets each filter that can. kOutOfRange: none can.
  static core::Status Reset(void* self, int block) {
    core::Status status = core::Status::kOutOfRange;
    static_cast<Controller*>(self)->ForEach([&](auto& estimator) {
      if (core::IsOk(estimator.Reset(block))) status = core::Status::kOk;
    });
    return status;
  }

  static bool MayWrite(void* self) {
    const BoardRules& rules = static_cast<Controller*>(self)->rules_;
    return rules.may_write == nullptr || rules.may_write(rules.context);
  }

  // The calls of link::TableApplication, which link::TableTransaction makes when a table is flashed. Check decodes and
  // builds the table, once and in slices. What it has built waits in the spare until it is adopted or until another
  // table is checked. Context: background.
  static core::Refusal Check(void* self, const std::uint16_t* words, std::uint16_t count, bool first) {
    auto& c = *static_cast<Controller*>(self);
    c.table_slice_ = true;
    c.spare_is_checked_ = false;
    if (first)
      c.check_.Begin(words, count, c.ceilings_, c.rules_.adopt_while_enabled, c.MayBeSealed(), c.generation_ + 1,
                     &Suits, c.Spare());
    const core::Refusal refusal = c.check_.Step();
    c.spare_is_checked_ = core::IsOk(refusal.status);
    return refusal;
  }
  // A record that is stored is taken as it is. A table that comes later has a seal only if the drive can judge it.
  bool MayBeSealed() const { return !booted_ || rules_.signing.required(); }
  static core::Status Permit(void* self) {
    auto& c = *static_cast<Controller*>(self);
    if (!c.spare_is_checked_) return core::Status::kWrongOrder;
    return c.enabled() && !c.Spare().committed.bumpless ? core::Status::kAxisEnabled : core::Status::kOk;
  }
  static core::Status Adopt(void* self) {
    auto& c = *static_cast<Controller*>(self);
    if (!c.spare_is_checked_) return core::Status::kWrongOrder;
    model::Committed<Model>& committed = c.Spare().committed;
    committed.blend_ticks = math::Max(committed.blend_ticks, c.LeastFade_ticks());  // if an axis is enabled meanwhile
    const core::Status offered = c.feed_forward_.Offer(committed, c.enabled());
    if (core::IsOk(offered)) c.PutInForce();
    return offered;
  }

  // The spare becomes the table in force, and the table in force the spare, which GiveBack uses.
  static core::Status TryOut(void* self) {
    auto& c = *static_cast<Controller*>(self);
    if (const core::Status permitted = Permit(self); !core::IsOk(permitted)) return permitted;
    c.tracking_error_.store(false, std::memory_order_relaxed);
    c.FadeIn();
    return core::Status::kOk;
  }
  static void GiveBack(void* self) { static_cast<Controller*>(self)->FadeIn(); }
  static core::Status Doubt(void* self) {
    auto& c = *static_cast<Controller*>(self);
    if (c.tracking_error_.load(std::memory_order_relaxed)) return core::Status::kTrackingError;
    return c.live_.health != 0 ? core::Status::kInconsistent : core::Status::kOk;
  }
  // Puts the spare in force with the shortest fade that the ceilings allow, whatever its table says.
  void FadeIn() {
    model::Committed<Model>& committed = Spare().committed;
    committed.generation = generation_ + 1;
    committed.bumpless = true;
    committed.blend_ticks = LeastFade_ticks();
    (void)feed_forward_.Offer(committed, enabled());  // a bumpless table is never refused
    PutInForce();
  }

  std::uint32_t LeastFade_ticks() const {
    return static_cast<std::uint32_t>(static_cast<float>(ceilings_.table->least_fade_ms) *
                                      (Model::kTickRate_Hz / 1000.0f));
  }
  bool enabled() const { return enabled_axes_.load(std::memory_order_relaxed) != 0; }
  // The adopted table that nobody reads: the estimators read the other one, and the feed-forward has a copy.
  estimator::AdoptedTable<Model>& Spare() { return adopted_[1 - in_force_.load(std::memory_order_relaxed)]; }
  // Returns false if a filter's form cannot hold what the table asks for.
  static bool Suits(const estimator::AdoptedTable<Model>& spare) {
    return (estimator::Estimator<Model, Filters, estimator::Intake<Model>&>::Suits(spare) && ...);
  }
  // The estimators restart in slices after this, and do nothing else until then.
  void PutInForce() {
    spare_is_checked_ = false;  // from now on the spare is the table before
    live_.health = 0;           // it told of the table before
    const std::uint32_t now = clock_.Ticks();
    adopted_tick_.store(now, std::memory_order_relaxed);
    restarts_due_ = (1u << kFilters) - 1u;
    restart_tick_ = now;
    intake_.Adopt(Spare(), now);
    generation_ = Spare().committed.generation;
    in_force_.store(1 - in_force_.load(std::memory_order_relaxed), std::memory_order_relaxed);
  }
  bool RestartNext() {
    bool done = false;
    std::uint32_t bit = 1;
    ForEach([&](auto& estimator) {
      if (!done && (restarts_due_ & bit) != 0u) {
        estimator.Restart(adopted(), restart_tick_);
        restarts_due_ &= ~bit;
        done = true;
      }
      bit <<= 1;
    });
    return done;
  }
  void RestartAll() {
    while (RestartNext()) {
    }
  }
  // A slice of the estimator whose turn it is, or of the other one if it has nothing to do.
  bool StepEstimator() {
    bool worked = false;
    for (int k = 0; k < kFilters && !worked; ++k) {
      turn_ = turn_ + 1 < kFilters ? turn_ + 1 : 0;
      int index = 0;
      ForEach([&](auto& estimator) { worked |= index++ == turn_ && estimator.Step(); });
    }
    return worked;
  }

  hardware::Clock clock_;
  BoardRules rules_;
  model::CeilingView ceilings_;
  std::uint16_t staged_[kWords] = {}, active_[kWords] = {};
  table::TableStore store_;
  link::TableTransaction transaction_;
  link::LiveStatus live_;
  link::Device device_;

  feedforward::FeedForward<Model> feed_forward_;
  link::Trace* trace_ = nullptr;
  RawRecord<n> record_;  // the tick's, as the three below
  PackedHistory<n> packed_;
  float told_q_[n] = {}, told_Nm_[n] = {};  // by the last FeedForward
  estimator::Intake<Model> intake_;
  std::tuple<estimator::Estimator<Model, Filters, estimator::Intake<Model>&>...> estimators_;
  estimator::Estimates<Model> estimates_[kFilters];
  monitor::ResidualStatistics<n> residuals_;
  TableCheck<Model> check_;
  estimator::AdoptedTable<Model> adopted_[2];
  bool booted_ = false;
  bool spare_is_checked_ = false;   // the spare is what the last Check was given
  bool table_slice_ = false;        // this Step has worked on a table
  std::uint32_t restarts_due_ = 0;  // estimators, a bit each
  std::uint32_t restart_tick_ = 0;
  int turn_ = 0;  // the estimator that worked last
  std::uint32_t generation_ = 0;
  std::atomic<int> in_force_{0};
  std::atomic<bool> tracking_error_{false};
  std::atomic<std::uint32_t> adopted_tick_{0}, enabled_axes_{0}, feedforward_state_{0}, clamp_count_{0};
};

}  // namespace armcal::controller

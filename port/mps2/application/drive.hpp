// application - introduces model, estimator, feed-forward, table and link to each other; knows no board and no pin.
#pragma once

#include <atomic>
#include <cstdint>

#include "armcal/estimator/estimator.hpp"
#include "armcal/estimator/image.hpp"
#include "armcal/feedforward/feed_forward.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/link/device.hpp"
#include "armcal/link/residual_registers.hpp"
#include "armcal/port/clock.hpp"
#include "armcal/port/storage.hpp"
#include "armcal/table/table_store.hpp"

namespace armcal::application {

// A set-point of the motion controller. Shapes: [n], rad, rad/s, rad/s^2.
template <int n>
struct SetPoint {
  float q[n], qd[n], qdd[n];
};

// One controller. Lives as long as the power is on; some 80 KB for six joints.
template <class Model>
class Drive {
 public:
  static constexpr int n = Model::kJoints;
  static constexpr std::uint16_t kWords = estimator::Table<Model>::kWords;

  Drive(const port::Storage& storage, const port::Clock& clock)
      : clock_(clock),
        store_(storage, Model::kSchema, kWords),
        transaction_({this, Check, Permit, Adopt}, store_, Model::kSchema, staged_, active_, kWords),
        device_(Describe(), live_, transaction_) {
    estimator_.SetResiduals(&residuals_);
  }

  // Before the first tick. Without a valid table in storage the estimator starts from the model's defaults and the
  // feed-forward stays off. Answers as table::TableStore::Load; a status of link::RegisterMap::Add is a wrong map.
  core::Status Boot() {
    core::Status map = core::Status::kOk;
    const auto serve = [&](std::uint16_t first, const float* values, std::uint16_t count) {
      if (core::IsOk(map)) map = device_.AddFloats(first, values, count);
    };
    serve(link::reg::kEstimateA, estimates_.value, Model::kColumns);
    serve(link::reg::kDeviationA, estimates_.sd, Model::kColumns);
    serve(link::reg::kResidualRms, estimates_.residual_rms_Nm, n);
    serve(link::reg::kConsistency, estimates_.nis, n);
    if (core::IsOk(map)) map = residual_pages_.Serve(device_.map());
    if (!core::IsOk(map)) return map;

    table_ = estimator::DefaultTable<Model>();
    model::Encode(table_, active_);
    const core::Status stored = transaction_.Boot();
    if (core::IsOk(stored)) return stored;
    estimator::Image<Model>& image = Spare();
    const core::Status built = estimator::BuildImage(table_, generation_ + 1, work_, image);
    if (!core::IsOk(built)) return built;
    PutInForce(image);
    return stored;
  }

  // One control tick: feed-forward torque of the set-point out, measured sample in. tau_Nm: [n], zero without a table.
  // Status of the feed-forward; kFull: the estimator is late and lost a sample. Context: tick.
  core::Status Tick(const model::RawSample<n>& raw, const SetPoint<n>& set, float* tau_Nm) {
    std::uint32_t enabled = 0;
    for (int i = 0; i < n; ++i) enabled |= static_cast<std::uint32_t>((raw.flags[i] & model::kEnabled) != 0) << i;
    enabled_axes_.store(enabled, std::memory_order_relaxed);
    const float since_s = static_cast<float>(raw.tick - adopted_tick_.load(std::memory_order_relaxed)) /
                          static_cast<float>(Model::kTickRate_Hz);
    const core::Status torque = feed_forward_.Evaluate(set.q, set.qd, set.qdd, raw.temperature_degC, since_s, tau_Nm);
    const core::Status sample = estimator_.Push(raw);
    return core::IsOk(sample) ? torque : sample;
  }

  // One bounded slice of everything that has time. False: nothing was left to do. Context: background.
  bool Background() {
    device_.Step(clock_.Ms());
    const bool busy = estimator_.Step();
    estimator_.Take(estimates_);
    live_.feedforward_state = static_cast<std::uint16_t>(!feed_forward_.valid() ? 0 : feed_forward_.blending() ? 2 : 1);
    live_.generation = generation_;
    live_.tick = clock_.Ticks();
    live_.enabled_axes = enabled_axes_.load(std::memory_order_relaxed);
    live_.clamp_count = feed_forward_.clamp_count();
    live_.sample_gaps = estimator_.refused_samples();
    live_.rows_used[0] = Sum(estimates_.rows_used);
    live_.rows_gated[0] = Sum(estimates_.rows_gated);
    return busy || store_.busy();
  }

  link::PduEngine& engine() { return device_.engine(); }

 private:
  static link::Identity Describe() {
    link::Identity identity;
    identity.schema = Model::kSchema;
    identity.axes = n;
    identity.parameters = Model::kParameters;
    identity.columns = Model::kColumns;
    identity.capabilities =
        link::reg::kHasFilterA | link::reg::kHasFeedForward | link::reg::kHasMonitor | link::reg::kHasResiduals;
    identity.tick_rate_Hz = static_cast<std::uint32_t>(Model::kTickRate_Hz);
    identity.sample_ticks = Model::kSampleTicks;
    identity.texts = {"armcal", Model::kName, "1"};
    return identity;
  }

  static void TakeResiduals(void* context, int joint, link::ResidualPage& page) {
    static_assert(monitor::ResidualBins::kValues == link::reg::kResidualBinValues &&
                  monitor::ResidualStatistics<n>::kValues == link::reg::kResidualValueCount);
    const auto& drive = *static_cast<const Drive*>(context);
    page.generation = drive.generation_;
    page.elapsed_s = drive.residuals_.elapsed_s();
    page.sigma_Nm = drive.images_[drive.in_force_].sigma_Nm[joint];
    drive.residuals_.Write(joint, page.values);
  }

  static std::uint32_t Sum(const std::uint32_t (&rows)[n]) {
    std::uint32_t sum = 0;
    for (const std::uint32_t count : rows) sum += count;
    return sum;
  }

  // The image that nobody reads: estimator and feed-forward hold the other one, or a copy.
  estimator::Image<Model>& Spare() { return images_[1 - in_force_]; }

  static core::Status Check(void* context, const std::uint16_t* words, std::uint32_t) {
    auto& drive = *static_cast<Drive*>(context);
    const core::Status decoded = model::Decode(words, Model::kSchema, drive.table_);
    if (!core::IsOk(decoded)) return decoded;
    return estimator::BuildImage(drive.table_, drive.generation_ + 1, drive.work_, drive.Spare());
  }

  static core::Status Permit(void* context, const std::uint16_t* words, std::uint32_t) {
    auto& drive = *static_cast<Drive*>(context);
    const core::Status decoded = model::Decode(words, Model::kSchema, drive.table_);
    if (!core::IsOk(decoded)) return decoded;
    const bool enabled = drive.enabled_axes_.load(std::memory_order_relaxed) != 0;
    const bool bumpless = (drive.table_.flags & model::kFlagBumpless) != 0;
    return enabled && !bumpless ? core::Status::kAxisEnabled : core::Status::kOk;
  }

  static core::Status Adopt(void* context, const std::uint16_t* words, std::uint32_t count) {
    auto& drive = *static_cast<Drive*>(context);
    const core::Status built = Check(context, words, count);
    if (!core::IsOk(built)) return built;
    estimator::Image<Model>& image = drive.Spare();
    const bool enabled = drive.enabled_axes_.load(std::memory_order_relaxed) != 0;
    const core::Status offered = drive.feed_forward_.Offer(image.committed, enabled);
    if (!core::IsOk(offered)) return offered;
    drive.PutInForce(image);
    return core::Status::kOk;
  }

  void PutInForce(estimator::Image<Model>& image) {
    adopted_tick_.store(clock_.Ticks(), std::memory_order_relaxed);
    estimator_.Adopt(image, clock_.Ticks());
    in_force_ = 1 - in_force_;
    generation_ = image.committed.generation;
  }

  port::Clock clock_;
  std::uint16_t staged_[kWords] = {}, active_[kWords] = {};
  table::TableStore store_;
  link::TableTransaction transaction_;
  link::LiveStatus live_;
  link::Device device_;

  feedforward::FeedForward<Model> feed_forward_;
  estimator::Estimator<Model, filter::ForgettingFilter<Model>> estimator_;
  estimator::Estimates<Model> estimates_;
  monitor::ResidualStatistics<n> residuals_;
  link::ResidualPages residual_pages_{TakeResiduals, this, n};
  estimator::Table<Model> table_;
  estimator::ImageWork<Model> work_;
  estimator::Image<Model> images_[2];
  int in_force_ = 0;
  std::uint32_t generation_ = 0;
  std::atomic<std::uint32_t> adopted_tick_{0};
  std::atomic<std::uint32_t> enabled_axes_{0};
};

}  // namespace armcal::application

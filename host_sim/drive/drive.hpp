// drive - a simulated drive: plant + lib + player, served over Modbus TCP; compiled once for each generated model.
#pragma once

#include <atomic>
#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "armcal/estimator/estimator.hpp"
#include "armcal/estimator/image.hpp"
#include "armcal/estimator/trace_records.hpp"
#include "armcal/feedforward/feed_forward.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/link/device.hpp"
#include "armcal/link/residual_registers.hpp"
#include "armcal/link/tcp_service.hpp"
#include "armcal/link/trace_registers.hpp"
#include "codegen/src/robot/robot.hpp"
#include "host_sim/drive/player.hpp"
#include "host_sim/drive/vendor_block.hpp"
#include "host_sim/plant/arm.hpp"
#include "port/linux/file_storage.hpp"
#include "port/linux/steady_clock.hpp"
#include "port/linux/tcp_server.hpp"

namespace armcal::drive {

struct DriveOptions {
  std::string scenario, robot, storage, truth_log, address = "127.0.0.1";
  int port = 0;
  bool real_time = false;
};

// Two threads as on a target: the tick (signal path, feed-forward, trace, push) and the background (link, table,
// estimators). They meet only in lib's ring and mailboxes and in atomics of the player. Without --real-time virtual
// time waits for the background to keep up and stands still while nothing moves; that is the simulator's privilege,
// never lib's.
template <class Model>
class Drive {
 public:
  static constexpr int n = Model::kJoints;
  using Table = estimator::Table<Model>;

  explicit Drive(const DriveOptions& o)
      : options_(o),
        robot_(codegen::ReadRobot(o.robot)),
        arm_(plant::ReadScenario(o.scenario), o.robot),
        player_(n, arm_.tick_s(), Limits(robot_)),
        storage_(2, kSectorBytes, 8) {
    if (!core::IsOk(storage_.Open(o.storage)))
      throw io::InputError(o.storage + ": expected a file that can be written");
    store_ = std::make_unique<table::TableStore>(storage_.storage(), Model::kSchema, Table::kWords);
    const link::TableApplication application{this, &Check, &Permit, &Adopt};
    model::Encode(estimator::DefaultTable<Model>(), active_.data());
    transaction_ = std::make_unique<link::TableTransaction>(application, *store_, Model::kSchema, staged_.data(),
                                                            active_.data(), Table::kWords);
    link::Identity identity;
    identity.schema = Model::kSchema, identity.firmware_version = 1, identity.serial_number = 1;
    identity.axes = n, identity.parameters = Model::kParameters, identity.columns = Model::kColumns;
    identity.capabilities = link::reg::kHasFilterA | link::reg::kHasFilterB | link::reg::kHasRawTrace |
                            link::reg::kHasSampleTrace | link::reg::kHasFeedForward | link::reg::kHasMonitor |
                            link::reg::kHasResiduals;
    identity.tick_rate_Hz = static_cast<std::uint32_t>(Model::kTickRate_Hz),
    identity.sample_ticks = Model::kSampleTicks;
    identity.texts = {"armcal", Model::kName, "1"};
    device_ = std::make_unique<link::Device>(identity, live_, *transaction_);
    vendor_ = std::make_unique<VendorBlock>(player_, n);
    Require(device_->AddFloats(link::reg::kEstimateA, a_.value, Model::kColumns));
    Require(device_->AddFloats(link::reg::kDeviationA, a_.sd, Model::kColumns));
    Require(device_->AddFloats(link::reg::kEstimateB, b_.value, Model::kColumns));
    Require(device_->AddFloats(link::reg::kDeviationB, b_.sd, Model::kColumns));
    Require(device_->AddFloats(link::reg::kResidualRms, a_.residual_rms_Nm, n));
    Require(device_->AddFloats(link::reg::kConsistency, b_.nis, n));
    Require(link::ServeTrace(device_->map(), 0, raw_trace_));
    Require(link::ServeTrace(device_->map(), 1, sample_trace_));
    Require(residual_pages_.Serve(device_->map()));
    Require(vendor_->Serve(device_->map()));
    forgetting_.SetResiduals(&residuals_);
    forgetting_.SetObserver(&OnSample, this);
    // Defaults run the estimators; feed-forward stays off until a table is stored and adopted.
    Table table = estimator::DefaultTable<Model>();
    Require(estimator::BuildImage<Model>(table, ++generation_, work_, images_[active_image_]));
    forgetting_.Adopt(images_[active_image_], tick_);
    kalman_.Adopt(images_[active_image_], tick_);
    (void)transaction_->Boot();  // its answer is served as table_status
    if (!o.truth_log.empty() && !(truth_ = std::fopen(o.truth_log.c_str(), "wb")))
      throw io::InputError(o.truth_log + ": cannot be written");
    arm_.SetBrakes(true);
    arm_.Read(sensors_);
  }
  ~Drive() {
    if (truth_) std::fclose(truth_);
  }
  Drive(const Drive&) = delete;

  // Serves until `quit`. on_listen(port) is called once. Throws io::InputError if the port cannot be had.
  template <class OnListen>
  void Run(const std::atomic<bool>& quit, OnListen on_listen) {
    const port::Clock clock = port_linux::SteadyClock(clock_ticks_);
    link::TcpService<port_linux::TcpServer::kSlots> service(device_->engine());
    using Service = decltype(service);
    port_linux::TcpServer server({&service, Service::kMaxReply, &Service::Open, &Service::Receive, &Service::MidFrame},
                                 clock);
    if (!core::IsOk(server.Listen(options_.address, static_cast<std::uint16_t>(options_.port))))
      throw io::InputError(server.error());
    on_listen(server.port());
    std::thread tick([&] { TickLoop(quit); });
    const auto start = std::chrono::steady_clock::now();
    while (!quit.load()) {
      const bool busy = Background();
      const auto elapsed = std::chrono::steady_clock::now() - start;
      device_->Step(static_cast<std::uint32_t>(std::chrono::duration_cast<std::chrono::milliseconds>(elapsed).count()));
      (void)server.Poll(busy ? 0 : 1);  // an error here is one connection's
    }
    tick.join();
  }

 private:
  static constexpr std::uint32_t kSectorBytes = 16384;
  static constexpr int kSlices = 200;           // background slices between two looks at the sockets
  static constexpr std::uint32_t kBacklog = 8;  // samples that may wait before virtual time does
  static constexpr int kSettleTicks = 240;      // virtual ticks that run on after an enable, an adoption or a motion
  static constexpr int kBrakeTicks = 40;        // current builds up before the brakes open

  static void Require(core::Status s) {
    if (!core::IsOk(s)) throw std::logic_error("drive: a block of registers does not fit the map");
  }

  static MotionLimits Limits(const codegen::Robot& robot) {
    if (robot.joints() != n || robot.control.kp_Nmprad.empty())
      throw io::InputError(robot.path +
                           ": control: expected the joint controller's gains (kp_Nmprad, kd_Nmsprad), one a joint");
    if (!robot.coupling.empty())
      throw io::InputError(robot.path + ": coupling: the simulated drive's controller knows none");
    MotionLimits limits{Eigen::VectorXd(n), Eigen::VectorXd(n)};
    for (int j = 0; j < n; ++j) {
      limits.speed_radps[j] = robot.joint[j].speed_limit_radps;
      limits.acceleration_radps2[j] = robot.joint[j].acceleration_limit_radps2;
    }
    return limits;
  }

  // Table callbacks. Context: background.
  static core::Status Check(void* self, const std::uint16_t* words, std::uint32_t count) {
    auto& d = *static_cast<Drive*>(self);
    if (count != Table::kWords) return core::Status::kWrongSize;
    const core::Status decoded = model::Decode(words, Model::kSchema, d.table_);
    if (!core::IsOk(decoded)) return decoded;
    return estimator::BuildImage<Model>(d.table_, d.generation_ + 1, d.work_, d.images_[1 - d.active_image_]);
  }
  static core::Status Permit(void* self, const std::uint16_t* words, std::uint32_t) {
    auto& d = *static_cast<Drive*>(self);
    return d.player_.enabled() && !(words[5] & model::kFlagBumpless) ? core::Status::kAxisEnabled : core::Status::kOk;
  }
  static core::Status Adopt(void* self, const std::uint16_t* words, std::uint32_t count) {
    auto& d = *static_cast<Drive*>(self);
    const core::Status built = Check(self, words, count);
    if (!core::IsOk(built)) return built;
    const estimator::Image<Model>& image = d.images_[1 - d.active_image_];
    const core::Status offered = d.feedforward_.Offer(image.committed, d.player_.enabled());
    if (!core::IsOk(offered)) return offered;
    d.active_image_ = 1 - d.active_image_;
    ++d.generation_;
    d.adopted_tick_ = d.tick_.load();
    d.forgetting_.Adopt(image, d.adopted_tick_);
    d.kalman_.Adopt(image, d.adopted_tick_);
    d.grant_ = kSettleTicks;
    return core::Status::kOk;
  }

  static void TakeResiduals(void* self, int joint, link::ResidualPage& page) {
    static_assert(monitor::ResidualBins::kValues == link::reg::kResidualBinValues &&
                  monitor::ResidualStatistics<n>::kValues == link::reg::kResidualValueCount);
    const auto& d = *static_cast<const Drive*>(self);
    page.generation = d.generation_;
    page.elapsed_s = d.residuals_.elapsed_s();
    page.sigma_Nm = d.images_[d.active_image_].sigma_Nm[joint];
    d.residuals_.Write(joint, page.values);
  }

  static void OnSample(void* self, const model::Sample<n>& sample, const float* tau_model_Nm) {
    auto& d = *static_cast<Drive*>(self);
    ++d.samples_seen_;
    if (!d.sample_trace_.Offer(sample.tick).last) return;
    std::uint16_t record[estimator::SampleRecordWords<n>(estimator::kSampleAll)];
    estimator::WriteSampleRecord<n>(sample, tau_model_Nm, record);
    (void)d.sample_trace_.Push(record, d.generation_);  // a refusal is counted in the trace
  }

  bool Background() {
    bool busy = false;
    for (int k = 0; k < kSlices; ++k) {
      // A streaming reader that is behind holds the estimator up, and through its ring virtual time.
      const bool room =
          options_.real_time || sample_trace_.armed().mode != link::TraceMode::kStreaming || sample_trace_.room() > 2;
      const bool a = room && forgetting_.Step(), b = kalman_.Step();
      if (!a && !b) break;
      busy = true;
    }
    (void)forgetting_.Take(a_);
    (void)kalman_.Take(b_);
    if (!busy && !player_.moving() &&
        read_out_at_ != samples_seen_) {  // what a reader finds after a motion is its last word
      read_out_at_ = samples_seen_;
      forgetting_.RequestReadOut();
      kalman_.RequestReadOut();
    }
    live_.feedforward_state = static_cast<std::uint16_t>(ff_state_.load());
    live_.generation = generation_;
    live_.tick = tick_.load();
    live_.enabled_axes = player_.enabled() ? (1u << n) - 1 : 0;
    live_.clamp_count = clamps_.load();
    live_.sample_gaps = forgetting_.refused_samples();
    for (int f = 0; f < 2; ++f) live_.rows_used[f] = live_.rows_gated[f] = 0;
    for (int j = 0; j < n; ++j) {
      live_.rows_used[0] += a_.rows_used[j], live_.rows_gated[0] += a_.rows_gated[j];
      live_.rows_used[1] += b_.rows_used[j], live_.rows_gated[1] += b_.rows_gated[j];
    }
    return busy;
  }

  void TickLoop(const std::atomic<bool>& quit) {
    auto next = std::chrono::steady_clock::now();
    while (!quit.load()) {
      if (options_.real_time) {
        next += std::chrono::duration_cast<std::chrono::steady_clock::duration>(
            std::chrono::duration<double>(arm_.tick_s()));
        std::this_thread::sleep_until(next);
      } else if (!MayAdvance()) {
        std::this_thread::yield();
        if (!player_.moving())
          std::this_thread::sleep_for(std::chrono::microseconds(200));  // idle: leave the core to others
        continue;
      }
      Tick();
    }
  }
  bool MayAdvance() {
    if (raw_trace_.armed().mode == link::TraceMode::kStreaming && raw_trace_.room() < 2) return false;
    if (forgetting_.pending() > kBacklog || kalman_.pending() > kBacklog) return false;
    return player_.moving() || player_.command_pending() || grant_.load() > 0;
  }

  // One control tick. Context: tick.
  void Tick() {
    const std::uint32_t tick = tick_.load();
    const PlayerState before = player_.state();
    Eigen::VectorXd q(n), qd(n);
    for (int j = 0; j < n; ++j) {
      const model::AxisInfo& axis = Model::kAxes[j];
      const auto scale = static_cast<double>(axis.counts_to_rad);
      q[j] = scale * (static_cast<double>(sensors_.counts[j]) - axis.zero_counts);
      qd[j] = have_previous_ ? scale * (sensors_.counts[j] - previous_counts_[j]) / arm_.tick_s() : 0;
    }
    previous_counts_ = sensors_.counts;
    have_previous_ = true;
    // A tick ends where its set-point lies: the controller compares what was measured at its start with the set-point
    // before.
    const SetPoint reference =
        player_.enabled() ? last_set_ : SetPoint{q, Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
    const SetPoint& set = player_.Step(tick, q);
    last_set_ = set;
    float sq[n], sv[n], sa[n], temperature[n], tau_ff[n];
    for (int j = 0; j < n; ++j) {
      sq[j] = static_cast<float>(set.q[j]), sv[j] = static_cast<float>(set.qd[j]),
      sa[j] = static_cast<float>(set.qdd[j]);
      temperature[j] = static_cast<float>(sensors_.temperature_degC[j]);
    }
    const float since = static_cast<float>(tick - adopted_tick_.load()) / Model::kTickRate_Hz;
    (void)feedforward_.Evaluate(sq, sv, sa, temperature, since, tau_ff);  // its state is served below
    ff_state_ = feedforward_.valid() ? (feedforward_.blending() ? 2 : 1) : 0;
    clamps_ = feedforward_.clamp_count();

    const bool enabled = player_.enabled();
    enabled_ticks_ = enabled ? enabled_ticks_ + 1 : 0;
    arm_.SetBrakes(enabled_ticks_ < kBrakeTicks);
    std::vector<double> command(n, 0.0);
    for (int j = 0; j < n && enabled; ++j) {
      const double tau = robot_.control.kp_Nmprad[j] * (reference.q[j] - q[j]) +
                         robot_.control.kd_Nmsprad[j] * (reference.qd[j] - qd[j]) + static_cast<double>(tau_ff[j]);
      const double scale =
          static_cast<double>(feedforward_.valid() ? images_[active_image_].committed.torque_scale[j] : 1.0f);
      command[j] =
          tau / (scale * static_cast<double>(Model::kAxes[j].lsb_to_Nm)) * robot_.joint[j].motor.current_A_per_lsb;
    }
    arm_.Step(command, sensors_);

    model::RawSample<n> raw;
    raw.tick = tick;
    for (int j = 0; j < n; ++j) {
      raw.counts[j] = sensors_.counts[j];
      raw.current[j] = sensors_.current_lsb[j];
      raw.flags[j] = static_cast<std::uint8_t>((enabled && enabled_ticks_ > kBrakeTicks ? model::kEnabled : 0) |
                                               (sensors_.saturated[j] ? model::kSaturated : 0));
      raw.temperature_degC[j] = static_cast<float>(sensors_.temperature_degC[j]);
    }
    (void)forgetting_.Push(raw);  // a refused sample is counted in the estimator
    (void)kalman_.Push(raw);
    const link::TraceTurn turn = raw_trace_.Offer(tick);
    if (turn.recording) {
      if (turn.first) raw_record_.Clear();
      raw_record_.Add(raw, sq, tau_ff);
      if (turn.last) {
        std::uint16_t words[estimator::RawRecordWords<n>(estimator::kRawAll)];
        raw_record_.Write(raw_trace_.armed().channels, words);
        (void)raw_trace_.Push(words, feedforward_.generation());
      }
    }
    if (truth_ && (player_.moving() || before == PlayerState::kPlaying)) WriteTruth(tick);
    tick_ = tick + 1;
    clock_ticks_ = tick + 1;
    if (!player_.moving()) grant_ = std::max(0, grant_.load() - 1);
    if (before != player_.state()) grant_ = kSettleTicks;
  }

  // What the current sensors would have read without noise, tick by tick: the floor that a perfect model leaves.
  void WriteTruth(std::uint32_t tick) {
    const Eigen::VectorXd tau = arm_.measured_torque_truth_Nm();
    std::fwrite(&tick, sizeof tick, 1, truth_);
    std::fwrite(tau.data(), sizeof(double), n, truth_);
    if (tick % 4096 == 0) std::fflush(truth_);
  }

  static std::uint16_t RawWords(void*, std::uint32_t channels) { return estimator::RawRecordWords<n>(channels); }
  static std::uint16_t SampleWords(void*, std::uint32_t channels) { return estimator::SampleRecordWords<n>(channels); }

  DriveOptions options_;
  codegen::Robot robot_;
  plant::Arm arm_;
  plant::Sensors sensors_;
  Player player_;
  port_linux::FileStorage storage_;
  std::unique_ptr<table::TableStore> store_;
  std::vector<std::uint16_t> staged_ = std::vector<std::uint16_t>(Table::kWords),
                             active_ = std::vector<std::uint16_t>(Table::kWords);
  std::unique_ptr<link::TableTransaction> transaction_;
  link::LiveStatus live_;
  std::unique_ptr<link::Device> device_;
  std::unique_ptr<VendorBlock> vendor_;
  link::TraceRing<> raw_trace_{1, &RawWords, nullptr}, sample_trace_{Model::kSampleTicks, &SampleWords, nullptr};
  monitor::ResidualStatistics<n> residuals_;
  link::ResidualPages residual_pages_{&TakeResiduals, this, n};
  estimator::Estimator<Model, filter::ForgettingFilter<Model>> forgetting_;
  estimator::Estimator<Model, filter::KalmanFilter<Model>> kalman_;
  estimator::Estimates<Model> a_, b_;
  feedforward::FeedForward<Model> feedforward_;
  estimator::ImageWork<Model> work_;
  estimator::Image<Model> images_[2];
  Table table_;
  std::atomic<int> active_image_{0};
  std::uint32_t generation_ = 0, samples_seen_ = 0, read_out_at_ = 0;
  std::atomic<std::uint32_t> adopted_tick_{0}, tick_{0}, clock_ticks_{0}, clamps_{0};
  std::atomic<int> ff_state_{0}, grant_{0};
  estimator::RawRecord<n> raw_record_;
  std::vector<std::int32_t> previous_counts_;
  bool have_previous_ = false;
  SetPoint last_set_;
  int enabled_ticks_ = 0;
  std::FILE* truth_ = nullptr;
};

}  // namespace armcal::drive

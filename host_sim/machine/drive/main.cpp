// drive - runs the simulated drive: plant, lib and player behind Modbus TCP. It is compiled once for each model.
#include <atomic>
#include <chrono>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <string>
#include <thread>
#include <vector>

#include <selected_model.hpp>
#include "armcal/controller/controller.hpp"
#include "armcal/controller/trace_records.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/link/tcp.hpp"
#include "armcal/link/trace.hpp"
#include "codegen/src/robot/robot.hpp"
#include "host_sim/machine/drive/player.hpp"
#include "host_sim/machine/drive/vendor_block.hpp"
#include "host_sim/machine/plant/arm.hpp"
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
// time waits for the background to keep up, and stands still while nothing moves. Only a simulator may do that; lib
// never waits.
template <class Model>
class Drive {
 public:
  static constexpr int n = Model::kJoints;

  explicit Drive(const DriveOptions& o)
      : options_(o),
        robot_(codegen::ReadRobot(o.robot)),
        arm_(plant::ReadScenario(o.scenario), o.robot),
        player_(n, arm_.tick_s(), Limits(robot_)),
        storage_(2, kSectorBytes, 8),
        controller_(Opened(storage_, o.storage), port_linux::SteadyClock(tick_), Identity(), Rules()),
        vendor_(player_, n) {
    Require(controller_.Record(raw_trace_));
    Require(sample_trace_.Serve(controller_.map(), 1));
    Require(vendor_.Serve(controller_.map()));
    controller_.template estimator<0>().SetObserver(&OnSample, this);
    (void)controller_.Boot();  // its answer is served as table_status
    if (!o.truth_log.empty() && !(truth_ = std::fopen(o.truth_log.c_str(), "wb")))
      throw io::InputError(o.truth_log + ": cannot be written");
    arm_.SetBrakes(true);
    arm_.Read(sensors_);
  }
  ~Drive() {
    if (truth_) std::fclose(truth_);
  }
  Drive(const Drive&) = delete;

  // Serves until `quit`. on_listen(port) is called once. Throws io::InputError if the port is taken.
  template <class OnListen>
  void Run(const std::atomic<bool>& quit, OnListen on_listen) {
    link::TcpService<port_linux::TcpServer::kSlots> service(controller_.engine());
    using Service = decltype(service);
    port_linux::TcpServer server({&service, Service::kMaxReply, &Service::Open, &Service::Receive, &Service::MidFrame,
                                  &Service::Close, &Service::Keep},
                                 port_linux::SteadyClock(tick_));
    if (!core::IsOk(server.Listen(options_.address, static_cast<std::uint16_t>(options_.port))))
      throw io::InputError(server.error());
    on_listen(server.port());
    std::thread tick([&] { TickLoop(quit); });
    while (!quit.load()) (void)server.Poll(Background() ? 0 : 1);  // an error here is one connection's
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

  static link::Identity Identity() {
    link::Identity identity;
    identity.firmware_version = 1, identity.serial_number = 1;
    identity.capabilities = link::reg::kHasSampleTrace;
    return identity;
  }
  // A file does not wear out.
  static controller::BoardRules Rules() {
    controller::BoardRules rules;
    rules.saves.interval_ms = 0;
    return rules;
  }
  static hardware::Storage Opened(port_linux::FileStorage& storage, const std::string& path) {
    if (!core::IsOk(storage.Open(path))) throw io::InputError(path + ": expected a file that can be written");
    return storage.storage();
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

  static void OnSample(void* self, const model::Sample<n>& sample, const float* tau_model_Nm) {
    auto& d = *static_cast<Drive*>(self);
    ++d.samples_seen_;
    if (!d.sample_trace_.Offer(sample.tick).last) return;
    std::uint16_t record[controller::SampleRecordWords<n>(controller::kSampleAll)];
    controller::WriteSampleRecord<n>(sample, tau_model_Nm, record);
    (void)d.sample_trace_.Push(record, d.controller_.generation());  // a refusal is counted in the trace
  }

  bool Background() {
    controller_.SetEnabledAxes(player_.enabled() ? (1u << n) - 1 : 0);
    const std::uint32_t generation = controller_.generation();
    bool busy = false;
    for (int k = 0; k < kSlices; ++k) {
      // A streaming reader that is behind holds the estimators up, and through their rings virtual time.
      const bool room = options_.real_time || sample_trace_.recording().mode != link::TraceMode::kStreaming ||
                        sample_trace_.room() > 2;
      if (!room || !controller_.Step()) break;
      busy = true;
    }
    if (!busy && !player_.moving() &&
        read_out_at_ != samples_seen_) {  // what a reader finds after a motion is its last word
      read_out_at_ = samples_seen_;
      controller_.template estimator<0>().RequestReadOut();
      controller_.template estimator<1>().RequestReadOut();
    }
    if (controller_.generation() != generation) grant_ = kSettleTicks;
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
    if (raw_trace_.recording().mode == link::TraceMode::kStreaming && raw_trace_.room() < 2) return false;
    if (controller_.template estimator<0>().pending() > kBacklog) return false;
    return player_.moving() || player_.command_pending() || grant_.load() > 0;
  }

  // One control tick. Context: tick.
  void Tick() {
    const std::uint32_t tick = tick_.load();
    const client::PlayerState before = player_.state();
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
    controller::SetPoint<n> target;
    float temperature[n], tau_ff[n];
    for (int j = 0; j < n; ++j) {
      target.q[j] = static_cast<float>(set.q[j]);
      target.qd[j] = static_cast<float>(set.qd[j]);
      target.qdd[j] = static_cast<float>(set.qdd[j]);
      temperature[j] = static_cast<float>(sensors_.temperature_degC[j]);
    }
    (void)controller_.FeedForward(target, temperature, tau_ff);  // its state is served

    const bool enabled = player_.enabled();
    enabled_ticks_ = enabled ? enabled_ticks_ + 1 : 0;
    arm_.SetBrakes(enabled_ticks_ < kBrakeTicks);
    std::vector<double> command(n, 0.0);
    for (int j = 0; j < n && enabled; ++j) {
      const double tau = robot_.control.kp_Nmprad[j] * (reference.q[j] - q[j]) +
                         robot_.control.kd_Nmsprad[j] * (reference.qd[j] - qd[j]) + static_cast<double>(tau_ff[j]);
      const double scale = controller_.feed_forward().valid()
                               ? static_cast<double>(controller_.adopted().committed.torque_scale[j])
                               : 1.0;
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
    (void)controller_.Push(raw);  // a refused sample is counted and served
    if (truth_ && (player_.moving() || before == client::PlayerState::kPlaying)) WriteTruth(tick);
    tick_ = tick + 1;
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

  static std::uint16_t SampleWords(void*, std::uint32_t channels) { return controller::SampleRecordWords<n>(channels); }

  DriveOptions options_;
  codegen::Robot robot_;
  plant::Arm arm_;
  plant::Sensors sensors_;
  Player player_;
  port_linux::FileStorage storage_;
  std::atomic<std::uint32_t> tick_{0};  // the controller's clock
  controller::Controller<Model, filter::ForgettingFilter<Model>, filter::KalmanFilter<Model>> controller_;
  VendorBlock vendor_;
  controller::RawTrace<Model> raw_trace_;
  link::TraceRing<> sample_trace_{Model::kSampleTicks, &SampleWords, nullptr};
  std::uint32_t samples_seen_ = 0, read_out_at_ = 0;
  std::atomic<int> grant_{0};
  std::vector<std::int32_t> previous_counts_;
  bool have_previous_ = false;
  SetPoint last_set_;
  int enabled_ticks_ = 0;
  std::FILE* truth_ = nullptr;
};

}  // namespace armcal::drive

namespace {

std::atomic<bool> quit{false};

int Main(int argc, char** argv) {
  armcal::drive::DriveOptions o;
  const auto value = [&](int& i) -> std::string {
    if (i + 1 >= argc) throw armcal::io::InputError(std::string(argv[i]) + ": expected a value");
    return argv[++i];
  };
  for (int i = 1; i < argc; ++i) {
    if (!std::strcmp(argv[i], "--scenario")) o.scenario = value(i);
    else if (!std::strcmp(argv[i], "--robot")) o.robot = value(i);
    else if (!std::strcmp(argv[i], "--storage")) o.storage = value(i);
    else if (!std::strcmp(argv[i], "--truth-log")) o.truth_log = value(i);
    else if (!std::strcmp(argv[i], "--port")) o.port = std::stoi(value(i));
    else if (!std::strcmp(argv[i], "--real-time")) o.real_time = true;
    else throw armcal::io::InputError(std::string(argv[i]) + ": no such option of the simulated drive");
  }
  const auto drive = std::make_unique<armcal::drive::Drive<armcal::generated::SelectedModel>>(o);
  drive->Run(quit, [&](int port) {
    std::printf("drive: %s, schema %08X, listening on %s:%d\n", armcal::generated::SelectedModel::kName,
                static_cast<unsigned>(armcal::generated::SelectedModel::kSchema), o.address.c_str(), port);
    std::fflush(stdout);
  });
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  std::signal(SIGTERM, [](int) { quit = true; });
  std::signal(SIGINT, [](int) { quit = true; });
  std::signal(SIGPIPE, SIG_IGN);
  try {
    return Main(argc, argv);
  } catch (const std::exception& e) {
    std::fprintf(stderr, "armcal drive: %s\n", e.what());
    return 2;
  }
}

// drive - lib's controller for one model, behind Modbus TCP and RTU. Compiled once for each model, linked in or loaded.
#include "host_sim/machine/drive/firmware.hpp"

#include <algorithm>
#include <array>
#include <atomic>
#include <memory>
#include <optional>

#include <selected_model.hpp>
#include "armcal/controller/controller.hpp"
#include "armcal/controller/trace_records.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/link/rtu.hpp"
#include "armcal/link/tcp.hpp"
#include "armcal/link/trace.hpp"
#include "host_sim/machine/drive/vendor_block.hpp"
#include "port/linux/file_storage.hpp"
#include "port/linux/steady_clock.hpp"
#include "port/linux/tcp_server.hpp"
#include "port/linux/tty_serial.hpp"

namespace armcal::drive {
namespace {

template <class Model>
class Compiled final : public Firmware {
 public:
  static constexpr int n = Model::kJoints;

  explicit Compiled(const std::uint8_t* key)
      : storage_(2, kSectorBytes, 8),
        key_(key == nullptr ? std::nullopt : std::optional(CopyOf(key))),
        controller_(storage_.storage(), port_linux::SteadyClock(tick_), Identity(),
                    Rules(key_ ? key_->data() : nullptr)),
        service_(controller_.engine()),
        read_service_(controller_.engine(), link::Rights::kRead),
        server_(Bytes(service_), port_linux::SteadyClock(tick_)) {}

  const char* name() const override { return Model::kName; }
  std::uint32_t schema() const override { return Model::kSchema; }
  int joints() const override { return n; }
  AxisScale axis(int j) const override {
    const model::AxisInfo& axis = Model::kAxes[j];
    return {static_cast<double>(axis.counts_to_rad), axis.zero_counts, static_cast<double>(axis.lsb_to_Nm)};
  }

  std::string Start(const std::string& storage, const Access& access, PlayedMotion& motion) override {
    const core::Status opened = storage_.Open(storage);
    if (opened == core::Status::kBusy) return storage + ": another drive uses it; give each drive its own --storage";
    if (!core::IsOk(opened)) return storage + ": expected a file that can be written";
    vendor_ = std::make_unique<VendorBlock>(motion, n);
    if (!core::IsOk(controller_.Record(raw_trace_)) || !core::IsOk(sample_trace_.Serve(controller_.map(), 1)) ||
        !core::IsOk(vendor_->Serve(controller_.map())))
      return kNoRoom;
    controller_.template estimator<0>().SetObserver(&OnSample, this);
    if (controller_.Boot() == core::Status::kFull)  // any other answer is served as table_status
      return kNoRoom;
    if (!access.serial.empty()) {
      if (!core::IsOk(line_.Open(access.serial))) return access.serial + ": expected a terminal that can be opened";
      modbus_.emplace(controller_.engine(), line_.serial(), port_linux::SteadyClock(tick_), kAddress, kSilence_ms);
    }
    if (!core::IsOk(server_.Listen(access.address, static_cast<std::uint16_t>(access.port))))
      return server_.error() + "; choose another --port";
    if (access.read_address.empty()) return "";
    reader_.emplace(Bytes(read_service_), port_linux::SteadyClock(tick_));
    if (!core::IsOk(reader_->Listen(access.read_address, static_cast<std::uint16_t>(access.read_port))))
      return reader_->error() + "; choose another --read-port";
    return "";
  }
  int port() const override { return server_.port(); }
  int read_port() const override { return reader_ ? reader_->port() : 0; }

  bool Work(bool wait) override {
    bool busy = false;
    for (int k = 0; k < kSlices; ++k) {
      const bool room =
          !wait || sample_trace_.recording().mode != link::TraceMode::kStreaming || sample_trace_.room() > 2;
      if (!room || !controller_.Step()) break;
      busy = true;
    }
    return busy;
  }
  void Serve(int timeout_ms) override {
    (void)server_.Poll(timeout_ms);  // an error here is one connection's
    if (reader_) (void)reader_->Poll(0);
    if (modbus_) modbus_->Poll();
  }
  void Publish() override {
    if (read_out_at_ == samples_seen_) return;
    read_out_at_ = samples_seen_;
    controller_.template estimator<0>().RequestReadOut();
    controller_.template estimator<1>().RequestReadOut();
  }
  std::uint32_t generation() const override { return controller_.generation(); }

  bool KeepsUp() override {
    if (raw_trace_.recording().mode == link::TraceMode::kStreaming && raw_trace_.room() < 2) return false;
    return controller_.template estimator<0>().pending() <= kBacklog;
  }
  std::uint32_t tick() const override { return tick_.load(); }
  void SetEnabled(bool enabled) override { controller_.SetEnabledAxes(enabled ? (1u << n) - 1 : 0); }
  void FeedForward(const double* q, const double* qd, const double* qdd, const double* temperature_degC,
                   double* tau_Nm) override {
    controller::SetPoint<n> target;
    float temperature[n], tau[n];
    for (int j = 0; j < n; ++j) {
      target.q[j] = static_cast<float>(q[j]);
      target.qd[j] = static_cast<float>(qd[j]);
      target.qdd[j] = static_cast<float>(qdd[j]);
      temperature[j] = static_cast<float>(temperature_degC[j]);
    }
    (void)controller_.FeedForward(target, temperature, tau);  // its state is served
    for (int j = 0; j < n; ++j) tau_Nm[j] = static_cast<double>(tau[j]);
  }
  double torque_scale(int j) const override { return static_cast<double>(controller_.feed_forward().torque_scale(j)); }
  void ReportTrackingError() override { controller_.ReportTrackingError(); }
  void Push(const Reading* readings) override {
    const std::uint32_t tick = tick_.load();
    model::RawSample<n> raw;
    raw.tick = tick;
    raw.latch_ns = tick * model::TickLength_ns(Model::kTickRate_Hz);
    raw.stamped = true;
    for (int j = 0; j < n; ++j) {
      raw.counts[j] = readings[j].counts;
      raw.current[j] = readings[j].current_lsb;
      raw.flags[j] = static_cast<std::uint8_t>((readings[j].enabled ? model::kEnabled : 0) |
                                               (readings[j].saturated ? model::kSaturated : 0));
      raw.temperature_degC[j] = readings[j].temperature_degC;
    }
    (void)controller_.Push(raw);  // a refused sample is counted and served
    tick_ = tick + 1;
  }

 private:
  static constexpr const char* kNoRoom = "drive: a block of registers does not fit the map";
  static constexpr std::uint32_t kSectorBytes = 16384;
  static constexpr int kSlices = 200;  // of lib's work between two looks at the sockets
  static constexpr std::uint8_t kAddress = 1;
  static constexpr std::uint32_t kSilence_ms = 20;  // a pseudo-terminal keeps no pauses
  static constexpr std::uint32_t kBacklog = 8;      // samples that may wait before virtual time does
  using Service = link::TcpService<port_linux::TcpServer::kSlots>;

  static port_linux::ByteService Bytes(Service& service) {
    return {&service,           Service::kMaxReply, &Service::Open, &Service::Receive,
            &Service::MidFrame, &Service::Close,    &Service::Keep, &Service::Asked};
  }
  static link::Identity Identity() {
    link::Identity identity;
    identity.firmware_version = 1, identity.serial_number = 1;
    identity.capabilities = link::reg::kHasSampleTrace;
    return identity;
  }
  using Key = std::array<std::uint8_t, link::kKeyBytes>;
  static Key CopyOf(const std::uint8_t* key) {
    Key copy;
    std::copy(key, key + copy.size(), copy.begin());
    return copy;
  }
  // A file does not wear out.
  static controller::BoardRules Rules(const std::uint8_t* key) {
    controller::BoardRules rules;
    rules.saves.interval_ms = 0;
    rules.signing.key = key;
    return rules;
  }

  static void OnSample(void* self, const model::Sample<n>& sample, const float* tau_model_Nm) {
    auto& f = *static_cast<Compiled*>(self);
    ++f.samples_seen_;
    if (!f.sample_trace_.Offer(sample.tick).last) return;
    std::uint16_t record[controller::SampleRecordWords<n>(controller::kSampleAll)];
    controller::WriteSampleRecord<n>(sample, tau_model_Nm, record);
    (void)f.sample_trace_.Push(record, f.controller_.generation());  // a refusal is counted in the trace
  }
  static std::uint16_t SampleWords(void*, std::uint32_t channels) { return controller::SampleRecordWords<n>(channels); }

  std::atomic<std::uint32_t> tick_{0};  // the controller's clock
  port_linux::FileStorage storage_;
  std::optional<Key> key_;
  controller::Controller<Model, filter::ForgettingFilter<Model>, filter::KalmanFilter<Model>> controller_;
  std::unique_ptr<VendorBlock> vendor_;
  controller::RawTrace<Model> raw_trace_;
  link::TraceRing<> sample_trace_{Model::kSampleTicks, &SampleWords, nullptr};
  std::uint32_t samples_seen_ = 0, read_out_at_ = 0;
  Service service_, read_service_;
  port_linux::TcpServer server_;
  std::optional<port_linux::TcpServer> reader_;
  port_linux::TtySerial line_;
  std::optional<link::RtuService> modbus_;
};

}  // namespace
}  // namespace armcal::drive

extern "C" __attribute__((visibility("default"))) armcal::drive::Firmware* MakeArmcalFirmware(int interface,
                                                                                              const std::uint8_t* key) {
  if (interface != armcal::drive::kFirmwareInterface) return nullptr;
  return new armcal::drive::Compiled<armcal::generated::SelectedModel>(key);
}

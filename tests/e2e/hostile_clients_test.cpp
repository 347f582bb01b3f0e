// end-to-end tests - ten hostile clients from addresses of their own attack a drive that serves others meanwhile.
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <functional>
#include <random>
#include <thread>

#include "armcal/core/crc.hpp"
#include "armcal/link/register_words.hpp"
#include "host_sim/client/drive_client.hpp"
#include "host_sim/client/table_flash.hpp"
#include "tests/e2e/modbus_master.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

using modbus::Bytes;
using modbus::TcpLine;
using Time = std::chrono::steady_clock;

const Bytes kRead = modbus::ReadInput(0, 20);

// What a hostile client does until the attack ends. It connects again when the drive closes its connection.
struct Hostile {
  int port, from;
  const std::atomic<bool>& stop;

  void WhileConnected(const std::function<bool(TcpLine&)>& act) const {
    while (!stop) {
      TcpLine line(port, from);
      while (!stop && act(line)) {
      }
    }
  }
  static void Pause(int ms) { std::this_thread::sleep_for(std::chrono::milliseconds(ms)); }

  void Silent() const {
    WhileConnected([](TcpLine& line) { return line.Receive(200), line.connected(); });
  }
  void Slow() const {
    WhileConnected([&](TcpLine& line) {
      for (const std::uint8_t byte : TcpLine::Frame(1, 1, kRead)) {
        if (stop || !line.Send({byte})) return false;
        Pause(150);
      }
      line.Receive(10);
      return line.connected();
    });
  }
  void Flooding() const {
    WhileConnected([](TcpLine& line) { return line.Send(TcpLine::Frame(1, 1, kRead)) && !line.Receive(100).empty(); });
  }
  void Pipelining() const {
    Bytes many;
    for (int k = 0; k < 80; ++k) many = modbus::Joined(many, TcpLine::Frame(k, 1, modbus::ReadHolding(0x2000, 125)));
    WhileConnected([&](TcpLine& line) {
      if (!line.Send(many)) return false;
      for (int k = 0; k < 80; ++k)
        if (line.Receive(100).empty()) return false;
      return true;
    });
  }
  void NeverReading() const {
    const Bytes frame = TcpLine::Frame(1, 1, modbus::ReadHolding(0x2000, 125));
    WhileConnected([&](TcpLine& line) {
      const bool taken = line.Send(frame);
      if (!taken) Pause(100);
      return line.connected() && (taken || line.Send({}));
    });
  }
  void Garbage() const {
    std::mt19937 random(static_cast<unsigned>(from));
    WhileConnected([&](TcpLine& line) {
      Bytes bytes(1 + random() % 300);
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random());
      // Every other time a header that is sound, so that the drive reads on.
      if (random() % 2) bytes = modbus::Joined(TcpLine::Frame(1, 1, Bytes(bytes.begin(), bytes.begin() + 1)), bytes);
      return line.Send(bytes) && (line.Receive(1), line.connected());
    });
  }
  // As many connections as it can get, and a request on each of them now and then.
  void Squatting() const {
    std::vector<std::unique_ptr<TcpLine>> lines(20);
    while (!stop) {
      for (auto& line : lines) {
        if (!line || line->Ask(kRead).empty()) line = std::make_unique<TcpLine>(port, from);
        if (stop) return;
      }
      Pause(20);
    }
  }
  void Writing() const {
    int k = 0;
    WhileConnected([&](TcpLine& line) {
      const Bytes requests[] = {modbus::WriteMany(0x0020, std::vector<int>(32, 7)),
                                modbus::WriteMany(0x1000, std::vector<int>(123, 7)),
                                modbus::WriteMany(0x0000, {0, k + 1, 0x6E65, 0x706F, 0, 0, 64, 0, 0, 0}),
                                modbus::WriteOne(0x0150, 1), modbus::WriteOne(0x0048, 1)};
      return !line.Ask(requests[++k % 5]).empty();
    });
  }
  void Connecting() const {
    WhileConnected([](TcpLine&) { return false; });
  }
  void Stealing() const {
    WhileConnected([](TcpLine& line) {
      return !line.Ask(modbus::WriteMany(0x0040, {0x6B6C, 0x6E75})).empty() &&
             !line.Ask(modbus::WriteMany(0x0000, {0, 99, 0x6E65, 0x706F, 0, 0, 64, 0, 0, 0})).empty() &&
             !line.Ask(modbus::WriteMany(0x0040, {0, 0})).empty();
    });
  }
};

class Attack {
 public:
  explicit Attack(int port) {
    using Act = void (Hostile::*)() const;
    const Act acts[] = {&Hostile::Silent,       &Hostile::Slow,    &Hostile::Flooding,  &Hostile::Pipelining,
                        &Hostile::NeverReading, &Hostile::Garbage, &Hostile::Squatting, &Hostile::Writing,
                        &Hostile::Connecting,   &Hostile::Stealing};
    for (int k = 0; k < 10; ++k)
      threads_.emplace_back([this, port, k, act = acts[k]] { (Hostile{port, 20 + k, stop_}.*act)(); });
  }
  ~Attack() {
    stop_ = true;
    for (std::thread& thread : threads_) thread.join();
  }

 private:
  std::atomic<bool> stop_{false};
  std::vector<std::thread> threads_;
};

struct Service {
  std::vector<double> wait_ms;  // for each reply
  int lost = 0, refused = 0;    // replies that never came, new connections that were not served

  double Percentile(double share) {
    std::sort(wait_ms.begin(), wait_ms.end());
    return wait_ms[static_cast<std::size_t>(share * static_cast<double>(wait_ms.size() - 1))];
  }
};

// A good client with one connection, which asks every two milliseconds, and one that connects anew each time. Both have
// addresses of their own.
Service Serve(int port, double seconds) {
  Service service;
  const auto end = Time::now() + std::chrono::duration<double>(seconds);
  std::thread comer([&] {
    while (Time::now() < end) {
      service.refused += TcpLine(port, 3).Ask(kRead).size() != 42;
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
  });
  TcpLine line(port, 2);
  while (Time::now() < end) {
    const auto asked = Time::now();
    service.lost += line.Ask(kRead).size() != 42;
    service.wait_ms.push_back(std::chrono::duration<double, std::milli>(Time::now() - asked).count());
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  comer.join();
  return service;
}

// A flash that has the seat before the attack begins, and goes on for as long as `proceed` allows.
class LongFlash {
 public:
  explicit LongFlash(int port) : drive_("127.0.0.1", port), table_(client::ReadActiveTable(drive_)) {
    core::PutF32(&table_[16], core::GetF32(&table_[16]) * 1.25f);  // torque noise of joint 1
    schema_ = core::GetU32(table_.data());
    drive_.WriteValue<link::reg::kUnlock>(link::reg::kUnlockKey);
    Command(link::reg::kOpen);
  }
  // Stages the table again and again until `stop`.
  void Load(const std::atomic<bool>& stop) {
    do {
      for (std::size_t at = 0; at < table_.size(); at += 100) {
        const std::size_t count = std::min<std::size_t>(100, table_.size() - at);
        drive_.Write(link::reg::kStagedTable + static_cast<int>(at), {&table_[at], count});
        std::this_thread::sleep_for(std::chrono::milliseconds(5));
      }
    } while (!stop);
  }
  // True: the table is in force.
  bool Save() {
    Command(link::reg::kCheck), Command(link::reg::kSave);
    while (drive_.ReadStatus().transaction_state == link::TransactionState::kCommitting) std::this_thread::yield();
    return drive_.ReadStatus().transaction_state == link::TransactionState::kActive &&
           client::ReadActiveTable(drive_) == table_;
  }

 private:
  void Command(std::uint32_t what) {
    link::Words<link::reg::kCommandBlock> w;
    w.Set<link::reg::kSequence>(drive_.ReadStatus().command_sequence + 1);
    w.Set<link::reg::kCommand>(what);
    w.Set<link::reg::kCommandSchema>(schema_);
    w.Set<link::reg::kCommandWords>(static_cast<std::uint16_t>(table_.size()));
    w.Set<link::reg::kCommandCrc>(core::Crc32Words(table_.data(), table_.size()));
    drive_.Write(w);
  }

  client::DriveClient drive_;
  std::vector<std::uint16_t> table_;
  std::uint32_t schema_;
};

// The tick goes on, and no sample is refused.
struct Ticks {
  explicit Ticks(int port) : line(port, 4) {}
  std::uint32_t Read(int first) {
    const Bytes reply = line.Ask(modbus::ReadInput(first, 2));
    return reply.size() == 6 ? static_cast<std::uint32_t>(modbus::WordAt(reply, 2)) << 16 | modbus::WordAt(reply, 4)
                             : 0;
  }
  TcpLine line;
  std::uint32_t tick = Read(0x0046), gaps = Read(0x0054);
};

// Returns the ratio of the good client's p99 to its p99 while the same ten attack another drive.
double AttackOf(double seconds) {
  const RunningDrive drive(FreshFolder("attacked"), "none", {"--real-time"});
  const RunningDrive other(FreshFolder("attacked_other"), "none", {"--real-time"});
  Service beside, attacked;
  {
    const Attack attack(other.port());
    beside = Serve(drive.port(), seconds);
  }
  LongFlash flash(drive.port());
  std::atomic<bool> stop{false};
  const Ticks before(drive.port()), other_before(other.port());
  {
    const Attack attack(drive.port());
    std::thread loading([&] { flash.Load(stop); });
    attacked = Serve(drive.port(), seconds);
    stop = true;
    loading.join();
    EXPECT_TRUE(flash.Save());
  }
  const Ticks after(drive.port()), other_after(other.port());
  EXPECT_EQ(attacked.lost, 0) << "of " << attacked.wait_ms.size();
  EXPECT_EQ(attacked.refused, 0);
  EXPECT_EQ(beside.lost + beside.refused, 0);
  EXPECT_EQ(after.gaps, before.gaps);
  const double passed = other_after.tick - other_before.tick;  // of a drive that nobody attacks now
  EXPECT_GT(passed, 0);
  EXPECT_NEAR(after.tick - before.tick, passed, 100 + 0.01 * passed) << "ticks of a millisecond";
  const double p99 = attacked.Percentile(0.99), usual = beside.Percentile(0.99);
  std::printf("%zu requests: p50 %.3f ms, p99 %.3f ms, worst %.3f ms; the attack elsewhere: p50 %.3f, p99 %.3f, %.3f\n",
              attacked.wait_ms.size(), attacked.Percentile(0.5), p99, attacked.Percentile(1), beside.Percentile(0.5),
              usual, beside.Percentile(1));
  return p99 / usual;
}

TEST(HostileClients, KeepNobodyOut_StopNoFlash_AndNoTick) { AttackOf(1); }

// A ratio: the same machine, the same load, and the drive alone makes the difference.
TEST(LongHostileClients, SlowAGoodClientByLessThanFiveTimes) { EXPECT_LE(AttackOf(20), 5.0); }

}  // namespace
}  // namespace armcal::tests

// client - two pseudo-terminals and a thread between them: a serial cable with a speed, an adapter's latency and bit
// errors.
#pragma once

#include <fcntl.h>
#include <poll.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <deque>
#include <random>
#include <string>
#include <thread>
#include <utility>
#include <vector>

namespace armcal::test {

struct Terminal {
  Terminal() : master(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC)) {
    ::grantpt(master);
    ::unlockpt(master);
    path = ::ptsname(master);
    slave = ::open(path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);  // kept open, so that a master never reads an error
    termios settings;
    ::tcgetattr(slave, &settings);
    ::cfmakeraw(&settings);
    ::tcsetattr(slave, TCSANOW, &settings);
  }
  ~Terminal() { ::close(slave), ::close(master); }
  Terminal(const Terminal&) = delete;
  int master, slave = -1;
  std::string path;
};

struct Cable {
  double bytes_per_s = 10473;  // 115200 baud, eight data bits, even parity
  double latency_s = 0.016;    // an adapter keeps fewer bytes than kPacket so long
  double error_rate = 0;       // of a byte: one of its bits flips
  unsigned seed = 1;
  // May change what the drive sends, portion by portion.
  void (*change)(char* bytes, std::size_t count) = nullptr;
  // Once the drive has sent so many bytes, nothing of it arrives for stall_s; then all of it arrives at once.
  int stall_at = 0;
  double stall_s = 0;
};

class SerialCable {
 public:
  explicit SerialCable(const Cable& cable) : cable_(cable), random_(cable.seed), thread_([this] { Run(); }) {}
  ~SerialCable() {
    stop_ = true;
    thread_.join();
  }
  SerialCable(const SerialCable&) = delete;

  const std::string& client() const { return client_.path; }
  const std::string& drive() const { return drive_.path; }
  int errors() const { return errors_; }

 private:
  using Clock = std::chrono::steady_clock;
  using Time = Clock::time_point;
  static constexpr std::size_t kPacket = 62;

  // One direction. A byte is on the wire, then perhaps in the adapter, then it has arrived.
  struct Way {
    int from, to;
    bool adapter;
    Time free{};
    std::deque<std::pair<Time, char>> wire{};
    std::vector<char> packet{};
    Time packet_since{};
  };

  void Run() {
    Way up{client_.master, drive_.master, false}, down{drive_.master, client_.master, true};
    while (!stop_) {
      pollfd watched[2] = {{client_.master, POLLIN, 0}, {drive_.master, POLLIN, 0}};
      ::poll(watched, 2, up.wire.empty() && down.wire.empty() && down.packet.empty() ? 5 : 0);
      Carry(up), Carry(down);
      std::this_thread::sleep_for(std::chrono::microseconds(500));
    }
  }

  static Clock::duration Seconds(double s) {
    return std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(s));
  }

  void Carry(Way& way) {
    const auto byte_time = Seconds(1 / cable_.bytes_per_s), latency = Seconds(cable_.latency_s);
    const Time now = Clock::now();
    char bytes[256];
    const ssize_t count = ::read(way.from, bytes, sizeof bytes);
    if (way.adapter && cable_.change != nullptr && count > 0) cable_.change(bytes, static_cast<std::size_t>(count));
    for (ssize_t k = 0; k < count; ++k) {
      way.free = std::max(way.free, now) + byte_time;
      if (std::uniform_real_distribution<>(0, 1)(random_) < cable_.error_rate) {
        bytes[k] = static_cast<char>(bytes[k] ^ (1 << random_() % 8));
        ++errors_;
      }
      way.wire.emplace_back(way.free, bytes[k]);
      if (way.adapter && ++sent_ == cable_.stall_at) stalled_until_ = now + Seconds(cable_.stall_s);
    }
    if (way.adapter && now < stalled_until_) return;
    while (!way.wire.empty() && way.wire.front().first <= now) {
      if (way.packet.empty()) way.packet_since = way.wire.front().first;
      way.packet.push_back(way.wire.front().second);
      way.wire.pop_front();
      if (!way.adapter || way.packet.size() == kPacket) Deliver(way);
    }
    if (!way.packet.empty() && now - way.packet_since >= latency) Deliver(way);
  }
  static void Deliver(Way& way) {
    if (::write(way.to, way.packet.data(), way.packet.size()) < 0)
      return;  // nobody has read for long: lost, as on a line
    way.packet.clear();
  }

  Cable cable_;
  std::mt19937 random_;
  Terminal client_, drive_;
  std::atomic<int> errors_{0};
  int sent_ = 0;  // bytes of the drive
  Time stalled_until_{};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

}  // namespace armcal::test

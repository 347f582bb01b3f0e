// client - serves the test drive at a real socket, in a thread of its own, with a clock that can jump.
#pragma once

#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <thread>
#include <utility>

#include "armcal/link/tcp.hpp"
#include "host_sim/client/drive_client.hpp"
#include "port/linux/tcp_server.hpp"
#include "tests/unit/link/test_device.hpp"

namespace armcal::test {

class TestServer {
 public:
  // `every_turn` runs in the server's thread, once in each turn of its loop.
  explicit TestServer(std::function<void(TestDevice&)> every_turn = {}) : every_turn_(std::move(every_turn)) {
    const core::Status listening = server_.Listen("127.0.0.1", 0);
    EXPECT_EQ(listening, core::Status::kOk) << server_.error();
    thread_ = std::thread([this] { Run(); });
  }
  ~TestServer() {
    stop_ = true;
    thread_.join();
  }

  int port() const { return server_.port(); }
  client::DriveClient Connect() { return client::DriveClient("127.0.0.1", port()); }
  void Jump(std::uint32_t ms) { jumped_ms_ += ms; }
  int connections() const { return connections_; }

  TestDevice drive;

 private:
  static std::uint32_t Ms(void* self) {
    const auto now = std::chrono::steady_clock::now().time_since_epoch();
    const auto ms = std::chrono::duration_cast<std::chrono::milliseconds>(now).count();
    return static_cast<std::uint32_t>(ms) + static_cast<TestServer*>(self)->jumped_ms_;
  }
  static std::uint32_t Ticks(void*) { return 0; }

  void Run() {
    while (!stop_) {
      const bool committing = drive.transaction.state() == link::TransactionState::kCommitting;
      const core::Status polled = server_.Poll(committing ? 0 : 1);
      EXPECT_EQ(polled, core::Status::kOk);
      connections_ = server_.connections();
      drive.device.Step(Ms(this));
      if (every_turn_) every_turn_(drive);
    }
  }

  std::function<void(TestDevice&)> every_turn_;
  using Service = link::TcpService<port_linux::TcpServer::kSlots>;
  Service service_{drive.device.engine()};
  std::atomic<std::uint32_t> jumped_ms_{0};
  port_linux::TcpServer server_{{&service_, Service::kMaxReply, &Service::Open, &Service::Receive, &Service::MidFrame,
                                 &Service::Close, &Service::Keep, &Service::Asked},
                                {this, &Ticks, &Ms},
                                {.slots = 4}};
  std::atomic<int> connections_{0};
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

// Waits for a condition that another thread brings about. False: it did not become true within ten seconds.
inline bool Await(const std::function<bool()>& condition) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(10);
  while (!condition()) {
    if (std::chrono::steady_clock::now() > deadline) return false;
    std::this_thread::yield();
  }
  return true;
}

}  // namespace armcal::test

// client - the seat of the one who may write, for the time of one command.
#pragma once

#include <chrono>
#include <thread>

#include "host_sim/client/drive_client.hpp"

namespace armcal::client {

// Asks again while another connection has the seat. That may be our own one, which broke: the drive notices after ten
// seconds. RefusedError: another client has it for longer.
template <class Ask>
auto WhenSeatIsFree(Ask ask) {
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(15);
  for (;;) try {
      return ask();
    } catch (const RefusedError& error) {
      if (error.status != core::Status::kSeatTaken || std::chrono::steady_clock::now() >= deadline) throw;
      std::this_thread::sleep_for(std::chrono::milliseconds(200));
    }
}

// Taken when built; left at the end, also after a refusal.
class WriterSeat {
 public:
  explicit WriterSeat(DriveClient& drive) : drive_(drive) {
    drive_.WriteValue<link::reg::kUnlock>(link::reg::kUnlockKey);
  }
  ~WriterSeat() {
    try {
      drive_.WriteValue<link::reg::kUnlock>(0);
    } catch (const std::runtime_error&) {  // the line is gone, or the drive does not know how to be left
    }
  }
  WriterSeat(const WriterSeat&) = delete;
  WriterSeat& operator=(const WriterSeat&) = delete;

 private:
  DriveClient& drive_;
};

}  // namespace armcal::client

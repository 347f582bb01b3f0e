// client - the seat of the one who may write, for the time of one command.
#pragma once

#include "host_sim/client/drive_client.hpp"

namespace armcal::client {

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

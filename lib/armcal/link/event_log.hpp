// link - the last events of the table, in RAM, for whoever wants to know what became of it.
#pragma once

#include <cstdint>

#include "armcal/core/status.hpp"
#include "armcal/link/registers.hpp"

namespace armcal::link {

// What happened. `connection`: the session that asked; 0: the firmware itself. `command`: the command word; kBootEvent
// and kDropEvent are none of a client's.
struct TableEvent {
  std::uint32_t tick = 0;
  std::uint32_t connection = 0;
  std::uint32_t command = 0;
  core::Status status = core::Status::kOk;
};

inline constexpr std::uint32_t kBootEvent = 0x746F6F62;  // "boot": the stored table was looked for at power-up
inline constexpr std::uint32_t kDropEvent = 0x706F7264;  // "drop": the staged words were dropped

// Holds the last kEvents events. Context of every call: background.
class EventLog {
 public:
  static constexpr std::uint32_t kEvents = reg::kLogEvents;

  void Add(const TableEvent& event) { events_[count_++ % kEvents] = event; }
  std::uint32_t count() const { return count_; }  // events since power-up; wraps
  // Event number k, from 0, lies at k % kEvents until kEvents others have followed.
  const TableEvent& at(std::uint32_t place) const { return events_[place]; }

 private:
  TableEvent events_[kEvents];
  std::uint32_t count_ = 0;
};

}  // namespace armcal::link

// client - starts a recording on a drive and takes its pages.
#pragma once

#include <cstdint>
#include <vector>

#include "host_sim/client/drive_client.hpp"

namespace armcal::client {

using link::TraceMode;
using link::TraceState;
enum class Gaps { kAllow, kRefuse };

struct TraceRequest {
  TraceMode mode = TraceMode::kStreaming;
  std::uint16_t decimation = 1;  // samples averaged into one record
  std::uint32_t start_tick = 0;  // a tick that has passed starts at once
  std::uint32_t limit = 0;       // records, 0: until full (one-shot) or switched off (streaming)
  std::uint32_t channels = 0;    // which ones there are: see the drive's documentation
};

// Records in order. Record i begins at words[i * record_words], and its window began at ticks[i].
struct TraceRecords {
  std::uint16_t record_words = 0;
  std::uint32_t tick_step = 0;
  std::uint32_t channels = 0;
  std::vector<std::uint32_t> ticks;
  std::vector<std::uint16_t> generations;  // low word of the table generation, per record
  std::vector<std::uint16_t> words;
  std::uint32_t lost = 0;  // refused by the drive since the recording started
  TraceState state = TraceState::kOff;

  std::size_t count() const { return ticks.size(); }
};

// trace: 0 raw samples, 1 processed samples. Drops what the drive had recorded before.
void StartTrace(DriveClient& drive, int trace, const TraceRequest& request);

// How pages are taken. kWindow: by one request of function 23 that acknowledges and reads, for a slow line and a drive
// of map version 1.4; a record has at most link::reg::kWindowWords registers.
enum class Taking { kPages, kWindow };

// Reads the pages of one recording in order.
class TraceReader {
 public:
  TraceReader(DriveClient& drive, int trace, Gaps gaps = Gaps::kAllow, Taking taking = Taking::kPages);

  // Takes one page or window, appends it to `records` and releases it on the drive. Returns the number of records, 0 if
  // there is none now. It also refreshes `records.lost` and `.state`. Throws LinkError if another client has started
  // the trace anew meanwhile, and, with Gaps::kRefuse, if ticks are missing between two records.
  std::size_t TakePage(TraceRecords& records);

  // Takes pages until the recording is done and nothing is left. For one-shot recordings and streams with a limit.
  TraceRecords TakeAll();

 private:
  std::size_t TakeWindow(TraceRecords& records);
  bool IsNext(const TraceRecords& records, std::uint16_t recording, std::uint32_t first, std::uint32_t first_tick,
              std::uint16_t count) const;
  void Append(TraceRecords& records, std::uint32_t first_tick, std::uint16_t count, std::uint16_t generation,
              const std::uint16_t* data) const;

  DriveClient& drive_;
  int trace_;
  Gaps gaps_;
  Taking taking_;
  std::uint32_t next_ = 0;
  std::uint16_t recording_ = 0;  // its number
};

}  // namespace armcal::client

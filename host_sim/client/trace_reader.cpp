// client - the page protocol seen from the PC (SPEC.md); knows no channel.
#include "host_sim/client/trace_reader.hpp"

#include <fmt/core.h>

#include <chrono>
#include <thread>

#include "armcal/core/words.hpp"
#include "armcal/link/registers.hpp"

namespace armcal::client {

namespace reg = link::reg;
using core::GetU32;
using core::PutU32;

namespace {
constexpr auto kTracePoll = std::chrono::milliseconds(2);
}

void ArmTrace(DriveClient& drive, int trace, const TraceRequest& request) {
  const int block = reg::kTraceArm[trace];
  std::uint16_t number = static_cast<std::uint16_t>(drive.ReadHolding(block, 1)[0] + 1);
  if (number == 0) number = 1;
  std::uint16_t w[reg::kTraceArmCount] = {number, static_cast<std::uint16_t>(request.mode), request.decimation};
  PutU32(w + 4, request.start_tick);
  PutU32(w + 6, request.limit);
  PutU32(w + 8, request.channels);
  drive.Write(block, w);
}

TraceReader::TraceReader(DriveClient& drive, int trace, Gaps gaps)
    : drive_(drive), trace_(trace), gaps_(gaps), arm_(drive.ReadHolding(reg::kTraceArm[trace], 1)[0]) {
  next_ = GetU32(drive.ReadHolding(reg::kTraceArm[trace] + reg::kTraceAcknowledge, 2).data());
}

std::size_t TraceReader::TakePage(TraceRecords& records) {
  const int page = reg::kTracePage[trace_];
  const std::vector<std::uint16_t> h = drive_.ReadInput(page, reg::kPageHeaderCount);
  const std::uint32_t first = GetU32(h.data());
  const std::uint32_t first_tick = GetU32(h.data() + 2);
  const std::size_t count = h[6];
  records.lost = GetU32(h.data() + 8);
  records.state = static_cast<TraceState>(h[12]);
  if (h[10] != arm_)
    throw LinkError(fmt::format("{}: trace {} was armed anew by another client", drive_.name(), trace_));
  if (count == 0) return 0;
  if (first != next_)
    throw LinkError(fmt::format("{}: trace {} offers record {}, expected {}", drive_.name(), trace_, first, next_));
  if (!records.ticks.empty() && first_tick != records.ticks.back() + records.tick_step && gaps_ == Gaps::kRefuse)
    throw LinkError(fmt::format("{}: trace {}: gap between ticks {} and {} ({} records lost)", drive_.name(), trace_,
                                records.ticks.back(), first_tick, records.lost));
  const std::vector<std::uint16_t> data = drive_.ReadInput(page + reg::kPageData, static_cast<int>(count * h[7]));
  records.tick_step = GetU32(h.data() + 4);
  records.record_words = h[7];
  records.channels = GetU32(h.data() + 14);
  for (std::uint32_t i = 0; i < count; ++i) {
    records.ticks.push_back(first_tick + i * records.tick_step);
    records.generations.push_back(h[11]);
  }
  records.words.insert(records.words.end(), data.begin(), data.end());
  next_ = first + static_cast<std::uint32_t>(count);
  drive_.WriteU32(reg::kTraceArm[trace_] + reg::kTraceAcknowledge, next_);
  return count;
}

TraceRecords TraceReader::TakeAll() {
  TraceRecords records;
  while (true) {
    // The state is read together with the emptiness of the page, so nothing can arrive after "done and empty".
    const std::size_t taken = TakePage(records);
    if (taken == 0 && (records.state == TraceState::kDone || records.state == TraceState::kOff)) return records;
    if (taken == 0) std::this_thread::sleep_for(kTracePoll);
  }
}

}  // namespace armcal::client

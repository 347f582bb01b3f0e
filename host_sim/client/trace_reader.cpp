// client - plays the PC's part of the page protocol (SPEC.md).
#include "host_sim/client/trace_reader.hpp"

#include <fmt/core.h>

#include <chrono>
#include <thread>

namespace armcal::client {

namespace reg = link::reg;

namespace {
constexpr auto kTracePoll = std::chrono::milliseconds(2);
}

void StartTrace(DriveClient& drive, int trace, const TraceRequest& request) {
  std::uint16_t number = static_cast<std::uint16_t>(drive.ReadValue<reg::kTraceRecording>(trace) + 1);
  if (number == 0) number = 1;
  link::Words<reg::kTraceStartBlock> w;
  w.Set<reg::kTraceRecording>(number);
  w.Set<reg::kTraceMode>(request.mode);
  w.Set<reg::kTraceDecimation>(request.decimation);
  w.Set<reg::kTraceStartTick>(request.start_tick);
  w.Set<reg::kTraceLimit>(request.limit);
  w.Set<reg::kTraceChannelMask>(request.channels);
  drive.Write(w, trace);
}

TraceReader::TraceReader(DriveClient& drive, int trace, Gaps gaps)
    : drive_(drive),
      trace_(trace),
      gaps_(gaps),
      next_(drive.ReadValue<reg::kTraceAcknowledge>(trace)),
      recording_(drive.ReadValue<reg::kTraceRecording>(trace)) {}

std::size_t TraceReader::TakePage(TraceRecords& records) {
  const auto page = drive_.Read<reg::kTracePageBlock>(trace_);
  const std::uint32_t first = page.Get<reg::kTraceFirstRecord>(), first_tick = page.Get<reg::kTraceFirstTick>();
  const std::uint16_t count = page.Get<reg::kTraceCount>(), record_words = page.Get<reg::kTraceRecordWords>();
  records.lost = page.Get<reg::kTraceLost>();
  records.state = static_cast<TraceState>(page.Get<reg::kTraceState>());
  if (page.Get<reg::kTracePageRecording>() != recording_)
    throw LinkError(fmt::format("{}: another client has started trace {} anew", drive_.name(), trace_));
  if (count == 0) return 0;
  if (first != next_)
    throw LinkError(fmt::format("{}: trace {} offers record {}, expected {}", drive_.name(), trace_, first, next_));
  if (!records.ticks.empty() && first_tick != records.ticks.back() + records.tick_step && gaps_ == Gaps::kRefuse)
    throw LinkError(fmt::format("{}: trace {}: gap between ticks {} and {} ({} records lost)", drive_.name(), trace_,
                                records.ticks.back(), first_tick, records.lost));
  const std::vector<std::uint16_t> data = drive_.Read(link::SpanOf(reg::kTraceData, count * record_words).Of(trace_));
  records.tick_step = page.Get<reg::kTraceTickStep>();
  records.record_words = record_words;
  records.channels = page.Get<reg::kTraceChannels>();
  for (std::uint32_t i = 0; i < count; ++i) {
    records.ticks.push_back(first_tick + i * records.tick_step);
    records.generations.push_back(page.Get<reg::kTraceGeneration>());
  }
  records.words.insert(records.words.end(), data.begin(), data.end());
  next_ = first + count;
  drive_.WriteValue<reg::kTraceAcknowledge>(next_, trace_);
  return count;
}

TraceRecords TraceReader::TakeAll() {
  TraceRecords records;
  while (true) {
    // State and page come from one reading, so nothing can arrive after "done" with an empty page.
    const std::size_t taken = TakePage(records);
    if (taken == 0 && (records.state == TraceState::kDone || records.state == TraceState::kOff)) return records;
    if (taken == 0) std::this_thread::sleep_for(kTracePoll);
  }
}

}  // namespace armcal::client

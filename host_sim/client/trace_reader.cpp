// client - plays the PC's part of the page protocol (SPEC.md).
#include "host_sim/client/trace_reader.hpp"

#include <fmt/core.h>

#include <chrono>
#include <thread>

#include "host_sim/client/writer_seat.hpp"

namespace armcal::client {

namespace reg = link::reg;

namespace {
constexpr auto kTracePoll = std::chrono::milliseconds(2);
constexpr int kLateReplies = 10;
}  // namespace

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

TraceReader::TraceReader(DriveClient& drive, int trace, Gaps gaps, Taking taking)
    : drive_(drive),
      trace_(trace),
      gaps_(gaps),
      taking_(taking),
      next_(drive.ReadValue<reg::kTraceAcknowledge>(trace)),
      recording_(drive.ReadValue<reg::kTraceRecording>(trace)) {}

// Whether there are records. Throws LinkError if they are not those that were expected.
bool TraceReader::IsNext(const TraceRecords& records, std::uint16_t recording, std::uint32_t first,
                         std::uint32_t first_tick, std::uint16_t count) const {
  if (recording != recording_)
    throw LinkError(fmt::format("{}: another client has started trace {} anew", drive_.name(), trace_));
  if (count == 0) return false;
  if (first != next_)
    throw LinkError(fmt::format("{}: trace {} offers record {}, expected {}", drive_.name(), trace_, first, next_));
  if (!records.ticks.empty() && first_tick != records.ticks.back() + records.tick_step && gaps_ == Gaps::kRefuse)
    throw LinkError(fmt::format("{}: trace {}: gap between ticks {} and {} ({} records lost)", drive_.name(), trace_,
                                records.ticks.back(), first_tick, records.lost));
  return true;
}

void TraceReader::Append(TraceRecords& records, std::uint32_t first_tick, std::uint16_t count, std::uint16_t generation,
                         const std::uint16_t* data) const {
  for (std::uint32_t i = 0; i < count; ++i) {
    records.ticks.push_back(first_tick + i * records.tick_step);
    records.generations.push_back(generation);
  }
  records.words.insert(records.words.end(), data, data + count * records.record_words);
}

std::size_t TraceReader::TakePage(TraceRecords& records) {
  if (taking_ == Taking::kWindow) return TakeWindow(records);
  const auto page = drive_.Read<reg::kTracePageBlock>(trace_);
  const std::uint32_t first = page.Get<reg::kTraceFirstRecord>(), first_tick = page.Get<reg::kTraceFirstTick>();
  const std::uint16_t count = page.Get<reg::kTraceCount>(), record_words = page.Get<reg::kTraceRecordWords>();
  records.lost = page.Get<reg::kTraceLost>();
  records.state = static_cast<TraceState>(page.Get<reg::kTraceState>());
  if (!IsNext(records, page.Get<reg::kTracePageRecording>(), first, first_tick, count)) return 0;
  const std::vector<std::uint16_t> data = drive_.Read(link::SpanOf(reg::kTraceData, count * record_words).Of(trace_));
  records.tick_step = page.Get<reg::kTraceTickStep>();
  records.record_words = record_words;
  records.channels = page.Get<reg::kTraceChannels>();
  Append(records, first_tick, count, page.Get<reg::kTraceGeneration>(), data.data());
  next_ = first + count;
  WhenSeatIsFree([&] { drive_.WriteValue<reg::kTraceAcknowledge>(next_, trace_); });
  return count;
}

// What a window brings is acknowledged by the request for the next one. So a window that was lost comes again.
std::size_t TraceReader::TakeWindow(TraceRecords& records) {
  if (records.tick_step == 0) {  // the same for all records of the recording
    const auto page = drive_.Read<reg::kTracePageBlock>(trace_);
    records.tick_step = page.Get<reg::kTraceTickStep>();
    records.record_words = page.Get<reg::kTraceRecordWords>();
    records.channels = page.Get<reg::kTraceChannels>();
    if (records.record_words == 0 || records.record_words > reg::kWindowWords)
      throw LinkError(fmt::format("{}: a record of trace {} has {} registers, a window holds {}", drive_.name(), trace_,
                                  records.record_words, reg::kWindowWords));
  }
  link::Words<reg::kTraceAcknowledge> next;
  next.Set<reg::kTraceAcknowledge>(next_);
  const link::Span window = reg::kWindowBlock.Of(trace_);
  for (int look = 0;; ++look) {
    const auto words = WhenSeatIsFree([&] {
      return drive_.WriteThenRead(link::SpanOf(reg::kTraceAcknowledge).Of(trace_).first, {next.data(), next.size()},
                                  window.first, window.count, Patience::kShort);
    });
    const link::Words<reg::kWindowBlock> w(words.data());
    const std::uint32_t first = w.Get<reg::kWindowFirstRecord>(), first_tick = w.Get<reg::kWindowFirstTick>();
    const std::uint16_t count = w.Get<reg::kWindowCount>();
    const bool late = w.Get<reg::kWindowRecording>() == recording_ && static_cast<std::int32_t>(first - next_) < 0;
    if (late && look < kLateReplies) {  // the answer to an earlier request; the answers to its repeats may follow
      drive_.DropLateReplies();
      continue;
    }
    records.lost = w.Get<reg::kWindowLost>();
    records.state = static_cast<TraceState>(w.Get<reg::kWindowState>());
    if (!IsNext(records, w.Get<reg::kWindowRecording>(), first, first_tick, count)) return 0;
    Append(records, first_tick, count, w.Get<reg::kWindowGeneration>(), words.data() + reg::kWindowHeader.count);
    next_ = first + count;
    return count;
  }
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

// link - the producer's half of a trace, which takes constant time, the reader's pages, and their registers.
#include "armcal/link/trace.hpp"

#include <cstring>

#include "armcal/core/words.hpp"

namespace armcal::link {

using core::Status;

Trace::Trace(std::uint16_t* storage, std::uint32_t storage_words, std::uint32_t tick_step, RecordWords record_words,
             void* context)
    : storage_(storage),
      storage_words_(storage_words),
      tick_step_(tick_step),
      record_words_(record_words),
      context_(context) {}

Status Trace::Start(Recording recording) {
  if (recording.mode != TraceMode::kOff) {
    if (recording.mode != TraceMode::kOneShot && recording.mode != TraceMode::kStreaming) return Status::kOutOfRange;
    recording.record_words = record_words_(context_, recording.channels);
    if (recording.decimation == 0 || recording.record_words == 0 || recording.record_words > reg::kMaxPageWords)
      return Status::kOutOfRange;
    if (Slots(recording.record_words) == 0) return Status::kOutOfRange;
  }
  requested_ = recording;
  page_ = TracePage{};
  tail_slot_ = 0;
  tail_.store(0, std::memory_order_release);
  mailbox_.Post({recording, ++serial_});
  return Status::kOk;
}

Status Trace::Acknowledge(std::uint32_t next) {
  const std::uint32_t tail = tail_.load(std::memory_order_relaxed);
  const std::uint32_t step = next - tail;
  if (static_cast<std::int32_t>(step) <= 0) return Status::kOk;
  if (step > page_.count) return Status::kOutOfRange;
  tail_slot_ = (tail_slot_ + step) % Slots(requested_.record_words);
  page_.count = 0;
  page_.first_record = next;
  tail_.store(next, std::memory_order_release);
  return Status::kOk;
}

const TracePage& Trace::Page() {
  if (page_.count == 0 && requested_.mode != TraceMode::kOff && Ready()) FormPage();
  return page_;
}

// The stamp of a record, followed by the record; 0 is the oldest one that is not released.
const std::uint16_t* Trace::Slot(std::uint32_t behind_tail) const {
  const std::uint32_t slots = Slots(requested_.record_words);
  std::uint32_t slot = tail_slot_ + behind_tail;
  if (slot >= slots) slot -= slots;
  return storage_ + slot * (requested_.record_words + kStampWords);
}

void Trace::FormPage() {
  const std::uint32_t tail = tail_.load(std::memory_order_relaxed);
  std::uint32_t there = head_.load(std::memory_order_acquire) - tail;
  const std::uint32_t most = reg::kMaxPageWords / requested_.record_words;
  if (there == 0) return;
  if (there > most) there = most;
  const std::uint32_t first_tick = core::GetU32(Slot(0));
  const std::uint16_t generation = Slot(0)[2];
  std::uint32_t count = 1;
  while (count < there && core::GetU32(Slot(count)) == first_tick + count * record_ticks() &&
         Slot(count)[2] == generation)
    ++count;
  page_ = {tail, first_tick, static_cast<std::uint16_t>(count), generation};
}

Status Trace::ReadPage(std::uint32_t offset, std::uint16_t count, std::uint16_t* words) const {
  const std::uint32_t record_words = requested_.record_words;
  if (offset + count > page_.count * record_words) return Status::kBadAddress;
  std::uint32_t record = offset / record_words;
  std::uint32_t word = offset % record_words;
  for (std::uint16_t i = 0; i < count; ++i) {
    words[i] = Slot(record)[kStampWords + word];
    if (++word == record_words) {
      word = 0;
      ++record;
    }
  }
  return Status::kOk;
}

Status Trace::ReadWindow(std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
  const TraceState state = this->state();  // as in FillPageHeader
  const TracePage& page = Page();
  const std::uint32_t fit = requested_.record_words == 0 ? 0 : reg::kWindowWords / requested_.record_words;
  const std::uint32_t shown = page.count < fit ? page.count : fit;
  const std::uint32_t waiting = this->waiting() + page.count - shown;
  Words<reg::kWindowBlock> w;
  w.Set<reg::kWindowFirstRecord>(page.first_record);
  w.Set<reg::kWindowFirstTick>(page.first_tick);
  w.Set<reg::kWindowLost>(lost());
  w.Set<reg::kWindowCount>(static_cast<std::uint16_t>(shown));
  w.Set<reg::kWindowRecording>(requested_.number);
  w.Set<reg::kWindowGeneration>(page.generation);
  w.Set<reg::kWindowState>(state);
  w.Set<reg::kWindowWaiting>(static_cast<std::uint16_t>(waiting > 0xFFFFu ? 0xFFFFu : waiting));
  if (shown == 0) return CopyWords(w.data(), offset, count, words);
  const auto data_words = static_cast<std::uint16_t>(shown * requested_.record_words);
  const Status copied = ReadPage(0, data_words, w.data() + reg::kWindowHeader.count);
  return core::IsOk(copied) ? CopyWords(w.data(), offset, count, words) : copied;
}

std::uint32_t Trace::waiting() const {
  if (!Ready()) return 0;
  return head_.load(std::memory_order_acquire) - tail_.load(std::memory_order_relaxed) - page_.count;
}

std::uint32_t Trace::lost() const { return Ready() ? lost_.load(std::memory_order_relaxed) : 0; }

TraceState Trace::state() const {
  if (requested_.mode == TraceMode::kOff) return TraceState::kOff;
  return Ready() ? static_cast<TraceState>(state_.load(std::memory_order_acquire)) : TraceState::kWaiting;
}

// The reader looks at the counters only after `started_` has told it that they restarted.
void Trace::Begin() {
  slots_ = recording_.mode == TraceMode::kOff ? 0 : Slots(recording_.record_words);
  head_slot_ = 0;
  taken_ = 0;
  phase_ = 0;
  head_.store(0, std::memory_order_relaxed);
  lost_.store(0, std::memory_order_relaxed);
  const TraceState begin = recording_.mode == TraceMode::kOff ? TraceState::kOff : TraceState::kWaiting;
  state_.store(static_cast<std::uint32_t>(begin), std::memory_order_relaxed);
}

TraceTurn Trace::Offer(std::uint32_t tick) {
  if (mailbox_.Refresh()) {
    recording_ = mailbox_.latest().recording;
    Begin();
    started_.store(mailbox_.latest().serial, std::memory_order_release);
  }
  auto state = static_cast<TraceState>(state_.load(std::memory_order_relaxed));
  if (state == TraceState::kWaiting && static_cast<std::int32_t>(tick - recording_.start_tick) >= 0) {
    state = TraceState::kRecording;
    state_.store(static_cast<std::uint32_t>(state), std::memory_order_relaxed);
    expected_tick_ = tick;
  }
  if (state != TraceState::kRecording) return {false, false, false};
  if (tick != expected_tick_) phase_ = 0;
  expected_tick_ = tick + tick_step_;
  const bool first = phase_ == 0;
  if (first) window_tick_ = tick;
  const bool last = ++phase_ == recording_.decimation;
  if (last) phase_ = 0;
  return {true, first, last};
}

Status Trace::Push(const std::uint16_t* record, std::uint32_t generation) {
  const std::uint32_t head = head_.load(std::memory_order_relaxed);
  const bool full = head - tail_.load(std::memory_order_acquire) >= slots_;
  if (full && recording_.mode == TraceMode::kStreaming) {
    lost_.store(lost_.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
    return Status::kFull;
  }
  if (full) {
    state_.store(static_cast<std::uint32_t>(TraceState::kDone), std::memory_order_release);
    return Status::kFull;
  }
  std::uint16_t* slot = storage_ + head_slot_ * (recording_.record_words + kStampWords);
  core::PutU32(slot, window_tick_);
  slot[2] = static_cast<std::uint16_t>(generation & 0xFFFFu);
  std::memcpy(slot + kStampWords, record, 2u * recording_.record_words);
  head_slot_ = head_slot_ + 1 == slots_ ? 0 : head_slot_ + 1;
  head_.store(head + 1, std::memory_order_release);
  if (recording_.limit != 0 && ++taken_ == recording_.limit)
    state_.store(static_cast<std::uint32_t>(TraceState::kDone), std::memory_order_release);
  return Status::kOk;
}

// Registers ----------------------------------------------------------------------------------------------------------

Status Trace::Serve(RegisterMap& map, int number) {
  if (number < 0 || number >= reg::kTraces) return Status::kOutOfRange;
  sessions_ = &map.sessions();
  const Block blocks[] = {
      FilledBlock<reg::kTracePageBlock, &Trace::FillPageHeader>(this, number),
      DirectBlock<&Trace::ReadPage>(SpanOf(reg::kTraceData).Of(number), this),
      DirectBlock<&Trace::ReadWindow>(SpanOf(reg::kWindowBlock).Of(number), this),
      FilledBlock<reg::kTraceStartBlock, &Trace::FillStart, &Trace::TakeStart>(this, number),
      FilledBlock<reg::kTraceAcknowledge, &Trace::FillAcknowledge, &Trace::TakeAcknowledge>(this, number),
  };
  return map.Add(blocks);
}

// Reading the header forms a page if there is none.
void Trace::FillPageHeader(Words<reg::kTracePageBlock>& w) {
  const TraceState state =
      this->state();  // read before the page is formed, so that "done" with an empty page means: nothing follows
  const TracePage& page = Page();
  const std::uint32_t waiting = this->waiting();
  w.Set<reg::kTraceFirstRecord>(page.first_record);
  w.Set<reg::kTraceFirstTick>(page.first_tick);
  w.Set<reg::kTraceTickStep>(record_ticks());
  w.Set<reg::kTraceCount>(page.count);
  w.Set<reg::kTraceRecordWords>(requested_.record_words);
  w.Set<reg::kTraceLost>(lost());
  w.Set<reg::kTracePageRecording>(requested_.number);
  w.Set<reg::kTraceGeneration>(page.generation);
  w.Set<reg::kTraceState>(state);
  w.Set<reg::kTraceWaiting>(static_cast<std::uint16_t>(waiting > 0xFFFFu ? 0xFFFFu : waiting));
  w.Set<reg::kTraceChannels>(requested_.channels);
}

void Trace::FillStart(Words<reg::kTraceStartBlock>& w) {
  w.Set<reg::kTraceRecording>(requested_.number);
  w.Set<reg::kTraceMode>(requested_.mode);
  w.Set<reg::kTraceDecimation>(requested_.decimation);
  w.Set<reg::kTraceStartTick>(requested_.start_tick);
  w.Set<reg::kTraceLimit>(requested_.limit);
  w.Set<reg::kTraceChannelMask>(requested_.channels);
}

Status Trace::TakeStart(const Words<reg::kTraceStartBlock>& w) {
  if (w.Get<reg::kTraceReserved>() != 0) return Status::kOutOfRange;
  Words<reg::kTraceStartBlock> present;
  FillStart(present);
  const bool same = std::memcmp(present.data(), w.data(), 2u * w.size()) == 0;
  const bool repeated = w.Get<reg::kTraceRecording>() != 0 && same;  // the client asks again because a reply was lost
  if (OwnedByAnother()) return repeated ? Status::kOk : Status::kSeatTaken;
  if (repeated) {
    owner_ = sessions_->asking();
    return Status::kOk;
  }
  Recording recording;
  recording.number = w.Get<reg::kTraceRecording>();
  recording.mode = static_cast<TraceMode>(w.Get<reg::kTraceMode>());
  recording.decimation = w.Get<reg::kTraceDecimation>();
  recording.start_tick = w.Get<reg::kTraceStartTick>();
  recording.limit = w.Get<reg::kTraceLimit>();
  recording.channels = w.Get<reg::kTraceChannelMask>();
  const Status started = Start(recording);
  if (core::IsOk(started)) owner_ = sessions_->asking();
  return started;
}

bool Trace::OwnedByAnother() const {
  return requested_.mode != TraceMode::kOff && owner_ != sessions_->asking() && sessions_->IsPresent(owner_);
}

void Trace::FillAcknowledge(Words<reg::kTraceAcknowledge>& w) { w.Set<reg::kTraceAcknowledge>(acknowledged()); }

Status Trace::TakeAcknowledge(const Words<reg::kTraceAcknowledge>& w) {
  if (OwnedByAnother()) return Status::kSeatTaken;
  const Status taken = Acknowledge(w.Get<reg::kTraceAcknowledge>());
  if (core::IsOk(taken)) owner_ = sessions_->asking();
  return taken;
}

}  // namespace armcal::link

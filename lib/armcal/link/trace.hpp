// link - a trace: a ring of records of equal length, which a client starts and reads in pages.
#pragma once

#include <atomic>
#include <cstdint>

#include "armcal/core/mailbox.hpp"
#include "armcal/core/status.hpp"
#include "armcal/link/register_map.hpp"

namespace armcal::link {

// What a client asks for when it starts a recording.
struct Recording {
  std::uint16_t number = 0;  // the client's; not 0: the same request written again starts no new recording
  TraceMode mode = TraceMode::kOff;
  std::uint16_t decimation = 1;  // offered samples for one record
  std::uint32_t start_tick = 0;  // a tick in the past (up to 2^31 ticks) starts at once
  std::uint32_t limit = 0;       // records, 0: no limit
  std::uint32_t channels = 0;
  std::uint16_t record_words = 0;  // the Trace sets it, it follows from the channels
};

// Where one sample stands in the averaging window of a record.
struct TraceTurn {
  bool recording;  // the sample belongs to a window
  bool first;      // of its window: clear the sums
  bool last;       // of its window: Push the record
};

// A page: consecutive records of one table generation, evenly spaced in time.
struct TracePage {
  std::uint32_t first_record = 0;
  std::uint32_t first_tick = 0;
  std::uint16_t count = 0;
  std::uint16_t generation = 0;
};

// One context writes records (tick or background), and the background reads them. Neither waits for the other. When the
// ring is full, the new record is refused and counted. A recording belongs to the connection that started it. Other
// connections may read it. While the owner is present (Sessions::IsPresent), they may not release its pages and may not
// start another recording (kSeatTaken). A page stays as it is until the reader names the next record that it wants. So
// a reader that lost a reply can read the page again.
class Trace {
 public:
  // Returns how many words a record of these channels has, without its stamp. 0: the channels are not served.
  using RecordWords = std::uint16_t (*)(void* context, std::uint32_t channels);

  // `tick_step`: ticks from one offered sample to the next. `storage` outlives this (see TraceRing below).
  Trace(std::uint16_t* storage, std::uint32_t storage_words, std::uint32_t tick_step, RecordWords record_words,
        void* context);
  Trace(const Trace&) = delete;

  // Reader ------------------------------------------------------------------------------------------------------------
  // Context: background.

  // Drops all records and starts a new recording. kOutOfRange: no such mode, decimation 0, channels that are not
  // served, or a record that is too long.
  core::Status Start(Recording recording);
  const Recording& requested() const { return requested_; }

  // Releases all records before `next`. kOutOfRange: `next` lies beyond the page. If it is released already: kOk.
  core::Status Acknowledge(std::uint32_t next);
  std::uint32_t acknowledged() const { return tail_.load(std::memory_order_relaxed); }

  // The present page. If there is none and records wait, it forms one. Count 0: there is no record.
  const TracePage& Page();
  // Copies words [count] of the present page, which are its records without stamps. kBadAddress: they lie beyond it.
  core::Status ReadPage(std::uint32_t offset, std::uint16_t count, std::uint16_t* words) const;

  // Copies words [count] of the short page (registers trace0_window_...): a header and as many whole records of the
  // present page as fit. Forms a page if there is none. offset + count must not exceed the block.
  core::Status ReadWindow(std::uint16_t offset, std::uint16_t count, std::uint16_t* words);

  // Serves this as trace `number`: 0 (raw samples) or 1 (processed samples). kOutOfRange: no such number. Else what
  // RegisterMap::Add answers.
  core::Status Serve(RegisterMap& map, int number);

  std::uint32_t record_ticks() const { return tick_step_ * requested_.decimation; }
  std::uint32_t waiting() const;  // records behind the present page
  std::uint32_t lost() const;
  TraceState state() const;

  // Producer ----------------------------------------------------------------------------------------------------------
  // Context: the one that writes records (tick or background).

  // Call it with every sample. It takes over a recording that a client has started meanwhile. If a tick is missing, the
  // averaging window starts anew.
  TraceTurn Offer(std::uint32_t tick);
  // Call it when Offer answered `last`. record: [recording().record_words]. kFull: the record was refused and counted;
  // a one-shot recording ends instead.
  core::Status Push(const std::uint16_t* record, std::uint32_t generation);
  const Recording& recording() const { return recording_; }
  // Records of this recording that were accepted.
  std::uint32_t pushed() const { return head_.load(std::memory_order_relaxed); }
  // How many records still fit. A simulation may wait for room; a real tick never does.
  std::uint32_t room() const {
    return slots_ - (head_.load(std::memory_order_relaxed) - tail_.load(std::memory_order_acquire));
  }

 private:
  static constexpr std::uint32_t kStampWords = 3;  // tick and generation before each record

  struct Request {
    Recording recording;
    std::uint32_t serial;
  };

  void FillPageHeader(Words<reg::kTracePageBlock>& w);
  void FillStart(Words<reg::kTraceStartBlock>& w);
  core::Status TakeStart(const Words<reg::kTraceStartBlock>& w);
  void FillAcknowledge(Words<reg::kTraceAcknowledge>& w);
  core::Status TakeAcknowledge(const Words<reg::kTraceAcknowledge>& w);

  void Begin();
  bool OwnedByAnother() const;
  bool Ready() const { return started_.load(std::memory_order_acquire) == serial_; }
  std::uint32_t Slots(std::uint16_t record_words) const { return storage_words_ / (record_words + kStampWords); }
  const std::uint16_t* Slot(std::uint32_t behind_tail) const;
  void FormPage();

  std::uint16_t* storage_;
  std::uint32_t storage_words_;
  std::uint32_t tick_step_;
  RecordWords record_words_;
  void* context_;

  // Of the reader.
  Recording requested_;
  Sessions* sessions_ = nullptr;
  std::uint32_t owner_ = Sessions::kNobody;  // who started the recording
  std::uint32_t serial_ = 0;
  TracePage page_;
  std::uint32_t tail_slot_ = 0;

  // Of both. head_ and tail_ count the records of this recording and wrap.
  core::Mailbox<Request> mailbox_;
  std::atomic<std::uint32_t> started_{0};  // serial_ of the request that the producer has taken over
  std::atomic<std::uint32_t> head_{0};
  std::atomic<std::uint32_t> tail_{0};
  std::atomic<std::uint32_t> lost_{0};
  std::atomic<std::uint32_t> state_{0};

  // Of the producer.
  Recording recording_;
  std::uint32_t slots_ = 0;
  std::uint32_t head_slot_ = 0;
  std::uint32_t taken_ = 0;  // accepted records of this recording; counts up to the limit
  std::uint16_t phase_ = 0;
  std::uint32_t window_tick_ = 0;
  std::uint32_t expected_tick_ = 0;
};

inline constexpr std::uint32_t kDefaultTraceWords = 32768;  // 64 KB

template <std::uint32_t kWords = kDefaultTraceWords>
class TraceRing : public Trace {
 public:
  TraceRing(std::uint32_t tick_step, RecordWords record_words, void* context)
      : Trace(words_, kWords, tick_step, record_words, context) {}

 private:
  std::uint16_t words_[kWords] = {};
};

}  // namespace armcal::link

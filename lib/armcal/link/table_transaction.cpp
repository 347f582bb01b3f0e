// link - the steps of flashing a table: command by command, and then one small piece at each turn of the background.
#include "armcal/link/table_transaction.hpp"

#include <cstring>

#include "armcal/core/crc.hpp"

namespace armcal::link {

using core::Status;

namespace {
constexpr std::uint16_t kSummedWords = 64;  // of a checksum, in a slice

bool Same(const TableCommand& a, const TableCommand& b) {
  return a.sequence == b.sequence && a.command == b.command && a.schema == b.schema && a.words == b.words &&
         a.crc == b.crc;
}
}  // namespace

TableTransaction::TableTransaction(const TableApplication& application, table::TableStore& store, std::uint32_t schema,
                                   std::uint16_t* staged, std::uint16_t* active, std::uint16_t words,
                                   const SaveRate& rate)
    : application_(application),
      store_(store),
      schema_(schema),
      staged_(staged),
      active_(active),
      words_(words),
      active_words_(static_cast<std::uint16_t>(store.shortest())),
      rate_(rate),
      saves_left_(rate.burst) {
  active_crc_ = core::Crc32Words(active_, active_words_);
}

Status TableTransaction::Boot() {
  table_status_ = store_.Load(staged_);
  if (!core::IsOk(table_status_)) return table_status_;
  // A record that the application refuses is as good as none: the older one has its turn.
  const auto check = [this] {
    staged_words_ = static_cast<std::uint16_t>(store_.words_in_force());
    bool first = true;
    do {
      why_ = application_.check(application_.context, staged_, staged_words_, first);
      first = false;
    } while (why_.status == Status::kBusy);
  };
  check();
  for (int slot = 0; slot < table::TableStore::kSlots && !core::IsOk(why_.status); ++slot) {
    if (!core::IsOk(store_.LoadOlder(staged_))) break;
    check();
  }
  checked_crc_ = core::Crc32Words(staged_, staged_words_);
  table_status_ = why_.status;
  if (!core::IsOk(table_status_)) return table_status_;
  state_ = TransactionState::kCommitting;
  phase_ = Phase::kBooting;
  Adopt();
  return table_status_;
}

Status TableTransaction::Command(const TableCommand& command) {
  if (command.sequence == 0) return Status::kWrongOrder;
  if (command.sequence == last_.sequence) return IsRepeat(command) ? Status::kOk : Status::kWrongOrder;
  if (Same(command, checking_)) {
    if (phase_ == Phase::kChecking) return Status::kUnfinished;
    if (answered_) {
      answered_ = false;
      return answer_;
    }
  }
  if (phase_ != Phase::kNone) return Status::kBusy;
  answered_ = false;
  const Status status = Apply(command);
  if (status == Status::kUnfinished) return status;
  status_ = status;
  if (core::IsOk(status)) {
    last_ = command;
    touched_ms_ = now_ms_;
  }
  return status;
}

bool TableTransaction::IsRepeat(const TableCommand& command) const {
  return command.sequence != 0 && Same(command, last_);
}

void TableTransaction::Abandon() {
  answered_ = false;
  if ((phase_ == Phase::kNone || phase_ == Phase::kChecking) && staging())
    Finish(TransactionState::kIdle, Status::kTimeout);
}

std::uint32_t TableTransaction::save_wait_ms() const {
  return saves_left_ > 0 || rate_.interval_ms == 0 ? 0 : rate_.interval_ms - (now_ms_ - earned_ms_);
}

Status TableTransaction::Apply(const TableCommand& command) {
  if (command.command != reg::kOpen && command.command != reg::kCheck && command.command != reg::kSave)
    return Status::kOutOfRange;
  if (command.schema != schema_) return Status::kWrongSchema;
  if (!store_.Takes(command.words)) return Status::kWrongSize;
  if (command.command == reg::kOpen) return Open(command);
  return command.command == reg::kCheck ? Check(command) : Save(command);
}

Status TableTransaction::Open(const TableCommand& command) {
  staged_words_ = command.words;
  std::memset(staged_, 0, 2u * words_);
  state_ = TransactionState::kOpen;
  return Status::kOk;
}

Status TableTransaction::Check(const TableCommand& command) {
  if (state_ != TransactionState::kLoading && state_ != TransactionState::kChecked) return Status::kWrongOrder;
  if (command.words != staged_words_) return Status::kWrongSize;
  checking_ = command;
  summed_ = 0;
  sum_ = 0;
  phase_ = Phase::kChecking;
  return Status::kUnfinished;
}

// First the checksum, then what the application does with the words.
void TableTransaction::CheckNext() {
  if (summed_ < staged_words_) {
    const auto rest = static_cast<std::uint16_t>(staged_words_ - summed_);
    const std::uint16_t count = rest < kSummedWords ? rest : kSummedWords;
    sum_ = core::Crc32Words(staged_ + summed_, count, sum_);
    summed_ = static_cast<std::uint16_t>(summed_ + count);
    if (summed_ < staged_words_) return;
    if (sum_ != checking_.crc) return Answer(Status::kBadCrc);
    first_ = true;
    return;
  }
  const core::Refusal why = application_.check(application_.context, staged_, staged_words_, first_);
  first_ = false;
  if (why.status == Status::kBusy) return;
  why_ = why;
  // A refused check has thrown away what an earlier one built, so nothing is left that could be saved.
  state_ = core::IsOk(why.status) ? TransactionState::kChecked : TransactionState::kLoading;
  checked_crc_ = checking_.crc;
  Answer(why.status);
}

void TableTransaction::Answer(Status status) {
  phase_ = Phase::kNone;
  status_ = status;
  answer_ = status;
  answered_ = !core::IsOk(status);
  if (answered_) return;
  last_ = checking_;
  touched_ms_ = now_ms_;
}

Status TableTransaction::Save(const TableCommand& command) {
  if (state_ != TransactionState::kChecked) return Status::kWrongOrder;
  if (command.words != staged_words_) return Status::kWrongSize;
  if (command.crc != checked_crc_) return Status::kBadCrc;
  Status status = application_.permit(application_.context);
  if (!core::IsOk(status)) return status;
  if (rate_.interval_ms != 0 && saves_left_ == 0) return Status::kTooSoon;
  status = store_.Save(staged_, staged_words_);
  if (!core::IsOk(status)) return status;
  if (saves_left_ > 0) --saves_left_;
  state_ = TransactionState::kCommitting;
  phase_ = Phase::kStoring;
  return Status::kOk;
}

Status TableTransaction::WriteStaged(std::uint16_t offset, std::uint16_t count, const std::uint16_t* words) {
  if (phase_ != Phase::kNone) return Status::kBusy;
  if (!staging()) return Status::kWrongOrder;
  if (offset + count > staged_words_) return Status::kWrongSize;
  std::memcpy(staged_ + offset, words, 2u * count);
  answered_ = false;
  state_ = TransactionState::kLoading;  // the staged words are no longer those that were checked
  touched_ms_ = now_ms_;
  return Status::kOk;
}

void TableTransaction::Step(std::uint32_t now_ms) {
  now_ms_ = now_ms;
  if (saves_left_ >= rate_.burst) {
    earned_ms_ = now_ms;
  } else if (now_ms - earned_ms_ >= rate_.interval_ms) {
    ++saves_left_;
    earned_ms_ += rate_.interval_ms;
  }
  switch (phase_) {
    case Phase::kNone:
      if (now_ms - touched_ms_ >= kStageTimeout_ms) Abandon();
      return;
    case Phase::kChecking:
      return CheckNext();
    case Phase::kStoring: {
      const Status stored = store_.Step();
      if (stored == Status::kBusy) return;
      if (!core::IsOk(stored)) return Finish(TransactionState::kFailed, stored);
      phase_ = Phase::kAdopting;
      touched_ms_ = now_ms;
      return;
    }
    case Phase::kAdopting:
    case Phase::kBooting:
      return Adopt();
    case Phase::kRevoking: {
      const Status revoked = store_.Step();
      if (revoked == Status::kBusy) return;
      return Finish(TransactionState::kFailed, core::IsOk(revoked) ? refusal_ : revoked);
    }
  }
}

// An axis may have been enabled after the application permitted the adoption. Wait until it is disabled, but not for
// ever.
void TableTransaction::Adopt() {
  const bool booting = phase_ == Phase::kBooting;
  const Status status = application_.adopt(application_.context);
  if (core::IsOk(status)) {
    Activate();
    return Finish(booting ? TransactionState::kIdle : TransactionState::kActive, Status::kOk);
  }
  if (booting) {
    table_status_ = status;
    if (status != Status::kBusy) Finish(TransactionState::kIdle, status);
    return;
  }
  const bool may_change = status == Status::kBusy || status == Status::kAxisEnabled;
  if (may_change && now_ms_ - touched_ms_ < kStageTimeout_ms) return;
  refusal_ = status == Status::kBusy ? Status::kTimeout : status;
  const Status revoking = store_.Revoke();
  if (!core::IsOk(revoking)) return Finish(TransactionState::kFailed, revoking);
  phase_ = Phase::kRevoking;
}

void TableTransaction::Activate() {
  std::memcpy(active_, staged_, 2u * staged_words_);
  std::memset(active_ + staged_words_, 0, 2u * (words_ - staged_words_));
  active_words_ = staged_words_;
  active_crc_ = checked_crc_;
  table_status_ = Status::kOk;
}

void TableTransaction::Finish(TransactionState state, Status status) {
  phase_ = Phase::kNone;
  state_ = state;
  status_ = status;
}

}  // namespace armcal::link

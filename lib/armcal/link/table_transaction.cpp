// link - the steps of flashing a table: command by command, and then one small piece at each turn of the background.
#include "armcal/link/table_transaction.hpp"

#include <cstring>

#include "armcal/core/crc.hpp"
#include "armcal/core/words.hpp"

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
                                   const SaveRate& rate, const Signing& signing)
    : application_(application),
      store_(store),
      schema_(schema),
      staged_(staged),
      active_(active),
      words_(words),
      active_words_(static_cast<std::uint16_t>(store.shortest())),
      signing_(signing),
      rate_(rate),
      saves_left_(rate.burst) {}

Status TableTransaction::Boot() {
  active_crc_ = core::Crc32Words(active_, active_words_);  // the application has put its defaults there by now
  table_status_ = store_.Load(staged_);
  ReadCounters();
  if (core::IsOk(table_status_)) BootFromStore();
  Note(kBootEvent, table_status_);
  return table_status_;
}

void TableTransaction::BootFromStore() {
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
  if (!core::IsOk(table_status_)) return;
  state_ = TransactionState::kCommitting;
  phase_ = Phase::kBooting;
  Adopt();
}

Status TableTransaction::Command(const TableCommand& command, std::uint32_t connection) {
  if (command.sequence == 0) return Status::kWrongOrder;
  if (command.sequence == last_.sequence) return IsRepeat(command) ? Status::kOk : Status::kWrongOrder;
  if (Same(command, checking_)) {
    if (phase_ == Phase::kChecking || phase_ == Phase::kLoading) return Status::kUnfinished;
    if (answered_) {
      answered_ = false;
      return answer_;
    }
  }
  if (phase_ != Phase::kNone) return Status::kBusy;
  answered_ = false;
  const Status status = Apply(command);
  checking_connection_ = connection;
  if (status == Status::kUnfinished) return status;
  Note(command.command, status, connection);
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
  const bool open = phase_ == Phase::kNone || phase_ == Phase::kChecking || phase_ == Phase::kLoading;
  if (!open || !staging()) return;
  if (phase_ == Phase::kLoading) store_.StopCopy();
  Finish(TransactionState::kIdle, Status::kTimeout);
  Note(kDropEvent, Status::kTimeout);
}

void TableTransaction::Note(std::uint32_t command, Status status, std::uint32_t connection) {
  log_.Add({tick_, connection, command, status});
}

std::uint32_t TableTransaction::save_wait_ms() const {
  return saves_left_ > 0 || rate_.interval_ms == 0 ? 0 : rate_.interval_ms - (now_ms_ - earned_ms_);
}

Status TableTransaction::SetTrialLimit(std::uint16_t limit_s) {
  if (!MayLast(limit_s)) return Status::kOutOfRange;
  trial_limit_s_ = limit_s;
  return Status::kOk;
}

std::uint16_t TableTransaction::trial_left_s() const {
  if (state_ != TransactionState::kOnTrial) return 0;
  const std::uint32_t passed_ms = now_ms_ - trial_began_ms_;
  return static_cast<std::uint16_t>(passed_ms < trial_ms_ ? (trial_ms_ - passed_ms + 999) / 1000 : 0);
}

Status TableTransaction::Apply(const TableCommand& command) {
  const std::uint32_t what = command.command;
  const bool known = what == reg::kOpen || what == reg::kCheck || what == reg::kSave || what == reg::kTrial ||
                     what == reg::kConfirm || what == reg::kBack || what == reg::kLoad;
  if (!known) return Status::kOutOfRange;
  if (command.schema != schema_) return Status::kWrongSchema;
  if (!store_.Takes(command.words)) return Status::kWrongSize;
  switch (what) {
    case reg::kOpen:
      return Open(command);
    case reg::kCheck:
      return Check(command);
    case reg::kTrial:
      return Trial(command);
    case reg::kConfirm:
      return Confirm(command);
    case reg::kBack:
      return Back();
    case reg::kLoad:
      return Load(command);
    default:
      return Save(command);
  }
}

// While a table is on trial, the stage holds the stored one.
Status TableTransaction::Open(const TableCommand& command) {
  if (state_ == TransactionState::kOnTrial) return Status::kWrongOrder;
  staged_words_ = command.words;
  trial_limit_s_ = reg::kUsualTrial_s;
  std::memset(staged_, 0, 2u * words_);
  state_ = TransactionState::kOpen;
  return Status::kOk;
}

// The length of what is loaded follows from the record, and not from the command.
Status TableTransaction::Load(const TableCommand& command) {
  const bool on_trial = state_ == TransactionState::kOnTrial;
  if (const Status begun = on_trial ? Status::kWrongOrder : store_.Copy(staged_); !core::IsOk(begun)) return begun;
  (void)Open(command);  // it is refused during a trial only
  checking_ = command;
  phase_ = Phase::kLoading;
  return Status::kUnfinished;
}

void TableTransaction::LoadNext() {
  const Status copied = store_.Step();
  if (copied == Status::kBusy) return;
  staged_words_ = static_cast<std::uint16_t>(store_.words_copied());
  state_ = core::IsOk(copied) ? TransactionState::kLoading : TransactionState::kIdle;
  Answer(copied);
}

Status TableTransaction::Check(const TableCommand& command) {
  if (state_ != TransactionState::kLoading && state_ != TransactionState::kChecked) return Status::kWrongOrder;
  if (command.words != staged_words_) return Status::kWrongSize;
  checking_ = command;
  summed_ = 0;
  sum_ = 0;
  sealing_ = false;
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
    if (sum_ != checking_.crc) return Judged({Status::kBadCrc});
    first_ = true;
    sealing_ = signing_.required();
    if (sealing_) seal_.Begin(staged_, staged_words_, signing_, counter_);
    return;
  }
  if (sealing_) return JudgeSeal();
  const core::Refusal why = application_.check(application_.context, staged_, staged_words_, first_);
  first_ = false;
  if (why.status != Status::kBusy) Judged(why);
}

void TableTransaction::Judged(const core::Refusal& why) {
  why_ = why;
  // A refused check has thrown away what an earlier one built, so nothing is left that could be saved.
  state_ = core::IsOk(why.status) ? TransactionState::kChecked : TransactionState::kLoading;
  checked_crc_ = checking_.crc;
  Answer(why.status);
}

// One slice. The application looks at the words only if the seal is good.
void TableTransaction::JudgeSeal() {
  const Status good = seal_.Step();
  if (good == Status::kBusy) return;
  sealing_ = false;
  if (!core::IsOk(good)) Judged({good});
}

// After this, no table with this counter or a lower one is accepted.
void TableTransaction::UseCounter(const std::uint16_t* words, int count) {
  const std::uint32_t counter = GetSeal(words, count).counter;
  if (counter > counter_) counter_ = counter;
}

// The counters of all records that read well, of whichever schema: the layout version and the seal have the same places
// in every table.
void TableTransaction::ReadCounters() {
  for (int slot = 0; slot < table::TableStore::kSlots; ++slot) {
    const std::uint32_t length = store_.words_in(slot);
    std::uint16_t head[3], tail[kSealWords - kSignatureWords];
    if (length < kSealWords || !core::IsOk(store_.Read(slot, 0, 3, head)) || head[2] < kSealedLayout) continue;
    if (!core::IsOk(store_.Read(slot, length - kSealWords, kSealWords - kSignatureWords, tail))) continue;
    const std::uint32_t counter = core::GetU32(tail + 2);
    if (counter > counter_) counter_ = counter;
  }
}

void TableTransaction::Answer(Status status) {
  phase_ = Phase::kNone;
  Note(checking_.command, status, checking_connection_);
  status_ = status;
  answer_ = status;
  answered_ = !core::IsOk(status);
  if (answered_) return;
  last_ = checking_;
  touched_ms_ = now_ms_;
}

// What save, trial and confirm have in common.
Status TableTransaction::MayStore(const TableCommand& command, TransactionState wanted) const {
  if (state_ != wanted) return Status::kWrongOrder;
  const bool on_trial = wanted == TransactionState::kOnTrial;
  if (command.words != (on_trial ? active_words_ : staged_words_)) return Status::kWrongSize;
  if (command.crc != (on_trial ? active_crc_ : checked_crc_)) return Status::kBadCrc;
  return on_trial ? Status::kOk : application_.permit(application_.context);
}

Status TableTransaction::Store(const std::uint16_t* words, std::uint16_t count) {
  if (rate_.interval_ms != 0 && saves_left_ == 0) return Status::kTooSoon;
  if (const Status begun = store_.Save(words, count); !core::IsOk(begun)) return begun;
  if (saves_left_ > 0) --saves_left_;
  UseCounter(words, count);
  refusal_ = Status::kOk;
  state_ = TransactionState::kCommitting;
  phase_ = Phase::kStoring;
  return Status::kOk;
}

Status TableTransaction::Save(const TableCommand& command) {
  const Status status = MayStore(command, TransactionState::kChecked);
  return core::IsOk(status) ? Store(staged_, staged_words_) : status;
}

Status TableTransaction::Confirm(const TableCommand& command) {
  Status status = MayStore(command, TransactionState::kOnTrial);
  if (core::IsOk(status)) status = Store(active_, active_words_);
  confirming_ = core::IsOk(status);
  return status;
}

Status TableTransaction::Trial(const TableCommand& command) {
  Status status = MayStore(command, TransactionState::kChecked);
  if (!core::IsOk(status)) return status;
  if (!core::IsOk(table_status_) || store_.slot() < 0) return Status::kWrongOrder;  // nothing to come back to
  status = application_.try_out(application_.context);
  if (!core::IsOk(status)) return status;
  UseCounter(staged_, staged_words_);
  SwapTables();
  trial_began_ms_ = now_ms_;
  trial_ms_ = 1000u * trial_limit_s_;
  state_ = TransactionState::kOnTrial;
  return Status::kOk;
}

Status TableTransaction::Back() {
  if (state_ != TransactionState::kOnTrial) return Status::kWrongOrder;
  application_.give_back(application_.context);
  SwapTables();
  state_ = TransactionState::kIdle;
  return Status::kOk;
}

void TableTransaction::WatchTrial() {
  Status why = application_.doubt(application_.context);
  if (core::IsOk(why) && now_ms_ - trial_began_ms_ >= trial_ms_) why = Status::kTimeout;
  if (core::IsOk(why)) return;
  application_.give_back(application_.context);
  SwapTables();
  Finish(TransactionState::kFailed, why);
  Note(reg::kBack, why);
}

// The stage keeps the stored table during a trial, so that a table needs no third buffer.
void TableTransaction::SwapTables() {
  for (std::uint16_t k = 0; k < words_; ++k) {
    const std::uint16_t word = active_[k];
    active_[k] = staged_[k];
    staged_[k] = word;
  }
  const std::uint16_t count = active_words_;
  active_words_ = staged_words_;
  staged_words_ = count;
  const std::uint32_t crc = active_crc_;
  active_crc_ = checked_crc_;
  checked_crc_ = crc;
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

void TableTransaction::Step(std::uint32_t now_ms, std::uint32_t tick) {
  now_ms_ = now_ms;
  tick_ = tick;
  if (saves_left_ >= rate_.burst) {
    earned_ms_ = now_ms;
  } else if (now_ms - earned_ms_ >= rate_.interval_ms) {
    ++saves_left_;
    earned_ms_ += rate_.interval_ms;
  }
  switch (phase_) {
    case Phase::kNone:
      if (state_ == TransactionState::kOnTrial) return WatchTrial();
      if (now_ms - touched_ms_ >= kStageTimeout_ms) Abandon();
      return;
    case Phase::kChecking:
      return CheckNext();
    case Phase::kLoading:
      return LoadNext();
    case Phase::kStoring:
      return StoreNext();
    case Phase::kAdopting:
    case Phase::kBooting:
      return Adopt();
    case Phase::kRevoking: {
      const Status revoked = store_.Step();
      if (revoked == Status::kBusy) return;
      return End(TransactionState::kFailed, core::IsOk(revoked) ? refusal_ : revoked);
    }
  }
}

// If doubts come up while a table on trial is being stored, the table before comes back at once. The new record gets no
// commit word, or is erased if it has one already.
void TableTransaction::StoreNext() {
  if (confirming_ && core::IsOk(refusal_)) {
    refusal_ = application_.doubt(application_.context);
    if (!core::IsOk(refusal_)) {
      application_.give_back(application_.context);
      store_.Cancel();
    }
  }
  const Status stored = store_.Step();
  if (stored == Status::kBusy) return;
  if (!confirming_) {
    if (!core::IsOk(stored)) return End(TransactionState::kFailed, stored);
    phase_ = Phase::kAdopting;
    touched_ms_ = now_ms_;
    return;
  }
  confirming_ = false;
  if (core::IsOk(stored) && core::IsOk(refusal_)) return End(TransactionState::kActive, Status::kOk);
  if (core::IsOk(refusal_)) application_.give_back(application_.context);
  SwapTables();
  if (core::IsOk(stored)) return Revoke(refusal_);
  End(TransactionState::kFailed, stored == Status::kEmpty ? refusal_ : stored);
}

// An axis may have been enabled after the application permitted the adoption. Wait until it is disabled, but not for
// ever.
void TableTransaction::Adopt() {
  const bool booting = phase_ == Phase::kBooting;
  const Status status = application_.adopt(application_.context);
  if (core::IsOk(status)) {
    Activate();
    if (booting) return Finish(TransactionState::kIdle, Status::kOk);
    return End(TransactionState::kActive, Status::kOk);
  }
  if (booting) {
    table_status_ = status;
    if (status != Status::kBusy) Finish(TransactionState::kIdle, status);
    return;
  }
  const bool may_change = status == Status::kBusy || status == Status::kAxisEnabled;
  if (may_change && now_ms_ - touched_ms_ < kStageTimeout_ms) return;
  Revoke(status == Status::kBusy ? Status::kTimeout : status);
}

// Erases the record that was stored last. `why`: what the transaction then answers.
void TableTransaction::Revoke(Status why) {
  refusal_ = why;
  const Status revoking = store_.Revoke();
  if (!core::IsOk(revoking)) return End(TransactionState::kFailed, revoking);
  phase_ = Phase::kRevoking;
}

void TableTransaction::Activate() {
  std::memcpy(active_, staged_, 2u * staged_words_);
  std::memset(active_ + staged_words_, 0, 2u * (words_ - staged_words_));
  active_words_ = staged_words_;
  active_crc_ = checked_crc_;
  table_status_ = Status::kOk;
}

// Ends a save or a confirm, the last command that was accepted.
void TableTransaction::End(TransactionState state, Status status) {
  Finish(state, status);
  Note(last_.command, status);
}

void TableTransaction::Finish(TransactionState state, Status status) {
  phase_ = Phase::kNone;
  state_ = state;
  status_ = status;
}

}  // namespace armcal::link

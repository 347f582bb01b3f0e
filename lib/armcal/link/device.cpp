// link - what each register of a drive answers, and what a write to it does.
#include "armcal/link/device.hpp"

#include "armcal/core/version.hpp"

namespace armcal::link {

using core::Status;

Device::Device(const Identity& identity, const LiveStatus& live, TableTransaction& transaction,
               const ClientRequests& requests)
    : identity_(identity), live_(live), transaction_(transaction), requests_(requests), engine_(map_, identity.texts) {
  static_cast<void>(ServeOwn());  // cannot be refused: the map is still empty, and a test reads every register
}

Status Device::ServeOwn() {
  const Span staged = SpanOf(reg::kStagedTable, transaction_.words());
  const Span active = SpanOf(reg::kActiveTable, transaction_.words());
  using Words32 = Scratch<reg::kScratchWords>;
  using Values4 = Scratch<2 * reg::kScratchValues>;
  const Block blocks[] = {
      FilledBlock<reg::kIdentityBlock, &Device::FillIdentity>(this),
      FilledBlock<reg::kLibraryVersion, &Device::FillVersion>(this),
      FilledBlock<reg::kStatusBlock, &Device::FillStatus>(this),
      FilledBlock<reg::kDoubtBlock, &Device::FillDoubt>(this),
      FilledBlock<reg::kWritingBlock, &Device::FillWriting>(this),
      FilledBlock<reg::kTableBlock, &Device::FillTable>(this),
      FilledBlock<reg::kLogBlock, &Device::FillLog>(this),
      FilledBlock<reg::kTrialLimit, &Device::FillTrialLimit, &Device::TakeTrialLimit>(this),
      DirectBlock<&Device::ReadOverview>(SpanOf(reg::kOverview), this),
      FilledBlock<reg::kResidualHeaderBlock, &Device::FillResidualHeader>(this),
      DirectBlock<&FloatList::Read>(reg::kResidualValuesBlock, &residual_values_),
      FilledBlock<reg::kCommandBlock, &Device::FillCommand, &Device::TakeCommand>(this),
      FilledBlock<reg::kUnlock, &Device::FillUnlock, &Device::TakeUnlock>(this),
      DirectBlock<&Device::ReadStaged, &Device::WriteStaged>(staged, this),
      DirectBlock<&Device::ReadActive>(active, this),
      FilledBlock<reg::kResidualSelect, &Device::FillSelect, &Device::TakeSelect>(this),
      FilledBlock<reg::kLearningHold, &Device::FillHold, &Device::TakeHold>(this),
      FilledBlock<reg::kLearningReset, &Device::FillReset, &Device::TakeReset>(this),
      DirectBlock<&Words32::Read, &Words32::Write>(SpanOf(reg::kScratch), &scratch_),
      DirectBlock<&Values4::Read, &Values4::Write>(SpanOf(reg::kScratchFloat), &scratch_float_),
      DirectBlock<&Values4::Read, &Values4::Write>(SpanOf(reg::kScratchU32), &scratch_u32_),
  };
  return map_.Add(blocks);
}

Status Device::Serve(const Span& list, const float* values) {
  if (list_count_ == kMaxLists) return Status::kFull;
  lists_[list_count_].values = values;
  const Status added = map_.Add(DirectBlock<&FloatList::Read>(list, &lists_[list_count_]));
  if (core::IsOk(added)) ++list_count_;
  return added;
}

void Device::Step(std::uint32_t now_ms) {
  now_ms_ = now_ms;
  Sessions& sessions = map_.sessions();
  sessions.Tell(now_ms);
  const bool late = now_ms - touched_ms_ >= kUnlock_ms;
  if (sessions.writer() != Sessions::kNobody && (late || !sessions.IsOpen(sessions.writer()))) LeaveSeat();
  transaction_.Step(now_ms, live_.tick);
}

// Identity and status ------------------------------------------------------------------------------------------------

void Device::FillIdentity(Words<reg::kIdentityBlock>& w) {
  w.Set<reg::kMagic>(reg::kMagicValue);
  w.Set<reg::kMapMajor>(reg::kMapMajorValue);
  w.Set<reg::kMapMinor>(reg::kMapMinorValue);
  w.Set<reg::kLayoutCrc>(kLayoutCrc);
  w.Set<reg::kSchema>(identity_.schema);
  w.Set<reg::kFirmwareVersion>(identity_.firmware_version);
  w.Set<reg::kSerialNumber>(identity_.serial_number);
  w.Set<reg::kProbeFloat>(reg::kProbeFloatValue);
  w.Set<reg::kProbeU32>(reg::kProbeU32Value);
  w.Set<reg::kAxes>(identity_.axes);
  w.Set<reg::kParameters>(identity_.parameters);
  w.Set<reg::kColumns>(identity_.columns);
  w.Set<reg::kTableWords>(static_cast<std::uint16_t>(transaction_.store().shortest()));
  w.Set<reg::kCapabilities>(identity_.capabilities);
  w.Set<reg::kTickRate>(identity_.tick_rate_Hz);
  w.Set<reg::kSampleTicks>(identity_.sample_ticks);
  w.Set<reg::kPageDataWords>(reg::kMaxPageWords);
}

void Device::FillVersion(Words<reg::kLibraryVersion>& w) { w.Set<reg::kLibraryVersion>(std::uint32_t{ARMCAL_VERSION}); }

void Device::FillStatus(Words<reg::kStatusBlock>& w) {
  const LastError& error = map_.last_error();
  const table::TableStore& store = transaction_.store();
  w.Set<reg::kTransactionState>(transaction_.state());
  w.Set<reg::kTransactionStatus>(transaction_.status());
  w.Set<reg::kTableStatus>(transaction_.table_status());
  w.Set<reg::kFeedForwardState>(live_.feedforward_state);
  w.Set<reg::kGeneration>(live_.generation);
  w.Set<reg::kTick>(live_.tick);
  w.Set<reg::kActiveCrc>(transaction_.active_crc());
  w.Set<reg::kCommandSequence>(transaction_.last_command().sequence);
  w.Set<reg::kStoreSequence>(store.sequence());
  w.Set<reg::kSlotState, 0>(store.slot_state(0));
  w.Set<reg::kSlotState, 1>(store.slot_state(1));
  w.Set<reg::kEnabledAxes>(live_.enabled_axes);
  w.Set<reg::kClampCount>(live_.clamp_count);
  w.Set<reg::kSampleGaps>(live_.sample_gaps);
  w.Set<reg::kRequestCount>(map_.requests());
  w.Set<reg::kErrorException>(static_cast<std::uint16_t>(error.exception));
  w.Set<reg::kErrorFunction>(static_cast<std::uint16_t>(error.function));
  w.Set<reg::kErrorAddress>(error.address);
  w.Set<reg::kErrorStatus>(error.status);
  w.Set<reg::kErrorRequest>(error.request);
  w.Set<reg::kUnlocked>(Seated());
  w.Set<reg::kHealth>(live_.health);
  w.Set<reg::kRowsUsedA>(live_.rows_used[0]);
  w.Set<reg::kRowsGatedA>(live_.rows_gated[0]);
  w.Set<reg::kRowsUsedB>(live_.rows_used[1]);
  w.Set<reg::kRowsGatedB>(live_.rows_gated[1]);
}

void Device::FillDoubt(Words<reg::kDoubtBlock>& w) {
  w.Set<reg::kRowsOutsideA>(live_.rows_outside[0]);
  w.Set<reg::kRowsOutsideB>(live_.rows_outside[1]);
  w.Set<reg::kImplausibleTicks>(live_.implausible_ticks);
  w.Set<reg::kTableFallbacks>(transaction_.store().fallbacks());
}

void Device::FillWriting(Words<reg::kWritingBlock>& w) {
  const core::Refusal& why = transaction_.refusal();
  w.Set<reg::kRefusedStatus>(why.status);
  w.Set<reg::kRefusedWord>(why.word);
  w.Set<reg::kRefusedValue>(why.value);
  w.Set<reg::kRefusedBound>(why.bound);
  const std::uint32_t writer = map_.sessions().writer();
  const bool there = writer != Sessions::kNobody && map_.sessions().IsPresent(writer);
  w.Set<reg::kWriterSeat>(static_cast<std::uint16_t>(Seated() ? 1 : there ? 2 : 0));
  constexpr std::uint32_t kLongest_s = 65535;  // of a register
  const std::uint32_t wait_s = (transaction_.save_wait_ms() + 999) / 1000;
  w.Set<reg::kSaveWait>(static_cast<std::uint16_t>(wait_s < kLongest_s ? wait_s : kLongest_s));
}

void Device::FillTable(Words<reg::kTableBlock>& w) {
  w.Set<reg::kTableRoom>(transaction_.words());
  w.Set<reg::kActiveWords>(transaction_.active_words());
  w.Set<reg::kWritingAllowed>(MayWrite());
  w.Set<reg::kTrialLeft>(transaction_.trial_left_s());
  w.Set<reg::kSigningCounter>(transaction_.counter());
  w.Set<reg::kSigning>(transaction_.signing());
}

Status Device::ReadOverview(std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
  std::uint16_t all[reg::kOverview.count];
  std::uint16_t* at = all;
  const auto append = [&at](const auto& block) {
    std::memcpy(at, block.data(), 2u * block.size());
    at += block.size();
  };
  Words<reg::kIdentityBlock> identity;
  Words<reg::kStatusBlock> status;
  Words<reg::kDoubtBlock> doubt;
  Words<reg::kWritingBlock> writing;
  FillIdentity(identity), FillStatus(status), FillDoubt(doubt), FillWriting(writing);
  append(identity), append(status), append(doubt), append(writing);
  static_assert(identity.size() + status.size() + doubt.size() + writing.size() == reg::kOverview.count);
  return CopyWords(all, offset, count, words);
}

// Seat and tables ----------------------------------------------------------------------------------------------------

// Whether the session that asks may write.
bool Device::Seated() { return map_.sessions().writer() == map_.sessions().asking(); }

// The next writer begins with open.
void Device::LeaveSeat() {
  map_.sessions().SetWriter(Sessions::kNobody);
  transaction_.Abandon();
}

// kForbidden, kLocked, kSeatTaken; or kOk, and the seat is kept for another while.
Status Device::NeedsUnlock() {
  if (!MayWrite()) return Status::kForbidden;
  if (!Seated()) return map_.sessions().IsPresent(map_.sessions().writer()) ? Status::kSeatTaken : Status::kLocked;
  touched_ms_ = now_ms_;
  return Status::kOk;
}

void Device::FillUnlock(Words<reg::kUnlock>& w) { w.Set<reg::kUnlock>(std::uint32_t{Seated() ? 1u : 0u}); }

Status Device::TakeUnlock(const Words<reg::kUnlock>& w) {
  Sessions& sessions = map_.sessions();
  const std::uint32_t key = w.Get<reg::kUnlock>();
  if (key == 0 && Seated()) {
    LeaveSeat();
    return Status::kOk;
  }
  if (key != reg::kUnlockKey) return Status::kLocked;
  if (!MayWrite()) return Status::kForbidden;
  if (!Seated()) {
    if (sessions.IsPresent(sessions.writer())) return Status::kSeatTaken;
    LeaveSeat();
    sessions.SetWriter(sessions.asking());
  }
  touched_ms_ = now_ms_;
  return Status::kOk;
}

void Device::FillCommand(Words<reg::kCommandBlock>& w) {
  const TableCommand& last = transaction_.last_command();
  w.Set<reg::kSequence>(last.sequence);
  w.Set<reg::kCommand>(last.command);
  w.Set<reg::kCommandSchema>(last.schema);
  w.Set<reg::kCommandWords>(last.words);
  w.Set<reg::kCommandCrc>(last.crc);
}

Status Device::TakeCommand(const Words<reg::kCommandBlock>& w) {
  const TableCommand command{w.Get<reg::kSequence>(), w.Get<reg::kCommand>(), w.Get<reg::kCommandSchema>(),
                             w.Get<reg::kCommandWords>(), w.Get<reg::kCommandCrc>()};
  if (w.Get<reg::kCommandReserved>() != 0) return Status::kOutOfRange;
  // A client whose connection broke before the reply asks again over a new one, which has no seat.
  if (transaction_.IsRepeat(command)) return Status::kOk;
  const Status unlocked = NeedsUnlock();
  if (!core::IsOk(unlocked)) return unlocked;
  return transaction_.Command(command, map_.sessions().asking());
}

void Device::FillTrialLimit(Words<reg::kTrialLimit>& w) { w.Set<reg::kTrialLimit>(transaction_.trial_limit_s()); }

Status Device::TakeTrialLimit(const Words<reg::kTrialLimit>& w) {
  const std::uint16_t limit_s = w.Get<reg::kTrialLimit>();
  if (!TableTransaction::MayLast(limit_s)) return Status::kOutOfRange;
  const Status unlocked = NeedsUnlock();
  return core::IsOk(unlocked) ? transaction_.SetTrialLimit(limit_s) : unlocked;
}

void Device::FillLog(Words<reg::kLogBlock>& w) {
  const EventLog& log = transaction_.log();
  w.Set<reg::kLogCount>(log.count());
  for (std::uint32_t k = 0; k < EventLog::kEvents; ++k) {
    w.Put<reg::kLogTick>(k, log.at(k).tick);
    w.Put<reg::kLogConnection>(k, log.at(k).connection);
    w.Put<reg::kLogCommand>(k, log.at(k).command);
    w.Put<reg::kLogStatus>(k, log.at(k).status);
  }
}

Status Device::ReadStaged(std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
  return CopyWords(transaction_.staged(), offset, count, words);
}

Status Device::WriteStaged(std::uint16_t offset, std::uint16_t count, const std::uint16_t* words) {
  const Status unlocked = NeedsUnlock();
  return core::IsOk(unlocked) ? transaction_.WriteStaged(offset, count, words) : unlocked;
}

Status Device::ReadActive(std::uint16_t offset, std::uint16_t count, std::uint16_t* words) {
  return CopyWords(transaction_.active(), offset, count, words);
}

// Learning -----------------------------------------------------------------------------------------------------------

// kForbidden: the drive has a key, and nothing in these commands is signed. Else as NeedsUnlock.
Status Device::MayCommandLearning() {
  return transaction_.signing() != SealMethod::kNone ? Status::kForbidden : NeedsUnlock();
}

void Device::FillHold(Words<reg::kLearningHold>& w) { w.Set<reg::kLearningHold>(held_); }

Status Device::TakeHold(const Words<reg::kLearningHold>& w) {
  const std::uint16_t hold = w.Get<reg::kLearningHold>();
  if (hold > 1) return Status::kOutOfRange;
  const Status unlocked = MayCommandLearning();
  const Status done = core::IsOk(unlocked) ? requests_.hold(requests_.context, hold == 1) : unlocked;
  if (core::IsOk(done)) held_ = hold;
  return done;
}

void Device::FillReset(Words<reg::kLearningReset>&) {}  // it is a command and reads 0

Status Device::TakeReset(const Words<reg::kLearningReset>& w) {
  const std::uint16_t block = w.Get<reg::kLearningReset>();
  if (block < 1 || block > identity_.axes + 1) return Status::kOutOfRange;
  const Status unlocked = MayCommandLearning();
  return core::IsOk(unlocked) ? requests_.reset(requests_.context, block - 1) : unlocked;
}

// Residual statistics ------------------------------------------------------------------------------------------------

void Device::FillSelect(Words<reg::kResidualSelect>& w) { w.Set<reg::kResidualSelect>(residual_joint_); }

Status Device::TakeSelect(const Words<reg::kResidualSelect>& w) {
  const std::uint16_t joint = w.Get<reg::kResidualSelect>();
  if (joint < 1 || joint > identity_.axes) return Status::kOutOfRange;
  residual_joint_ = joint;
  ++snapshot_;
  requests_.take_residuals(requests_.context, joint - 1, residuals_);
  return Status::kOk;
}

void Device::FillResidualHeader(Words<reg::kResidualHeaderBlock>& w) {
  w.Set<reg::kResidualJoint>(residual_joint_);
  w.Set<reg::kResidualSnapshot>(snapshot_);
  w.Set<reg::kResidualGeneration>(residuals_.generation);
  w.Set<reg::kResidualElapsed>(residuals_.elapsed_s);
  w.Set<reg::kResidualSigma>(residuals_.sigma_Nm);
}

}  // namespace armcal::link

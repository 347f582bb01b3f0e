// link - flashing a table: the order in which its words are staged, checked, stored and adopted.
#pragma once

#include <cstdint>

#include "armcal/core/status.hpp"
#include "armcal/link/event_log.hpp"
#include "armcal/link/registers.hpp"
#include "armcal/link/seal.hpp"
#include "armcal/table/table_store.hpp"

namespace armcal::link {

// What the application does with a table, in the order in which the transaction asks for it. None of these may wait.
// Context: background.
struct TableApplication {
  void* context;
  // Decodes `words` [count], judges them and builds what adopt() will put in force, in slices. kBusy: call again with
  // the same words. Else kOk, or the reason of refusal. What was built stays ready until the next check; nothing is in
  // force yet. `first`: a new check begins, whatever became of the one before.
  core::Refusal (*check)(void* context, const std::uint16_t* words, std::uint16_t count, bool first);
  // Says whether adopt() would succeed now: kOk, kAxisEnabled, or kWrongOrder (no checked table is ready). It has no
  // effect. The transaction calls it before it stores anything.
  core::Status (*permit)(void* context);
  // Puts in force what the last check built. kBusy: call again, it is not finished. Any other answer but kOk: no
  // effect. The transaction calls it only as long as the staged words are those of the last check.
  core::Status (*adopt)(void* context);
  // Puts in force what the last check built, without a word about storage: it fades in by the shortest fade, and what
  // was in force stays ready for give_back(). kOk; any other answer: no effect.
  core::Status (*try_out)(void* context);
  // Puts in force what was in force before try_out(), also while axes are enabled, by the shortest fade. The
  // transaction checks no other table in between.
  void (*give_back)(void* context);
  // Whether a table on trial does well: kOk, or why it must end.
  core::Status (*doubt)(void* context);
};

// How often tables may be stored, because a storage wears out: `burst` saves without a pause, then one in each
// interval. interval_ms 0: as often as a client likes.
struct SaveRate {
  std::uint16_t burst = 5;
  std::uint32_t interval_ms = 60000;
};

// The command block, which a client writes in one request.
struct TableCommand {
  std::uint32_t sequence = 0;
  std::uint32_t command = 0;
  std::uint32_t schema = 0;
  std::uint16_t words = 0;
  std::uint32_t crc = 0;
};

// A client opens, stages words in any order, checks, saves and polls the state. A save stores the table, reads it back
// and then adopts it. So the table in force changes last. If the application refuses the adoption (kBusy and
// kAxisEnabled: if it still does so after kStageTimeout_ms), the stored record is erased, and the state is kFailed: the
// table before is in force. Status kStorageFault means that the storage failed; see TableStore::Step. A command with
// the same sequence number and content as the last accepted one has no second effect. So a client that lost a reply may
// send it again.
// In place of a save, a client may put a checked table on trial. It is then in force and not stored. A confirm stores
// it. The table before comes back when the time limit has passed, when the application has doubts, or when the client
// asks for it; a power cut has the same effect. Context of every call: background.
class TableTransaction {
 public:
  // After this time without a write, the staged words are dropped. After this time, an adoption that is still refused
  // is given up.
  static constexpr std::uint32_t kStageTimeout_ms = 30000;

  // `staged`, `active`: buffers [words] that outlive this; words: the longest table that `store` takes. `active` may
  // hold defaults of the shortest length, which Boot() replaces. signing: if it has a key or a function, only tables
  // with a good seal are accepted over the wire, and each needs a counter above every counter in the store. What is
  // already stored is taken as it is.
  TableTransaction(const TableApplication& application, table::TableStore& store, std::uint32_t schema,
                   std::uint16_t* staged, std::uint16_t* active, std::uint16_t words, const SaveRate& rate = {},
                   const Signing& signing = {});

  // At power-up: loads the stored table, checks it and adopts it. The answer is kept as table_status(): kOk; what the
  // store answers (kBlank, kCorrupt, kWrongSchema, kWrongSize); or why the application refused the last stored table
  // that reads well: the newest is tried first, then the older one. kBusy: the application is still adopting, and
  // Step() finishes it.
  core::Status Boot();

  // `connection`: who asks, for the log. kWrongOrder: not in this state, or the sequence is 0 or was used with other
  // content; trial: no stored table is in force. kEmpty, kCorrupt, kStorageFault: load: no older table is there to
  // read. kOutOfRange: no such command. kWrongSchema: not a table of this firmware. kWrongSize: it has no table of this
  // length, or another one was opened. kBadCrc: check: the staged words have another checksum; save: the checksum is
  // not that of the last check. kBadSignature, kOtherDrive, kReplayed: check: the seal. kBusy: committing, or another
  // command is being checked. kTooSoon: the rate of saves. Or the application's answer. kUnfinished: it is being
  // checked; the same command again gives the answer when Step() has done the rest. kStorageFault and kTimeout appear
  // in status() only.
  core::Status Command(const TableCommand& command, std::uint32_t connection = 0);
  // Returns true if `command` equals the last accepted command, sequence number included. Then Command() has no effect.
  bool IsRepeat(const TableCommand& command) const;
  // Drops the staged words and a running check, because their writer is gone. A commit goes on.
  void Abandon();

  // offset + count <= words(). kWrongOrder: no transaction is open. kWrongSize: beyond the table that was opened.
  // kBusy: committing or checking.
  core::Status WriteStaged(std::uint16_t offset, std::uint16_t count, const std::uint16_t* words);

  // Does one bounded piece of a check, a load or a commit. Drops the staged words after kStageTimeout_ms without a
  // write (state kIdle, status kTimeout). Ends a trial if it must (state kFailed, and the reason as status).
  void Step(std::uint32_t now_ms, std::uint32_t tick = 0);

  // How long the next trial may last. An open sets reg::kUsualTrial_s.
  static constexpr bool MayLast(std::uint16_t limit_s) { return limit_s >= 1 && limit_s <= reg::kLongestTrial_s; }
  core::Status SetTrialLimit(std::uint16_t limit_s);
  std::uint16_t trial_limit_s() const { return trial_limit_s_; }
  std::uint16_t trial_left_s() const;  // 0: no trial

  TransactionState state() const { return state_; }
  bool busy() const { return phase_ != Phase::kNone; }  // Step() has something to do
  core::Status status() const { return status_; }
  core::Status table_status() const { return table_status_; }
  const core::Refusal& refusal() const { return why_; }  // what the last check said
  std::uint32_t save_wait_ms() const;                    // until the rate allows the next save
  std::uint32_t active_crc() const { return active_crc_; }
  const TableCommand& last_command() const { return last_; }
  const std::uint16_t* staged() const { return staged_; }
  const std::uint16_t* active() const { return active_; }
  std::uint16_t words() const { return words_; }                // of the longest table
  std::uint16_t active_words() const { return active_words_; }  // of the table in force
  const table::TableStore& store() const { return store_; }
  const EventLog& log() const { return log_; }
  bool sealing() const {
    return phase_ == Phase::kChecking && sealing_;
  }  // the next Step works on a signature, which takes as long as other slices
  SealMethod signing() const { return signing_.method(); }
  std::uint32_t counter() const { return counter_; }  // the highest one: a signed table needs a higher one

 private:
  enum class Phase : std::uint8_t { kNone, kChecking, kLoading, kStoring, kAdopting, kRevoking, kBooting };

  void BootFromStore();
  core::Status Apply(const TableCommand& command);
  bool staging() const {
    return state_ == TransactionState::kOpen || state_ == TransactionState::kLoading ||
           state_ == TransactionState::kChecked;
  }
  core::Status Open(const TableCommand& command);
  core::Status Check(const TableCommand& command);
  void CheckNext();
  void JudgeSeal();
  void Judged(const core::Refusal& why);
  void UseCounter(const std::uint16_t* words, int count);
  void ReadCounters();
  void Answer(core::Status status);
  core::Status Load(const TableCommand& command);
  void LoadNext();
  core::Status MayStore(const TableCommand& command, TransactionState wanted) const;
  core::Status Store(const std::uint16_t* words, std::uint16_t count);
  core::Status Save(const TableCommand& command);
  core::Status Trial(const TableCommand& command);
  core::Status Confirm(const TableCommand& command);
  core::Status Back();
  void WatchTrial();
  void SwapTables();
  void StoreNext();
  void Revoke(core::Status why);
  void Note(std::uint32_t command, core::Status status, std::uint32_t connection = 0);
  void Adopt();
  void Activate();
  void Finish(TransactionState state, core::Status status);
  void End(TransactionState state, core::Status status);

  TableApplication application_;
  table::TableStore& store_;
  std::uint32_t schema_;
  std::uint16_t* staged_;
  std::uint16_t* active_;
  std::uint16_t words_;
  std::uint16_t staged_words_ = 0, active_words_;

  TransactionState state_ = TransactionState::kIdle;
  Phase phase_ = Phase::kNone;
  core::Status status_ = core::Status::kOk;
  core::Status table_status_ = core::Status::kBlank;
  core::Refusal why_;
  core::Status refusal_ = core::Status::kOk;  // why the adoption failed, while the record is taken back
  TableCommand last_;
  TableCommand checking_;                    // the check that runs, or whose answer waits
  core::Status answer_ = core::Status::kOk;  // of checking_, if it was refused
  bool answered_ = false;                    // answer_ has not been taken
  std::uint16_t summed_ = 0;                 // words whose checksum is in sum_
  std::uint32_t sum_ = 0;
  bool first_ = false;  // the application has not begun
  Signing signing_;
  SealCheck seal_;
  bool sealing_ = false;  // the seal of the staged table is not judged yet
  std::uint32_t counter_ = 0;
  std::uint32_t checked_crc_ = 0;
  std::uint32_t active_crc_ = 0;
  std::uint32_t now_ms_ = 0;
  std::uint32_t touched_ms_ = 0;
  std::uint32_t tick_ = 0;
  EventLog log_;
  std::uint32_t checking_connection_ = 0;
  std::uint16_t trial_limit_s_ = reg::kUsualTrial_s;
  std::uint32_t trial_ms_ = 0, trial_began_ms_ = 0;  // of the trial that runs
  bool confirming_ = false;                          // what is being stored is a table on trial
  SaveRate rate_;
  std::uint16_t saves_left_;
  std::uint32_t earned_ms_ = 0;  // when the last one of saves_left_ was earned
};

}  // namespace armcal::link

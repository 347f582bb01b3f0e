// link - flashing a table: the order in which its words are staged, checked, stored and adopted.
#pragma once

#include <cstdint>

#include "armcal/core/status.hpp"
#include "armcal/link/registers.hpp"
#include "armcal/table/table_store.hpp"

namespace armcal::link {

// What the application does with a table, in the order in which the transaction asks for it. Context: background; none
// may wait.
struct TableApplication {
  void* context;
  // Decodes `words`, judges them and builds what will be put in force: kOk or the reason of refusal. Nothing is in
  // force yet. What was built stays ready until the next check.
  core::Status (*check)(void* context, const std::uint16_t* words);
  // Would adopt() accept now what the last check built (kAxisEnabled)? Without effect; asked before anything is stored.
  core::Status (*permit)(void* context);
  // Puts in force what the last check built. kBusy: still at it, call again. Anything else but kOk: no effect. The
  // transaction calls it only while the words that were checked are the staged ones.
  core::Status (*adopt)(void* context);
};

// The command block as written by the client in one request.
struct TableCommand {
  std::uint32_t sequence = 0;
  std::uint32_t command = 0;
  std::uint32_t schema = 0;
  std::uint16_t words = 0;
  std::uint32_t crc = 0;
};

// open -> staged words in any order -> check -> save -> poll the state. The table in force changes last: stored, read
// back, adopted. If adopting stays refused, the stored record is taken back, so that kFailed always means "as before".
// A command repeated with its sequence number and content has no second effect; a lost reply may be asked for again.
// Context: background.
class TableTransaction {
 public:
  static constexpr std::uint32_t kStageTimeout_ms = 30000;  // an abandoned stage, or an adoption that stays refused

  // `staged`, `active`: buffers [words] of the caller's. `active` may hold defaults; Boot() replaces them.
  TableTransaction(const TableApplication& application, table::TableStore& store, std::uint32_t schema,
                   std::uint16_t* staged, std::uint16_t* active, std::uint16_t words);

  // At power-up: load, check, adopt. The answer is kept as table_status(): kOk; kBlank, kCorrupt, kWrongSchema,
  // kWrongSize of the store; or why the application refused. kBusy: the application still adopts, Step() finishes.
  core::Status Boot();

  // kWrongOrder: not in this state, sequence 0 or used with other content; kOutOfRange: no such command; kWrongSchema,
  // kWrongSize: not the table of this firmware; kBadCrc; kBusy: committing; or the application's.
  core::Status Command(const TableCommand& command);

  // kWrongOrder: nothing open. kBusy: committing. The range is inside the table.
  core::Status WriteStaged(std::uint16_t offset, std::uint16_t count, const std::uint16_t* words);

  // One bounded piece of a commit; drops an abandoned stage (back to kIdle with kTimeout).
  void Step(std::uint32_t now_ms);

  TransactionState state() const { return state_; }
  core::Status status() const { return status_; }
  core::Status table_status() const { return table_status_; }
  std::uint32_t active_crc() const { return active_crc_; }
  const TableCommand& last_command() const { return last_; }
  const std::uint16_t* staged() const { return staged_; }
  const std::uint16_t* active() const { return active_; }
  std::uint16_t words() const { return words_; }
  const table::TableStore& store() const { return store_; }

 private:
  enum class Phase : std::uint8_t { kNone, kStoring, kAdopting, kRevoking, kBooting };

  core::Status Apply(const TableCommand& command);
  core::Status Open();
  core::Status Check(const TableCommand& command);
  core::Status Save(const TableCommand& command);
  void Adopt();
  void Activate();
  void Finish(TransactionState state, core::Status status);

  TableApplication application_;
  table::TableStore& store_;
  std::uint32_t schema_;
  std::uint16_t* staged_;
  std::uint16_t* active_;
  std::uint16_t words_;

  TransactionState state_ = TransactionState::kIdle;
  Phase phase_ = Phase::kNone;
  core::Status status_ = core::Status::kOk;
  core::Status table_status_ = core::Status::kBlank;
  core::Status refusal_ = core::Status::kOk;  // why the adoption failed, while the record is taken back
  TableCommand last_;
  std::uint32_t checked_crc_ = 0;
  std::uint32_t active_crc_ = 0;
  std::uint32_t now_ms_ = 0;
  std::uint32_t touched_ms_ = 0;
};

}  // namespace armcal::link

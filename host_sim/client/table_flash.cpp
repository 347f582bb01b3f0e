// client - plays the PC's part of flashing a table (SPEC.md).
#include "host_sim/client/table_flash.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "armcal/core/crc.hpp"
#include "armcal/core/words.hpp"
#include "armcal/link/seal.hpp"
#include "host_sim/client/register_text.hpp"
#include "host_sim/client/table_seal.hpp"

namespace armcal::client {

namespace reg = link::reg;

namespace {

constexpr std::uint16_t kFirstLayout = 1;  // word 2 of a table
constexpr std::size_t kWordsAtOnce = 120;
constexpr auto kCommitPoll = std::chrono::milliseconds(5);
constexpr auto kPatience = std::chrono::seconds(60);      // twice the drive's own limit on a commit
constexpr auto kSeatPatience = std::chrono::seconds(15);  // longer than a silent writer keeps its seat
constexpr auto kSeatPoll = std::chrono::milliseconds(200);
constexpr int kRounds = 5;    // a broken connection or a damaged word costs one
constexpr int kReadings = 3;  // of a register that reads back differently

// The PC's part of bringing a table in force: by a save, or on trial.
class Flash {
 public:
  Flash(DriveClient& drive, const Key* key) : drive_(drive), key_(key) {}

  // From unlock to the last command. The drive drops what was staged when the connection breaks, and then all begins
  // anew. limit_s: of a trial; 0: the table is saved.
  void Send(std::span<const std::uint16_t> words, int limit_s, const FlashProgress& progress) {
    Repeat([&] {
      SetWords(AsTheDriveWants(words));
      Command(reg::kOpen);
      Stage(progress);
      if (limit_s > 0) drive_.WriteValue<reg::kTrialLimit>(static_cast<std::uint16_t>(limit_s));
      Check();
      Finish(limit_s > 0 ? reg::kTrial : reg::kSave);
    });
  }

  // The same with the older table of the drive.
  void SendOlder() {
    const Identity id = drive_.ReadIdentity();
    SetWords(ReadActiveTable(drive_));  // for schema and length in the command
    Repeat([&] {
      Command(reg::kLoad);
      const int room = drive_.ReadValue<reg::kTableRoom>();
      std::vector<std::uint16_t> older = drive_.Read(SpanOf(reg::kStagedTable, room));
      if (older[2] == kFirstLayout) older.resize(id.table_words);
      SetWords(AsTheDriveWants(UnsealTable(older)));
      if (words_ != older) {
        Command(reg::kOpen);
        Stage({});
      }
      Check();
      Finish(reg::kSave);
    });
  }

  // Of the table that is on trial.
  void Confirm() {
    SetWords(ReadActiveTable(drive_));
    Repeat([&] { Finish(reg::kConfirm); });
  }
  void Back() {
    SetWords(ReadActiveTable(drive_));
    Repeat([&] { Command(reg::kBack); });
  }

  // Another client may write at once. A drive that does not know how to be left is left all the same.
  void LeaveSeat() {
    try {
      drive_.WriteValue<reg::kUnlock>(0);
    } catch (const std::runtime_error&) {
    }
  }

 private:
  // Signed with the next counter if the drive asks for it. A counter is used once, so each round takes another one.
  std::vector<std::uint16_t> AsTheDriveWants(std::span<const std::uint16_t> words) {
    const Identity id = drive_.ReadIdentity();
    const auto method = id.map_minor < kMinorOfLayout2
                            ? link::SealMethod::kNone
                            : static_cast<link::SealMethod>(drive_.ReadValue<reg::kSigning>());
    const auto refuse = [&](const char* why) {
      throw RefusedError(fmt::format("{}: {}", drive_.name(), why), 0, core::Status::kBadSignature);
    };
    if (method == link::SealMethod::kNone) {
      if (key_ != nullptr) refuse("takes tables without a signature; leave --key out");
      return {words.begin(), words.end()};
    }
    if (method != link::SealMethod::kHmac) refuse("takes tables that are signed in its board's own way only");
    if (key_ == nullptr) refuse("takes signed tables only; give its key as --key FILE");
    const auto counter = drive_.ReadValue<reg::kSigningCounter>();
    if (counter == 0xFFFFFFFF) refuse("has used its last counter; it needs another key and a blank store");
    return SealTable(words, id.serial_number, counter + 1, *key_);
  }

  void SetWords(std::vector<std::uint16_t> words) {
    words_ = std::move(words);
    crc_ = core::Crc32Words(words_.data(), words_.size());
  }

  template <class Commands>
  void Repeat(Commands commands) {
    for (int round = 1;; ++round) try {
        sequence_ = drive_.ReadStatus().command_sequence;
        finishing_ = 0;
        TakeSeat();
        return commands();
      } catch (const RefusedError& error) {
        if (IsCarriedOut()) return;
        const bool again = error.status == core::Status::kLocked || error.status == core::Status::kWrongOrder ||
                           error.status == core::Status::kBadCrc || error.status == core::Status::kReplayed;
        if (!again || round == kRounds) throw;
      }
  }

  // The command after which the drive acts.
  void Finish(std::uint32_t command) {
    finishing_ = command;
    Command(command);
  }

  void TakeSeat() {
    const auto deadline = std::chrono::steady_clock::now() + kSeatPatience;
    for (;;) try {
        return drive_.WriteValue<reg::kUnlock>(reg::kUnlockKey);
      } catch (const RefusedError& error) {
        if (error.status != core::Status::kSeatTaken || std::chrono::steady_clock::now() >= deadline) throw;
        std::this_thread::sleep_for(kSeatPoll);
      }
  }

  // A command whose reply was damaged or lost may be under way, or done.
  bool IsCarriedOut() {
    if (finishing_ == 0) return false;
    const DriveStatus s = drive_.ReadStatus();
    return s.command_sequence == sequence_ && (s.transaction_state == link::TransactionState::kCommitting ||
                                               s.transaction_state == link::TransactionState::kActive ||
                                               s.transaction_state == link::TransactionState::kOnTrial);
  }

  // A refusal names the register that the drive did not like, if it knows one.
  void Check() {
    try {
      Command(reg::kCheck);
    } catch (const RefusedError& error) {
      if (error.exception == 0 || drive_.ReadIdentity().map_minor < 3) throw;
      const auto w = drive_.Read<reg::kWritingBlock>();
      if (w.Get<reg::kRefusedStatus>() != static_cast<std::uint16_t>(error.status) ||
          w.Get<reg::kRefusedWord>() == core::Refusal::kNoWord)
        throw;
      throw RefusedError(
          fmt::format("{}; word {} of the table is {:.9g}, expected at most or at least {:.9g}", error.what(),
                      w.Get<reg::kRefusedWord>(), w.Get<reg::kRefusedValue>(), w.Get<reg::kRefusedBound>()),
          error.exception, error.status);
    }
  }

  void Command(std::uint32_t command) {
    if (++sequence_ == 0) sequence_ = 1;
    link::Words<reg::kCommandBlock> w;
    w.Set<reg::kSequence>(sequence_);
    w.Set<reg::kCommand>(command);
    if (words_.size() >= 2) w.Set<reg::kCommandSchema>(core::GetU32(words_.data()));
    w.Set<reg::kCommandWords>(static_cast<std::uint16_t>(words_.size()));
    w.Set<reg::kCommandCrc>(crc_);
    drive_.Write(w);
  }

  void Stage(const FlashProgress& progress) {
    for (std::size_t done = 0; done < words_.size(); done += kWordsAtOnce) {
      const std::size_t part = std::min(kWordsAtOnce, words_.size() - done);
      drive_.Write(reg::kStagedTable + static_cast<int>(done), std::span(words_).subspan(done, part));
      if (progress) progress(0.8 * static_cast<double>(done + part) / static_cast<double>(words_.size()));
    }
  }

 public:
  DriveStatus AwaitEnd() {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < deadline) {
      const DriveStatus s = drive_.ReadStatus();
      if (s.transaction_state == link::TransactionState::kActive ||
          s.transaction_state == link::TransactionState::kOnTrial)
        return s;
      if (s.transaction_state == link::TransactionState::kFailed)
        throw RefusedError(fmt::format("{}: the table was not taken: {}; the table before it stays in force",
                                       drive_.name(), StatusName(s.transaction_status)),
                           0, s.transaction_status);
      std::this_thread::sleep_for(kCommitPoll);
    }
    throw LinkError(drive_.name() + ": the drive does not finish saving; its state is unknown");
  }

  void Verify(const DriveStatus& s) {
    const std::vector<std::uint16_t> back = drive_.Read(SpanOf(reg::kActiveTable, static_cast<int>(words_.size())));
    for (std::size_t k = 0; k < words_.size(); ++k)
      if (back[k] != words_[k] && !ReadsBack(k))
        throw VerifyError(fmt::format("{}: register 0x{:04X} of the active table reads back differently", drive_.name(),
                                      reg::kActiveTable + static_cast<int>(k)));
    if (s.active_crc != crc_ || s.table_status != core::Status::kOk)
      throw VerifyError(fmt::format("{}: active table has CRC 0x{:08X} ({}), expected 0x{:08X}", drive_.name(),
                                    s.active_crc, StatusName(s.table_status), crc_));
  }

 private:
  // Damage on the way does not come back at the same place.
  bool ReadsBack(std::size_t word) {
    for (int k = 0; k < kReadings; ++k)
      if (drive_.ReadHolding(reg::kActiveTable + static_cast<int>(word), 1)[0] == words_[word]) return true;
    return false;
  }

  DriveClient& drive_;
  const Key* key_;  // nullptr: none
  std::vector<std::uint16_t> words_;
  std::uint32_t finishing_ = 0;  // the last command, once it was sent
  std::uint32_t sequence_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace

namespace {

// Does what `send` says with a drive, waits for the end, and proves it.
template <class Send>
FlashReport Carry(DriveClient& drive, const Key* key, Send send) {
  Flash flash(drive, key);
  DriveStatus s;
  try {
    send(flash);
    s = flash.AwaitEnd();
  } catch (const RefusedError&) {
    flash.LeaveSeat();
    throw;
  }
  flash.LeaveSeat();
  flash.Verify(s);
  return {s.active_crc, s.generation, s.store_sequence};
}

void Expect(DriveClient& drive, const char* what) {
  const Identity id = drive.ReadIdentity();
  if (id.map_minor >= kMinorOfLayout2) return;
  throw RefusedError(fmt::format("{}: its map {}.{} has no {}; expected a drive of map 1.{} or newer", drive.name(),
                                 id.map_major, id.map_minor, what, kMinorOfLayout2),
                     0, core::Status::kOutOfRange);
}

}  // namespace

FlashReport FlashTable(DriveClient& drive, std::span<const std::uint16_t> words, const FlashProgress& progress,
                       const Key* key) {
  const FlashReport report = Carry(drive, key, [&](Flash& flash) { flash.Send(words, 0, progress); });
  if (progress) progress(1.0);
  return report;
}

FlashReport TryTable(DriveClient& drive, std::span<const std::uint16_t> words, int limit_s,
                     const FlashProgress& progress, const Key* key) {
  Expect(drive, "trial");
  const FlashReport report = Carry(drive, key, [&](Flash& flash) { flash.Send(words, limit_s, progress); });
  if (progress) progress(1.0);
  return report;
}

FlashReport ConfirmTrial(DriveClient& drive) {
  Expect(drive, "trial");
  return Carry(drive, nullptr, [](Flash& flash) { flash.Confirm(); });
}

void EndTrial(DriveClient& drive) {
  Expect(drive, "trial");
  Flash flash(drive, nullptr);
  try {
    flash.Back();
  } catch (const RefusedError&) {
    flash.LeaveSeat();
    throw;
  }
  flash.LeaveSeat();
}

FlashReport Rollback(DriveClient& drive, const Key* key) {
  Expect(drive, "older table to load");
  return Carry(drive, key, [](Flash& flash) { flash.SendOlder(); });
}

std::vector<std::uint16_t> ReadActiveTable(DriveClient& drive) {
  const Identity id = drive.ReadIdentity();
  const int words = id.map_minor < kMinorOfLayout2 ? id.table_words : drive.ReadValue<reg::kActiveWords>();
  return drive.Read(SpanOf(reg::kActiveTable, words));
}

}  // namespace armcal::client

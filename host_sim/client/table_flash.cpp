// client - plays the PC's part of flashing a table (SPEC.md).
#include "host_sim/client/table_flash.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <thread>
#include <tuple>

#include "armcal/core/crc.hpp"
#include "armcal/core/words.hpp"
#include "armcal/link/seal.hpp"
#include "host_sim/client/register_text.hpp"
#include "host_sim/client/table_seal.hpp"
#include "host_sim/client/writer_seat.hpp"

namespace armcal::client {

namespace reg = link::reg;

namespace {

constexpr std::uint16_t kFirstLayout = 1;  // word 2 of a table
constexpr std::size_t kWordsAtOnce = 120;
constexpr auto kCommitPoll = std::chrono::milliseconds(5);
constexpr auto kPatience = std::chrono::seconds(60);  // twice the drive's own limit on a commit
constexpr int kRounds = 5;                            // a broken connection or a damaged word costs one
constexpr int kReadings = 5;                          // of what reads back differently

// The PC's part of bringing a table in force: by a save, or on trial.
class Flash {
 public:
  Flash(DriveClient& drive, const Key* key) : drive_(drive), key_(key) {}

  // The last command, once it was sent; 0 before.
  std::uint32_t finishing() const { return finishing_; }

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
    Repeat([&] { Finish(reg::kConfirm); }, true);
  }
  void Back() {
    SetWords(ReadActiveTable(drive_));
    Repeat([&] { Command(reg::kBack); }, true);
  }

  // Another client may write at once. A drive that does not know how to be left is left all the same.
  void LeaveSeat() {
    try {
      drive_.WriteValue<reg::kUnlock>(0);
    } catch (const std::runtime_error&) {
    }
  }

  // The end of a command that was taken, with the table read back.
  DriveStatus Proven() {
    return Sent([&] {
      const DriveStatus s = AwaitEnd();
      Verify(s);
      return s;
    });
  }

 private:
  // Signed with the next counter if the drive asks for it. A counter is used once, so each round takes another one.
  std::vector<std::uint16_t> AsTheDriveWants(std::span<const std::uint16_t> words) {
    const std::optional<std::uint32_t> counter = NextCounter(drive_, key_);
    if (!counter) return {words.begin(), words.end()};
    return SealTable(words, drive_.ReadIdentity().serial_number, *counter, *key_);
  }

  void SetWords(std::vector<std::uint16_t> words) {
    words_ = std::move(words);
    crc_ = core::Crc32Words(words_.data(), words_.size());
  }

  // of_trial: the commands are about the table on trial.
  template <class Commands>
  void Repeat(Commands commands, bool of_trial = false) {
    for (int round = 1;; ++round) try {
        sequence_ = ReadTwice().command_sequence;
        finishing_ = 0;
        TakeSeat();
        return commands();
      } catch (const RefusedError& error) {
        if (IsCarriedOut()) return;
        const bool again = error.status == core::Status::kLocked || error.status == core::Status::kWrongOrder ||
                           error.status == core::Status::kBadCrc || error.status == core::Status::kReplayed;
        if (again && round < kRounds) continue;
        if (error.status == core::Status::kWrongOrder) ThrowForTrial(error, of_trial);
        throw;
      }
  }

  // WrongOrder may mean that a trial runs, or that none does.
  void ThrowForTrial(const RefusedError& error, bool of_trial) {
    const bool on_trial = ReadTwice().transaction_state == link::TransactionState::kOnTrial;
    if (on_trial == of_trial) return;
    throw RefusedError(fmt::format("{}: {}", drive_.name(),
                                   on_trial ? "a trial runs; end or confirm it first: armcal trial --end or --confirm"
                                            : "no table is on trial"),
                       error.exception, error.status);
  }

  // The command after which the drive acts.
  void Finish(std::uint32_t command) {
    finishing_ = command;
    Command(command);
  }

  void TakeSeat() {
    WhenSeatIsFree([&] { drive_.WriteValue<reg::kUnlock>(reg::kUnlockKey); });
  }

  // Once the table is sent, a refusal to read something does not mean that the table was refused.
  template <class Look>
  DriveStatus Sent(Look look) {
    try {
      return look();
    } catch (const RefusedError& error) {
      if (error.exception == 0) throw;
      throw LinkError(error.what());
    }
  }

  // A command whose reply was damaged or lost may be under way, or done.
  bool IsCarriedOut() {
    if (finishing_ == 0) return false;
    const DriveStatus s = Sent([&] { return ReadTwice(); });
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
      const float value = w.Get<reg::kRefusedValue>(), bound = w.Get<reg::kRefusedBound>();
      throw RefusedError(fmt::format("{}; word {} of the table is {:.9g}, expected {} {:.9g}", error.what(),
                                     w.Get<reg::kRefusedWord>(), value, value > bound ? "at most" : "at least", bound),
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

  DriveStatus AwaitEnd() {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < deadline) {
      const DriveStatus s = ReadTwice();
      if (s.transaction_state == link::TransactionState::kActive ||
          s.transaction_state == link::TransactionState::kOnTrial)
        return s;
      if (s.transaction_state == link::TransactionState::kFailed)
        throw RefusedError(fmt::format("{}: the table was not taken: {}; the table before it stays in force",
                                       drive_.name(), StatusName(s.transaction_status)),
                           0, s.transaction_status);
      std::this_thread::sleep_for(kCommitPoll);
    }
    throw LinkError(drive_.name() + ": the drive does not finish saving");
  }

  void Verify(const DriveStatus& s) {
    const std::vector<std::uint16_t> back = ReadActiveTable(drive_);
    const auto differs = std::mismatch(back.begin(), back.end(), words_.begin(), words_.end()).first - back.begin();
    if (back != words_)
      throw VerifyError(fmt::format("{}: register 0x{:04X} of the active table reads back differently", drive_.name(),
                                    reg::kActiveTable + static_cast<int>(differs)));
    if (s.table_status != core::Status::kOk)
      throw VerifyError(fmt::format("{}: the table reads back, but the drive says of it: {}", drive_.name(),
                                    StatusName(s.table_status)));
  }

  // Modbus TCP has no checksum of its own. So what is decided on is read until two answers in a row say the same. They
  // never do only if the transaction goes on meanwhile; then the last one counts.
  DriveStatus ReadTwice() {
    DriveStatus s = drive_.ReadStatus();
    for (int k = 0; k < kReadings; ++k) {
      const DriveStatus before = s;
      s = drive_.ReadStatus();
      const auto decisive = [](const DriveStatus& d) {
        return std::tuple(d.transaction_state, d.transaction_status, d.table_status, d.generation, d.active_crc,
                          d.command_sequence, d.store_sequence);
      };
      if (decisive(s) == decisive(before)) break;
    }
    return s;
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
  try {
    send(flash);
    const DriveStatus s = flash.Proven();
    flash.LeaveSeat();
    return {s.active_crc, s.generation, s.store_sequence};
  } catch (const LinkError& error) {
    if (flash.finishing() == 0) throw;
    throw SentError(fmt::format("{}: {} ({})", drive.name(),
                                flash.finishing() == reg::kConfirm
                                    ? "the command to store the table on trial was sent, and it is unknown whether it "
                                      "is stored: armcal trial tells"
                                    : "the table was sent, and it is unknown whether it is in force: armcal verify or "
                                      "armcal info tells",
                                error.what()));
  } catch (const std::runtime_error&) {
    flash.LeaveSeat();
    throw;
  }
}

void Expect(DriveClient& drive, const char* what) {
  const Identity id = drive.ReadIdentity();
  if (id.map_minor >= kMinorOfLayout2) return;
  throw RefusedError(fmt::format("{}: its map {}.{} has no {}; expected a drive of map 1.{} or newer", drive.name(),
                                 id.map_major, id.map_minor, what, kMinorOfLayout2),
                     0, core::Status::kOutOfRange);
}

}  // namespace

std::optional<std::uint32_t> NextCounter(DriveClient& drive, const Key* key) {
  const auto method = drive.ReadIdentity().map_minor < kMinorOfLayout2
                          ? link::SealMethod::kNone
                          : static_cast<link::SealMethod>(drive.ReadValue<reg::kSigning>());
  const auto refuse = [&](const char* why) {
    throw RefusedError(fmt::format("{}: {}", drive.name(), why), 0, core::Status::kBadSignature);
  };
  if (method == link::SealMethod::kNone) {
    if (key != nullptr) refuse("takes tables without a signature; leave --key out");
    return std::nullopt;
  }
  if (method != link::SealMethod::kHmac) refuse("takes tables that are signed in its board's own way only");
  if (key == nullptr) refuse("takes signed tables only; give its key as --key FILE");
  const auto counter = drive.ReadValue<reg::kSigningCounter>();
  if (!IsCredible(counter, 0) && !IsCredible(counter, SignedCounter(ReadActiveTable(drive), *key)))
    refuse("shows a signing counter that its table in force does not prove; look for another device on the line");
  if (counter == 0xFFFFFFFF) refuse("has used its last counter; it needs another key and a blank store");
  return counter + 1;
}

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
  for (int k = 1;; ++k) {
    const int count = id.map_minor < kMinorOfLayout2 ? id.table_words : drive.ReadValue<reg::kActiveWords>();
    const std::vector<std::uint16_t> words = drive.Read(SpanOf(reg::kActiveTable, count));
    const std::uint32_t crc = core::Crc32Words(words.data(), words.size()), told = drive.ReadValue<reg::kActiveCrc>();
    if (crc == told) return words;
    if (k < kReadings) continue;
    // Without a valid table a drive shows its defaults. Older firmware tells another checksum than that of these.
    if (drive.ReadStatus().table_status != core::Status::kOk) return words;
    throw VerifyError(
        fmt::format("{}: the active table reads with CRC 0x{:08X}, the drive says 0x{:08X}", drive.name(), crc, told));
  }
}

}  // namespace armcal::client

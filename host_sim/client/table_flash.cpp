// client - plays the PC's part of flashing a table (SPEC.md).
#include "host_sim/client/table_flash.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <chrono>
#include <thread>

#include "armcal/core/crc.hpp"
#include "armcal/core/words.hpp"
#include "host_sim/client/register_text.hpp"

namespace armcal::client {

namespace reg = link::reg;

namespace {

constexpr std::size_t kWordsAtOnce = 120;
constexpr auto kCommitPoll = std::chrono::milliseconds(5);
constexpr auto kPatience = std::chrono::seconds(60);      // twice the drive's own limit on a commit
constexpr auto kSeatPatience = std::chrono::seconds(15);  // longer than a silent writer keeps its seat
constexpr auto kSeatPoll = std::chrono::milliseconds(200);
constexpr int kRounds = 5;    // a broken connection or a damaged word costs one
constexpr int kReadings = 3;  // of a register that reads back differently

class Flash {
 public:
  Flash(DriveClient& drive, std::span<const std::uint16_t> words) : drive_(drive), words_(words) {
    crc_ = core::Crc32Words(words.data(), words.size());
  }

  // From unlock to save. The drive drops what was staged when the connection breaks, and then all begins anew.
  void Send(const FlashProgress& progress) {
    for (int round = 1;; ++round) try {
        sequence_ = drive_.ReadStatus().command_sequence;
        saving_ = false;
        TakeSeat();
        Command(reg::kOpen);
        Stage(progress);
        Check();
        saving_ = true;
        Command(reg::kSave);
        return;
      } catch (const RefusedError& error) {
        if (IsCarriedOut()) return;
        const bool again = error.status == core::Status::kLocked || error.status == core::Status::kWrongOrder ||
                           error.status == core::Status::kBadCrc;
        if (!again || round == kRounds) throw;
      }
  }

  // Another client may write at once. A drive that does not know how to be left is left all the same.
  void LeaveSeat() {
    try {
      drive_.WriteValue<reg::kUnlock>(0);
    } catch (const std::runtime_error&) {
    }
  }

 private:
  void TakeSeat() {
    const auto deadline = std::chrono::steady_clock::now() + kSeatPatience;
    for (;;) try {
        return drive_.WriteValue<reg::kUnlock>(reg::kUnlockKey);
      } catch (const RefusedError& error) {
        if (error.status != core::Status::kSeatTaken || std::chrono::steady_clock::now() >= deadline) throw;
        std::this_thread::sleep_for(kSeatPoll);
      }
  }

  // A save whose reply was damaged or lost may be under way, or done.
  bool IsCarriedOut() {
    if (!saving_) return false;
    const DriveStatus s = drive_.ReadStatus();
    return s.command_sequence == sequence_ && (s.transaction_state == link::TransactionState::kCommitting ||
                                               s.transaction_state == link::TransactionState::kActive);
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
      drive_.Write(reg::kStagedTable + static_cast<int>(done), words_.subspan(done, part));
      if (progress) progress(0.8 * static_cast<double>(done + part) / static_cast<double>(words_.size()));
    }
  }

 public:
  DriveStatus AwaitEnd() {
    const auto deadline = std::chrono::steady_clock::now() + kPatience;
    while (std::chrono::steady_clock::now() < deadline) {
      const DriveStatus s = drive_.ReadStatus();
      if (s.transaction_state == link::TransactionState::kActive) return s;
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
  std::span<const std::uint16_t> words_;
  bool saving_ = false;
  std::uint32_t sequence_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace

FlashReport FlashTable(DriveClient& drive, std::span<const std::uint16_t> words, const FlashProgress& progress) {
  Flash flash(drive, words);
  DriveStatus s;
  try {
    flash.Send(progress);
    s = flash.AwaitEnd();
  } catch (const RefusedError&) {
    flash.LeaveSeat();
    throw;
  }
  flash.LeaveSeat();
  flash.Verify(s);
  if (progress) progress(1.0);
  return {s.active_crc, s.generation, s.store_sequence};
}

std::vector<std::uint16_t> ReadActiveTable(DriveClient& drive) {
  const Identity id = drive.ReadIdentity();
  const int words = id.map_minor < kMinorOfLayout2 ? id.table_words : drive.ReadValue<reg::kActiveWords>();
  return drive.Read(SpanOf(reg::kActiveTable, words));
}

}  // namespace armcal::client

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
constexpr auto kPatience = std::chrono::seconds(60);  // twice the drive's own limit on a commit

class Flash {
 public:
  Flash(DriveClient& drive, std::span<const std::uint16_t> words) : drive_(drive), words_(words) {
    sequence_ = drive.ReadStatus().command_sequence;
    crc_ = core::Crc32Words(words.data(), words.size());
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
    const auto differs = std::mismatch(words_.begin(), words_.end(), back.begin()).first;
    if (differs != words_.end())
      throw VerifyError(fmt::format("{}: register 0x{:04X} of the active table reads back differently", drive_.name(),
                                    reg::kActiveTable + static_cast<int>(differs - words_.begin())));
    if (s.active_crc != crc_ || s.table_status != core::Status::kOk)
      throw VerifyError(fmt::format("{}: active table has CRC 0x{:08X} ({}), expected 0x{:08X}", drive_.name(),
                                    s.active_crc, StatusName(s.table_status), crc_));
  }

 private:
  DriveClient& drive_;
  std::span<const std::uint16_t> words_;
  std::uint32_t sequence_ = 0;
  std::uint32_t crc_ = 0;
};

}  // namespace

FlashReport FlashTable(DriveClient& drive, std::span<const std::uint16_t> words, const FlashProgress& progress) {
  drive.WriteValue<reg::kUnlock>(reg::kUnlockKey);
  Flash flash(drive, words);
  flash.Command(reg::kOpen);
  flash.Stage(progress);
  flash.Command(reg::kCheck);
  flash.Command(reg::kSave);
  const DriveStatus s = flash.AwaitEnd();
  flash.Verify(s);
  if (progress) progress(1.0);
  return {s.active_crc, s.generation, s.store_sequence};
}

std::vector<std::uint16_t> ReadActiveTable(DriveClient& drive) {
  return drive.Read(SpanOf(reg::kActiveTable, drive.ReadIdentity().table_words));
}

}  // namespace armcal::client

// client - brings a parameter table into a drive and proves that it is there.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "host_sim/client/drive_client.hpp"
#include "host_sim/client/key_file.hpp"

namespace armcal::client {

// The first minor version of the register map whose drives take tables of layout version 2, put tables on trial, load
// the older table and keep a log.
inline constexpr int kMinorOfLayout2 = 5;

struct FlashReport {
  std::uint32_t crc = 0;             // of the table, as the drive reads it back
  std::uint32_t generation = 0;      // of the adoption
  std::uint32_t store_sequence = 0;  // of the stored record
};

// Called with 0 to 1 while the table is on its way.
using FlashProgress = std::function<void(double share)>;

// The counter with which the drive's next table has to be signed; nothing if it takes tables without a signature.
// Throws RefusedError if no table can be sent with this key, or without one.
std::optional<std::uint32_t> NextCounter(DriveClient& drive, const Key* key);

// Unlocks, opens, stages the words, checks, saves, waits and reads back. If another client is writing, it waits for the
// seat. If the connection breaks or a word is damaged on the way, it begins anew. `words`: the layout of
// model/parameters.hpp, whose first two words are the schema. If the drive takes signed tables only, they are signed
// with `key` and the drive's next counter. Throws RefusedError (the table before it stays in force and stored),
// VerifyError (the drive says that the table is active, but it reads back otherwise), LinkError (the table before it
// stays in force) and SentError (the link was lost once the drive had been told to take the table).
FlashReport FlashTable(DriveClient& drive, std::span<const std::uint16_t> words, const FlashProgress& progress = {},
                       const Key* key = nullptr);

// The same, but the table is put on trial for so long, and is not stored. Throws as FlashTable, and RefusedError if the
// drive knows no trial.
FlashReport TryTable(DriveClient& drive, std::span<const std::uint16_t> words, int limit_s,
                     const FlashProgress& progress = {}, const Key* key = nullptr);
// Stores the table on trial, or puts the stored table in force again. Throws as FlashTable.
FlashReport ConfirmTrial(DriveClient& drive);
void EndTrial(DriveClient& drive);
// Stores and adopts the table that was stored before the one in force. Throws as FlashTable.
FlashReport Rollback(DriveClient& drive, const Key* key = nullptr);

// The table in force, which the drive's own checksum of it confirms. Throws VerifyError if it never does, unless the
// drive has no valid table and shows its defaults: older firmware tells no checksum of them.
std::vector<std::uint16_t> ReadActiveTable(DriveClient& drive);

}  // namespace armcal::client

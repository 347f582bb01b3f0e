// client - signs a table for one drive, and takes a seal off.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "host_sim/client/key_file.hpp"

namespace armcal::client {

// The same table with a seal for this drive, by HMAC-SHA256. A table of layout version 1 becomes one of version 2 that
// means the same. Throws io::InputError for another version.
std::vector<std::uint16_t> SealTable(std::span<const std::uint16_t> words, std::uint32_t serial_number,
                                     std::uint32_t counter, const Key& key);

// The counter with which this key signed the table; 0 if it did not.
std::uint32_t SignedCounter(std::span<const std::uint16_t> words, const Key& key);

// Whether a drive can have come to the counter that it shows. proven: that of its table in force, by SignedCounter. A
// line that lies could show one near the end. The next table would then use up all counters below it, and the drive
// would take no table any more.
bool IsCredible(std::uint32_t counter, std::uint32_t proven);

// The same table with an empty seal. A table of a layout version without one stays as it is.
std::vector<std::uint16_t> UnsealTable(std::span<const std::uint16_t> words);

}  // namespace armcal::client

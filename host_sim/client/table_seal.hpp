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

// The same table with an empty seal. A table of a layout version without one stays as it is.
std::vector<std::uint16_t> UnsealTable(std::span<const std::uint16_t> words);

}  // namespace armcal::client

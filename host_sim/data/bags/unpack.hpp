// bags - decompresses LZ4 and zstd, with a limit on what comes out.
#pragma once

#include <string>

#include "host_sim/data/bags/cursor.hpp"

namespace armcal::bags {

// A constant channel or a black picture shrinks to almost nothing, but no whole log shrinks to less than 1/256 of its
// size; LZ4 cannot do it at all. What is large and claims more is made to fill the memory.
constexpr std::size_t kExpansion = 256, kExpansionFree_bytes = std::size_t{64} << 20;
constexpr std::size_t MostBytes(std::size_t packed) { return kExpansion * packed + kExpansionFree_bytes; }

// Replaces `out` by the `size` bytes that an LZ4 frame or a zstd frame unpacks to. InputError, without a file name: the
// data are damaged or hold another number of bytes, or this program was built without the library.
void UnpackLz4(Bytes packed, std::size_t size, std::string& out);
void UnpackZstd(Bytes packed, std::size_t size, std::string& out);

// Unpacks zstd frames of unknown size. InputError, without a file name: damaged, cut short, or more than MostBytes.
std::string UnpackZstd(Bytes packed);

inline bool IsZstd(Bytes bytes) { return bytes.starts_with("\x28\xB5\x2F\xFD"); }

}  // namespace armcal::bags

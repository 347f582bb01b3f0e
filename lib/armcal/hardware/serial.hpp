// hardware - the serial line that a target supplies.
#pragma once

#include <cstddef>
#include <cstdint>

namespace armcal::hardware {

// A stream of bytes in both directions. Neither function waits. Context: background. The serial interrupt fills and
// empties the rings behind these functions, and does nothing else.
struct Serial {
  void* context;
  // Moves received bytes to `bytes` and returns how many, 0 to capacity.
  std::size_t (*read)(void* context, std::uint8_t* bytes, std::size_t capacity);
  // Returns how many bytes it accepted, 0 to count. The caller offers the rest again.
  std::size_t (*write)(void* context, const std::uint8_t* bytes, std::size_t count);

  std::size_t Read(std::uint8_t* bytes, std::size_t capacity) const { return read(context, bytes, capacity); }
  std::size_t Write(const std::uint8_t* bytes, std::size_t count) const { return write(context, bytes, count); }
};

}  // namespace armcal::hardware

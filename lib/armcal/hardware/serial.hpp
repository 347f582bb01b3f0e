// hardware - what serial line a target supplies; knows no frame and no driver.
#pragma once

#include <cstddef>
#include <cstdint>

namespace armcal::hardware {

// A byte stream in both directions. Neither function waits. Context: background; the serial interrupt only fills and
// empties the rings behind them.
struct Serial {
  void* context;
  // Bytes moved to `bytes`, 0 to capacity.
  std::size_t (*read)(void* context, std::uint8_t* bytes, std::size_t capacity);
  // Bytes accepted, 0 to count; the caller offers the rest again.
  std::size_t (*write)(void* context, const std::uint8_t* bytes, std::size_t count);

  std::size_t Read(std::uint8_t* bytes, std::size_t capacity) const { return read(context, bytes, capacity); }
  std::size_t Write(const std::uint8_t* bytes, std::size_t count) const { return write(context, bytes, count); }
};

}  // namespace armcal::hardware

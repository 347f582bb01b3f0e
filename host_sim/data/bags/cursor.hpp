// bags - reads little-endian numbers and texts from bytes, and never beyond their end.
#pragma once

#include <cstdint>
#include <cstring>
#include <string_view>

#include "codegen/src/io/input_error.hpp"

namespace armcal::bags {

using Bytes = std::string_view;

// The bytes end before what they announce. Who knows the file adds its name.
struct EndOfBytes : io::InputError {
  EndOfBytes() : io::InputError("ends too early") {}
};

class Cursor {
 public:
  explicit Cursor(Bytes bytes) : bytes_(bytes) {}

  std::size_t at() const { return at_; }
  std::size_t left() const { return bytes_.size() - at_; }

  Bytes Take(std::uint64_t count) {
    if (count > left()) throw EndOfBytes();
    at_ += static_cast<std::size_t>(count);
    return bytes_.substr(at_ - static_cast<std::size_t>(count), static_cast<std::size_t>(count));
  }

  template <class Number>
  Number Take() {
    static_assert(__BYTE_ORDER__ == __ORDER_LITTLE_ENDIAN__);
    Number value;
    std::memcpy(&value, Take(sizeof value).data(), sizeof value);
    return value;
  }

  Bytes TakeText() { return Take(Take<std::uint32_t>()); }

 private:
  Bytes bytes_;
  std::size_t at_ = 0;
};

}  // namespace armcal::bags

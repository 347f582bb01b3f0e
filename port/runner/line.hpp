// runner - puts a line of text together without a library.
#pragma once

#include "port/runner/runner.hpp"

namespace armcal::port::runner {

// Line("filter").Text("forgetting").Decimal(60).Hex(0xC5).End() writes "filter forgetting 60 000000c5\n".
class Line {
 public:
  explicit Line(const char* first) { Append(first); }

  Line& Text(const char* word) {
    Append(" ");
    Append(word);
    return *this;
  }
  Line& Decimal(std::uint32_t value) {
    char digits[11];
    char* p = digits + 10;
    *p = '\0';
    do *--p = static_cast<char>('0' + value % 10u);
    while ((value /= 10u) != 0u);
    return Text(p);
  }
  Line& Decimal(int value) { return Decimal(static_cast<std::uint32_t>(value)); }  // not negative
  Line& Value(const char* name, std::uint32_t value) { return Text(name).Decimal(value); }
  Line& Hex(std::uint32_t value) {
    char digits[9] = {};
    for (int k = 0; k < 8; ++k) digits[k] = "0123456789abcdef"[(value >> (28 - 4 * k)) & 15u];
    return Text(digits);
  }
  void End() {
    Append("\n");
    Flush();
  }

 private:
  static constexpr int kCapacity = 256;

  void Append(const char* text) {
    for (; *text != '\0'; ++text) {
      if (length_ == kCapacity) Flush();
      text_[length_++] = *text;
    }
  }
  void Flush() {
    text_[length_] = '\0';
    Write(text_);
    length_ = 0;
  }

  char text_[kCapacity + 1];
  int length_ = 0;
};

}  // namespace armcal::port::runner

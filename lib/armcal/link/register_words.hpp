// link - puts values into the words of a block and takes them out, by the registers' declarations.
#pragma once

#include <cstdint>
#include <cstring>
#include <type_traits>

#include "armcal/core/words.hpp"
#include "armcal/link/registers.hpp"

namespace armcal::link {

// The C++ type of a register's value.
template <const Register& kRegister>
using ValueOf = std::conditional_t<kRegister.type == RegisterType::kU16, std::uint16_t,
                                   std::conditional_t<kRegister.type == RegisterType::kU32, std::uint32_t, float>>;

// The words of a block, or of one register, as they go over the wire. The drive and the client put values in and take
// them out by the register's declaration. A register of another block, or a value of another type, does not compile.
template <const auto& kBlock>
class Words {
 public:
  static constexpr Span span() { return SpanOf(kBlock); }
  static constexpr std::uint16_t size() { return span().count; }

  Words() = default;
  explicit Words(const std::uint16_t* from) { std::memcpy(words_, from, sizeof words_); }

  // T is the register's type. It may also be an enumeration or bool, whose number is then sent.
  template <const Register& kRegister, int kElement = 0, class T>
  void Set(T value) {
    static_assert(kElement >= 0 && kElement < kRegister.count, "the register has fewer elements");
    Put<kRegister>(kElement, value);
  }
  // The same for an element that the compiler does not know; it must be one of the register's.
  template <const Register& kRegister, class T>
  void Put(std::uint32_t element, T value) {
    using Value = ValueOf<kRegister>;
    static_assert(std::is_same_v<T, Value> || std::is_enum_v<T> || std::is_same_v<T, bool>, "a value of another type");
    std::uint16_t* w = words_ + OffsetOf<kRegister, 0>() + element * WordsOf(kRegister.type);
    if constexpr (kRegister.type == RegisterType::kU16) *w = static_cast<Value>(value);
    if constexpr (kRegister.type == RegisterType::kU32) core::PutU32(w, static_cast<Value>(value));
    if constexpr (kRegister.type == RegisterType::kF32) core::PutF32(w, value);
  }

  template <const Register& kRegister, int kElement = 0>
  ValueOf<kRegister> Get() const {
    static_assert(kElement >= 0 && kElement < kRegister.count, "the register has fewer elements");
    return At<kRegister>(kElement);
  }
  template <const Register& kRegister>
  ValueOf<kRegister> At(std::uint32_t element) const {
    const std::uint16_t* w = words_ + OffsetOf<kRegister, 0>() + element * WordsOf(kRegister.type);
    if constexpr (kRegister.type == RegisterType::kU16) return *w;
    if constexpr (kRegister.type == RegisterType::kU32) return core::GetU32(w);
    if constexpr (kRegister.type == RegisterType::kF32) return core::GetF32(w);
  }

  const std::uint16_t* data() const { return words_; }
  std::uint16_t* data() { return words_; }

 private:
  template <const Register& kRegister, int kElement>
  static constexpr int OffsetOf() {
    constexpr Span kOne = SpanOf(kRegister);
    static_assert(kOne.kind == span().kind && kOne.first >= span().first && kOne.end() <= span().end(),
                  "the register does not lie in this block");
    static_assert(kElement >= 0 && kElement < kRegister.count, "the register has fewer elements");
    return kOne.first - span().first + kElement * WordsOf(kRegister.type);
  }

  std::uint16_t words_[SpanOf(kBlock).count] = {};
};

}  // namespace armcal::link

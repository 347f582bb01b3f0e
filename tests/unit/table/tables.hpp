// table - tables whose words say which table they belong to.
#pragma once

#include <cstdint>
#include <vector>

namespace armcal::test {

using Words = std::vector<std::uint16_t>;

inline constexpr std::uint32_t kSchema = 0xABCD1234;
inline constexpr std::uint32_t kWords = 60;

inline Words Table(int number) {
  Words words(kWords);
  for (std::size_t i = 0; i < words.size(); ++i) words[i] = static_cast<std::uint16_t>(4001 * number + 257 * i);
  return words;
}

}  // namespace armcal::test

// client - puts a seal behind the words of a table.
#include "host_sim/client/table_seal.hpp"

#include <fmt/core.h>

#include <algorithm>

#include "armcal/core/words.hpp"
#include "armcal/link/seal.hpp"

namespace armcal::client {
namespace {

constexpr std::size_t kLayoutWord = 2, kJointsWord = 3;
constexpr std::uint16_t kUnsealedLayout = 1;
constexpr std::size_t kGateWordsOfJoint = 2;

}  // namespace

std::vector<std::uint16_t> SealTable(std::span<const std::uint16_t> words, std::uint32_t serial_number,
                                     std::uint32_t counter, const Key& key) {
  const std::uint16_t layout = words.size() > kJointsWord ? words[kLayoutWord] : std::uint16_t{0};
  if (layout != kUnsealedLayout && layout != link::kSealedLayout)
    throw io::InputError(fmt::format("table: layout version {}, expected 1 or 2 to sign it", layout));
  std::vector<std::uint16_t> sealed(words.begin(), words.end());
  if (layout == kUnsealedLayout) {
    sealed.resize(words.size() + kGateWordsOfJoint * words[kJointsWord] + link::kSealWords);
    sealed[kLayoutWord] = link::kSealedLayout;
  }
  const int count = static_cast<int>(sealed.size()), covered = count - link::kSignatureWords;
  link::PutSeal({serial_number, counter, link::SealMethod::kHmac}, sealed.data(), count);
  core::HmacSha256 hmac;
  hmac.Begin(key.data(), key.size());
  std::uint8_t bytes[core::Sha256::kDigestBytes];
  for (int k = 0; k < covered; ++k) {
    core::PutBytes16(bytes, sealed[static_cast<std::size_t>(k)]);
    hmac.Add(bytes, 2);
  }
  hmac.Finish(bytes);
  for (int k = 0; k < static_cast<int>(sizeof bytes) / 2; ++k)
    sealed[static_cast<std::size_t>(covered + k)] = core::GetBytes16(bytes + 2 * k);
  return sealed;
}

std::uint32_t SignedCounter(std::span<const std::uint16_t> words, const Key& key) {
  if (words.size() <= kJointsWord || words[kLayoutWord] != link::kSealedLayout) return 0;
  const link::Seal seal = link::GetSeal(words.data(), static_cast<int>(words.size()));
  if (seal.method != link::SealMethod::kHmac) return 0;
  const std::vector<std::uint16_t> sealed = SealTable(words, seal.serial_number, seal.counter, key);
  return std::equal(sealed.begin(), sealed.end(), words.begin(), words.end()) ? seal.counter : 0;
}

bool IsCredible(std::uint32_t counter, std::uint32_t proven) {
  constexpr std::uint32_t kUsual = 1'000'000;  // a table a minute takes two years
  constexpr std::uint32_t kTried = 1000;       // tables since the one in force was signed
  return counter <= kUsual || (counter >= proven && counter - proven <= kTried);
}

std::vector<std::uint16_t> UnsealTable(std::span<const std::uint16_t> words) {
  std::vector<std::uint16_t> bare(words.begin(), words.end());
  if (bare.size() >= link::kSealWords && bare[kLayoutWord] == link::kSealedLayout)
    link::PutSeal({}, bare.data(), static_cast<int>(bare.size()));
  return bare;
}

}  // namespace armcal::client

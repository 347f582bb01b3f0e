// link - the seal of a table: which drive it is for, its counter, and the signature; and the check of a seal in slices.
//
// The seal is the last 40 words of every table of layout version 2: serial number u32, counter u32, method u16, three
// words 0, signature [32]. The signature covers all words before it, high byte first. SPEC.md has the details.
#pragma once

#include <cstdint>

#include "armcal/core/sha256.hpp"
#include "armcal/core/status.hpp"
#include "armcal/core/words.hpp"

namespace armcal::link {

inline constexpr std::uint16_t kSealedLayout = 2;  // the first layout version that has a seal
inline constexpr int kSealWords = 40, kSignatureWords = 32;
inline constexpr int kSignatureBytes = 2 * kSignatureWords;
inline constexpr int kKeyBytes = 32;

enum class SealMethod : std::uint16_t {
  kNone = 0,
  kHmac = 1,  // HMAC-SHA256; its 32 bytes stand first in the signature, and zeros follow
  kOwn = 2,   // what the board's own function verifies
};

struct Seal {
  std::uint32_t serial_number = 0;
  std::uint32_t counter = 0;
  SealMethod method = SealMethod::kNone;
};

// words [count]: a table. A table without a seal has counter 0.
inline Seal GetSeal(const std::uint16_t* words, int count) {
  if (count < kSealWords || words[2] < kSealedLayout) return {};
  const std::uint16_t* w = words + count - kSealWords;
  return {core::GetU32(w), core::GetU32(w + 2), static_cast<SealMethod>(w[4])};
}
// Writes all of the seal but the signature, which is then 0.
inline void PutSeal(const Seal& seal, std::uint16_t* words, int count) {
  std::uint16_t* w = words + count - kSealWords;
  for (int k = 0; k < kSealWords; ++k) w[k] = 0;
  core::PutU32(w, seal.serial_number);
  core::PutU32(w + 2, seal.counter);
  w[4] = static_cast<std::uint16_t>(seal.method);
}

// Who may change the tables of a drive. Without a key and without a function, anyone who reaches the line.
struct Signing {
  const std::uint8_t* key = nullptr;  // [kKeyBytes], of this drive alone; it must stay where it is
  // In place of a key: says whether `signature` [kSignatureBytes] fits `digest`, the SHA-256 [32] of a table's words
  // before the signature. For example Ed25519, or a secure element. kOk; kBusy: call again; else it does not fit.
  core::Status (*verify)(void* context, const std::uint8_t* digest, const std::uint8_t* signature) = nullptr;
  void* context = nullptr;          // of verify
  std::uint32_t serial_number = 0;  // of the drive

  SealMethod method() const {
    return verify != nullptr ? SealMethod::kOwn : key != nullptr ? SealMethod::kHmac : SealMethod::kNone;
  }
  bool required() const { return method() != SealMethod::kNone; }
};

// Begin, then Step until it no longer answers kBusy. Context: background.
class SealCheck {
 public:
  // words [count] must not change until the end. counter: the highest one that was used.
  void Begin(const std::uint16_t* words, int count, const Signing& signing, std::uint32_t counter) {
    words_ = words;
    count_ = count;
    signing_ = &signing;
    counter_ = counter;
    hashed_ = 0;
    finished_ = false;
  }

  // One slice. kOk: the seal is good. kBadSignature: there is none, or it does not fit. kOtherDrive: for another serial
  // number. kReplayed: its counter is not above the highest one.
  core::Status Step() {
    if (count_ < kSealWords || words_[2] < kSealedLayout) return core::Status::kBadSignature;
    if (!finished_) {
      if (hashed_ < count_ - kSignatureWords) HashNext();
      else Finish();
      return core::Status::kBusy;
    }
    const Seal seal = GetSeal(words_, count_);
    if (seal.method != signing_->method()) return core::Status::kBadSignature;
    const core::Status fits = Compare();
    if (fits == core::Status::kBusy) return fits;
    if (!core::IsOk(fits)) return core::Status::kBadSignature;
    if (seal.serial_number != signing_->serial_number) return core::Status::kOtherDrive;
    return seal.counter > counter_ ? core::Status::kOk : core::Status::kReplayed;
  }

 private:
  static constexpr int kSlice = 64;  // words: two blocks of the hash; the end takes four

  bool by_code() const { return signing_->method() == SealMethod::kHmac; }

  void HashNext() {
    if (hashed_ == 0) {
      if (by_code()) hmac_.Begin(signing_->key, kKeyBytes);
      else hash_.Begin();
    }
    for (const int end = hashed_ + kSlice; hashed_ < end && hashed_ < count_ - kSignatureWords; ++hashed_) {
      std::uint8_t bytes[2];
      core::PutBytes16(bytes, words_[hashed_]);
      if (by_code()) hmac_.Add(bytes, sizeof bytes);
      else hash_.Add(bytes, sizeof bytes);
    }
  }

  void Finish() {
    for (std::uint8_t& byte : code_) byte = 0;
    if (by_code()) hmac_.Finish(code_);
    else hash_.Finish(code_);
    finished_ = true;
  }

  core::Status Compare() const {
    std::uint8_t signature[kSignatureBytes];
    for (int k = 0; k < kSignatureWords; ++k) core::PutBytes16(signature + 2 * k, words_[count_ - kSignatureWords + k]);
    if (signing_->method() == SealMethod::kOwn) return signing_->verify(signing_->context, code_, signature);
    return core::SameBytes(signature, code_, kSignatureBytes) ? core::Status::kOk : core::Status::kBadSignature;
  }

  const std::uint16_t* words_ = nullptr;
  const Signing* signing_ = nullptr;
  int count_ = 0, hashed_ = 0;
  bool finished_ = false;
  std::uint32_t counter_ = 0;
  core::HmacSha256 hmac_;
  core::Sha256 hash_;
  std::uint8_t code_[kSignatureBytes] = {};  // what the signature must be, or the digest
};

}  // namespace armcal::link

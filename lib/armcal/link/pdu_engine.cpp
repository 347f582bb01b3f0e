// link - checks a request by its function code and answers it.
#include "armcal/link/pdu_engine.hpp"

#include "armcal/core/words.hpp"

namespace armcal::link {

namespace {

using core::GetBytes16;
using core::PutBytes16;
using core::Status;

constexpr std::uint8_t kReadHolding = 3, kReadInput = 4, kWriteSingle = 6, kWriteMultiple = 16, kWriteThenRead = 23,
                       kEncapsulated = 43;
constexpr std::uint8_t kReadDeviceId = 14;
constexpr std::uint16_t kMaxRead = 125, kMaxWrite = 123, kMaxWriteThenRead = 121;
constexpr std::uint8_t kBasicStream = 1, kSpecificObject = 4,
                       kConformity = 0x81;  // basic objects, as a stream or one by one
constexpr std::uint8_t kObjects = 3;
constexpr std::size_t kMaxText = 60;

std::size_t LengthOf(const char* text) {
  std::size_t n = 0;
  while (n < kMaxText && text[n] != '\0') ++n;
  return n;
}

bool Writes(std::uint8_t function) {
  return function == kWriteSingle || function == kWriteMultiple || function == kWriteThenRead;
}

bool RangeWraps(std::uint16_t first, std::uint16_t count) {
  return static_cast<std::uint32_t>(first) + count > 0x10000u;
}

}  // namespace

std::size_t PduEngine::Refuse(std::uint8_t function, std::uint16_t address, Status status, std::uint8_t* reply) {
  if (status == Status::kUnfinished) {
    map_.UncountRequest();
    return kReplyLater;
  }
  map_.Refused(function, address, status);
  reply[0] = static_cast<std::uint8_t>(function | 0x80u);
  reply[1] = ExceptionOf(status);
  return 2;
}

std::size_t PduEngine::Handle(const std::uint8_t* request, std::size_t count, std::uint8_t* reply,
                              std::uint32_t session, Rights rights) {
  if (count == 0) return 0;
  map_.sessions().Ask(session);
  map_.CountRequest();
  if (rights == Rights::kRead && Writes(request[0])) {
    const std::size_t at = request[0] == kWriteThenRead ? 5 : 1;  // of the first register to be written
    return Refuse(request[0], count >= at + 2 ? GetBytes16(request + at) : std::uint16_t{0}, Status::kForbidden, reply);
  }
  switch (request[0]) {
    case kReadHolding:
      return ReadRegisters(RegisterKind::kHolding, request, count, reply);
    case kReadInput:
      return ReadRegisters(RegisterKind::kInput, request, count, reply);
    case kWriteSingle:
      return WriteOne(request, count, reply);
    case kWriteMultiple:
      return WriteMany(request, count, reply);
    case kWriteThenRead:
      return WriteThenRead(request, count, reply);
    case kEncapsulated:
      return Identify(request, count, reply);
    default:
      return Refuse(request[0], 0, Status::kBadFunction, reply);
  }
}

std::size_t PduEngine::ReadRegisters(RegisterKind kind, const std::uint8_t* request, std::size_t count,
                                     std::uint8_t* reply) {
  if (count != 5) return Refuse(request[0], 0, Status::kWrongSize, reply);
  const std::uint16_t first = GetBytes16(request + 1);
  const std::uint16_t quantity = GetBytes16(request + 3);
  if (quantity == 0 || quantity > kMaxRead) return Refuse(request[0], first, Status::kWrongSize, reply);
  if (RangeWraps(first, quantity)) return Refuse(request[0], first, Status::kBadAddress, reply);
  std::uint16_t words[kMaxRead];
  const Status status = map_.Read(kind, first, quantity, words);
  if (ExceptionOf(status) != 0) return Refuse(request[0], first, status, reply);
  reply[0] = request[0];
  reply[1] = static_cast<std::uint8_t>(2 * quantity);
  for (std::uint16_t i = 0; i < quantity; ++i) PutBytes16(reply + 2 + 2 * i, words[i]);
  return 2 + 2 * static_cast<std::size_t>(quantity);
}

std::size_t PduEngine::WriteOne(const std::uint8_t* request, std::size_t count, std::uint8_t* reply) {
  if (count != 5) return Refuse(request[0], 0, Status::kWrongSize, reply);
  const std::uint16_t address = GetBytes16(request + 1);
  const std::uint16_t word = GetBytes16(request + 3);
  const Status status = map_.Write(address, 1, &word);
  if (ExceptionOf(status) != 0) return Refuse(request[0], address, status, reply);
  for (int i = 0; i < 5; ++i) reply[i] = request[i];
  return 5;
}

std::size_t PduEngine::WriteMany(const std::uint8_t* request, std::size_t count, std::uint8_t* reply) {
  if (count < 6) return Refuse(request[0], 0, Status::kWrongSize, reply);
  const std::uint16_t first = GetBytes16(request + 1);
  const std::uint16_t quantity = GetBytes16(request + 3);
  if (quantity == 0 || quantity > kMaxWrite || request[5] != 2 * quantity || count != 6u + request[5])
    return Refuse(request[0], first, Status::kWrongSize, reply);
  if (RangeWraps(first, quantity)) return Refuse(request[0], first, Status::kBadAddress, reply);
  std::uint16_t words[kMaxWrite];
  for (std::uint16_t i = 0; i < quantity; ++i) words[i] = GetBytes16(request + 6 + 2 * i);
  const Status status = map_.Write(first, quantity, words);
  if (ExceptionOf(status) != 0) return Refuse(request[0], first, status, reply);
  for (int i = 0; i < 5; ++i) reply[i] = request[i];
  return 5;
}

// The write comes first. A range that does not exist, to write or to read, is found before anything is written.
std::size_t PduEngine::WriteThenRead(const std::uint8_t* request, std::size_t count, std::uint8_t* reply) {
  if (count < 10) return Refuse(request[0], 0, Status::kWrongSize, reply);
  const std::uint16_t from = GetBytes16(request + 1), wanted = GetBytes16(request + 3);
  const std::uint16_t first = GetBytes16(request + 5), quantity = GetBytes16(request + 7);
  if (wanted == 0 || wanted > kMaxRead) return Refuse(request[0], from, Status::kWrongSize, reply);
  if (quantity == 0 || quantity > kMaxWriteThenRead || request[9] != 2 * quantity || count != 10u + request[9])
    return Refuse(request[0], first, Status::kWrongSize, reply);
  if (RangeWraps(from, wanted) || !map_.Has(RegisterKind::kHolding, from, wanted))
    return Refuse(request[0], from, Status::kBadAddress, reply);
  if (RangeWraps(first, quantity)) return Refuse(request[0], first, Status::kBadAddress, reply);
  std::uint16_t words[kMaxRead];
  for (std::uint16_t i = 0; i < quantity; ++i) words[i] = GetBytes16(request + 10 + 2 * i);
  Status status = map_.Write(first, quantity, words);
  if (ExceptionOf(status) != 0) return Refuse(request[0], first, status, reply);
  status = map_.Read(RegisterKind::kHolding, from, wanted, words);
  if (ExceptionOf(status) != 0) return Refuse(request[0], from, status, reply);
  reply[0] = request[0];
  reply[1] = static_cast<std::uint8_t>(2 * wanted);
  for (std::uint16_t i = 0; i < wanted; ++i) PutBytes16(reply + 2 + 2 * i, words[i]);
  return 2 + 2 * static_cast<std::size_t>(wanted);
}

// Read Device Identification. There are basic objects only, so "regular" and "extended" are answered with these.
std::size_t PduEngine::Identify(const std::uint8_t* request, std::size_t count, std::uint8_t* reply) {
  if (count >= 2 && request[1] != kReadDeviceId) return Refuse(request[0], 0, Status::kBadFunction, reply);
  if (count != 4) return Refuse(request[0], 0, Status::kWrongSize, reply);
  const std::uint8_t code = request[2];
  const std::uint8_t object = request[3];
  if (code < kBasicStream || code > kSpecificObject) return Refuse(request[0], object, Status::kOutOfRange, reply);
  if (code == kSpecificObject && object >= kObjects) return Refuse(request[0], object, Status::kBadAddress, reply);

  const char* const text[kObjects] = {identification_.vendor, identification_.product, identification_.revision};
  const std::uint8_t from =
      object < kObjects ? object : 0;  // a stream that shall start at an unknown object starts at the first one
  const std::uint8_t to = code == kSpecificObject ? static_cast<std::uint8_t>(from + 1) : kObjects;
  reply[0] = request[0];
  reply[1] = kReadDeviceId;
  reply[2] = code;
  reply[3] = kConformity;
  reply[4] = 0;  // nothing more follows
  reply[5] = 0;
  reply[6] = static_cast<std::uint8_t>(to - from);
  std::size_t at = 7;
  for (std::uint8_t id = from; id < to; ++id) {
    const std::size_t length = LengthOf(text[id]);
    reply[at++] = id;
    reply[at++] = static_cast<std::uint8_t>(length);
    for (std::size_t i = 0; i < length; ++i) reply[at++] = static_cast<std::uint8_t>(text[id][i]);
  }
  return at;
}

}  // namespace armcal::link

// link - one Modbus request in, one reply out, whatever the transport.
#pragma once

#include <cstddef>
#include <cstdint>

#include "armcal/link/register_map.hpp"

namespace armcal::link {

inline constexpr std::size_t kMaxPdu = 253;
// Instead of a reply's length: the answer takes more slices of the background.
inline constexpr std::size_t kReplyLater = ~std::size_t{0};

// Texts of function 43/14. Each has at most 60 characters, so that one reply holds them all.
struct DeviceIdentification {
  const char* vendor;
  const char* product;
  const char* revision;
};

// What a connection may do. kRead: reading functions alone; the others are refused with kForbidden.
enum class Rights : std::uint8_t { kReadWrite, kRead };

// Serves functions 3, 4, 6, 16, 23 and 43/14. It checks the whole request before it applies anything; only a block that
// refuses the read of function 23 does so after the write. Order of the checks, with the Modbus exception: rights of
// the connection (04), function (01), quantity and byte count (03), address (02), read-only (04), values (03), then
// what the block itself refuses (02, 03, 04 or 06). Reference: MODBUS Application Protocol Specification V1.1b3,
// section 6. Context: background.
class PduEngine {
 public:
  PduEngine(RegisterMap& map, const DeviceIdentification& identification)
      : map_(map), identification_(identification) {}

  // `request` [count], `reply` [kMaxPdu]. `session`: whose request it is. Returns the reply's length. An empty request
  // has no answer: 0. kReplyLater: serve others, and call it again with the same request, session and rights in the
  // next turn of the background; it counts as one request.
  std::size_t Handle(const std::uint8_t* request, std::size_t count, std::uint8_t* reply, std::uint32_t session = 0,
                     Rights rights = Rights::kReadWrite);

  Sessions& sessions() { return map_.sessions(); }

 private:
  std::size_t Refuse(std::uint8_t function, std::uint16_t address, core::Status status, std::uint8_t* reply);
  std::size_t ReadRegisters(RegisterKind kind, const std::uint8_t* request, std::size_t count, std::uint8_t* reply);
  std::size_t WriteOne(const std::uint8_t* request, std::size_t count, std::uint8_t* reply);
  std::size_t WriteMany(const std::uint8_t* request, std::size_t count, std::uint8_t* reply);
  std::size_t WriteThenRead(const std::uint8_t* request, std::size_t count, std::uint8_t* reply);
  std::size_t Identify(const std::uint8_t* request, std::size_t count, std::uint8_t* reply);

  RegisterMap& map_;
  DeviceIdentification identification_;
};

}  // namespace armcal::link

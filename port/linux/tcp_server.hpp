// port_linux - a few TCP connections for a request-reply service; knows no protocol.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "armcal/core/status.hpp"
#include "armcal/hardware/clock.hpp"

namespace armcal::port_linux {

// What is served. `receive` takes at most one request out of `bytes` (`used` tells how many it took), puts the reply
// into `reply` [max_reply], and answers false when the connection should be closed.
struct ByteService {
  void* context;
  std::size_t max_reply;
  void (*open)(void* context, int slot);
  bool (*receive)(void* context, int slot, const std::uint8_t* bytes, std::size_t count, std::size_t* used,
                  std::uint8_t* reply, std::size_t* reply_bytes);
  bool (*mid_frame)(void* context, int slot);
};

struct TcpLimits {
  std::uint32_t idle_ms = 60000;          // a connection without any byte is closed; 0: never
  std::uint32_t partial_frame_ms = 2000;  // so is one whose frame began so long ago
};

// Fixed slots, one thread, nothing waits for a client: one that does not read is not read from either. A connection
// beyond the slots is accepted and closed. Every call: background context.
class TcpServer {
 public:
  static constexpr int kSlots = 4;

  TcpServer(const ByteService& service, const hardware::Clock& clock, const TcpLimits& limits = {});
  ~TcpServer();
  TcpServer(const TcpServer&) = delete;
  TcpServer& operator=(const TcpServer&) = delete;

  // `address`: IPv4 in digits; `port` 0: any free one, see port(). kBusy: port in use; kOutOfRange: not an address;
  // kBadAddress: cannot be bound. error() says it in words.
  core::Status Listen(const std::string& address, std::uint16_t port);

  // Waits for something to do, at most `timeout_ms`, and does it. kWrongOrder: not listening.
  core::Status Poll(int timeout_ms);

  std::uint16_t port() const { return port_; }
  int connections() const;
  const std::string& error() const { return error_; }

 private:
  struct Slot {
    int socket = -1;
    std::vector<std::uint8_t> in, out;  // received and not yet taken; replied and not yet sent
    std::uint32_t active_ms = 0;        // the last byte in either direction
    std::uint32_t frame_ms = 0;         // when the frame began that is incomplete
    bool mid_frame = false;
    bool leaving = false;  // the client will send no more
  };

  core::Status Fail(core::Status status, const std::string& what);
  void Accept();
  void Serve(int slot);
  void Receive(Slot& slot);
  bool Answer(int index);
  bool Send(Slot& slot);
  void Close(Slot& slot);
  void CloseLate(Slot& slot);

  ByteService service_;
  hardware::Clock clock_;
  TcpLimits limits_;
  int listener_ = -1;
  std::uint16_t port_ = 0;
  std::string error_;
  Slot slots_[kSlots];
};

}  // namespace armcal::port_linux

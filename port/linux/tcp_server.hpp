// port_linux - a few TCP connections for a service that answers requests.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "armcal/core/status.hpp"
#include "armcal/hardware/clock.hpp"

namespace armcal::port_linux {

// The service. `receive` takes at most one request out of `bytes`, says in `used` how many bytes it took, and puts the
// reply into `reply` [max_reply]. It answers false if the connection should be closed. `close`: the slot's connection
// is gone. `keep`: the slot's connection should not make room for another one. `asked`: the answer to the slot's last
// request is not ready; `receive` is then called in every Poll, with no bytes if there are none.
struct ByteService {
  void* context;
  std::size_t max_reply;
  void (*open)(void* context, int slot);
  bool (*receive)(void* context, int slot, const std::uint8_t* bytes, std::size_t count, std::size_t* used,
                  std::uint8_t* reply, std::size_t* reply_bytes);
  bool (*mid_frame)(void* context, int slot);
  void (*close)(void* context, int slot) = nullptr;
  bool (*keep)(void* context, int slot) = nullptr;
  bool (*asked)(void* context, int slot) = nullptr;
};

struct TcpLimits {
  std::uint32_t idle_ms = 60000;          // a connection without any byte is closed; 0: never
  std::uint32_t partial_frame_ms = 2000;  // and one whose frame is not complete after this time
  std::uint32_t unused_ms = 10000;        // one without a byte for so long makes room for the next of its address
  int slots = 16;                         // connections at once; 1 to TcpServer::kSlots
};

// It has fixed slots and one thread, and it never waits for a client. From a client that does not read its replies it
// reads no requests. In each turn a connection gets one request answered, so one that floods does not hold up the
// others. While slots are free, any address gets one. When all are taken, one is kept for an address that
// has none: the address with the most connections then loses the one that has been silent longest. An address that has
// some may replace an unused one of its own. A connection that the service keeps is never closed for another one. A
// connection for which there is no slot is accepted and closed. Context of every call: background.
class TcpServer {
 public:
  static constexpr int kSlots = 16;

  TcpServer(const ByteService& service, const hardware::Clock& clock, const TcpLimits& limits = {});
  ~TcpServer();
  TcpServer(const TcpServer&) = delete;
  TcpServer& operator=(const TcpServer&) = delete;

  // `address`: IPv4 in digits. `port` 0: any free port, see port(). kBusy: the port is in use. kOutOfRange: not an
  // address. kBadAddress: it cannot be bound. error() says it in words.
  core::Status Listen(const std::string& address, std::uint16_t port);

  // Waits for something to do, at most `timeout_ms`, and does it. kWrongOrder: it does not listen.
  core::Status Poll(int timeout_ms);

  std::uint16_t port() const { return port_; }
  int connections() const;
  const std::string& error() const { return error_; }

 private:
  struct Slot {
    int socket = -1;
    std::uint32_t address = 0;          // the client's
    std::vector<std::uint8_t> in, out;  // bytes received and not yet taken; bytes of replies not yet sent
    std::uint32_t active_ms = 0;        // time of the last byte in either direction
    std::uint32_t frame_ms = 0;         // time when the incomplete frame began
    bool mid_frame = false;
    bool leaving = false;  // the client will send no more
  };

  core::Status Fail(core::Status status, const std::string& what);
  bool Accept();
  int FreeSlot(std::uint32_t address);
  int MakeRoom(std::uint32_t address);
  void Serve(int slot);
  void Receive(Slot& slot);
  bool Asked(int index) const { return service_.asked != nullptr && service_.asked(service_.context, index); }
  // There is something to do that the socket does not tell.
  bool Waits(int index) const { return Asked(index) || (slots_[index].out.empty() && !slots_[index].in.empty()); }
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

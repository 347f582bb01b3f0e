// end-to-end tests - a Modbus master on raw bytes, written from the public rules alone. It shares nothing with armcal.
//
// The rules: MODBUS Application Protocol V1.1b3, MODBUS Messaging on TCP/IP Implementation Guide V1.0b, MODBUS over
// Serial Line V1.02.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

namespace armcal::tests::modbus {

using Bytes = std::vector<std::uint8_t>;

std::string Hex(const Bytes& bytes);
// Joins bytes and 16-bit numbers, which go high byte first.
Bytes Join(const Bytes& front, const std::vector<int>& words);
Bytes Joined(Bytes a, const Bytes& b);
std::uint16_t WordAt(const Bytes& bytes, std::size_t at);

Bytes ReadHolding(int first, int quantity);
Bytes ReadInput(int first, int quantity);
Bytes WriteOne(int address, int value);
Bytes WriteMany(int first, const std::vector<int>& words);
Bytes WriteThenRead(int read_first, int read_quantity, int write_first, const std::vector<int>& words);
Bytes Identify(int code, int object);

// One master and its line.
class Line {
 public:
  virtual ~Line() = default;
  // Sends one request and waits for its reply. Returns the reply without its frame; empty: there was none.
  virtual Bytes Ask(const Bytes& pdu) = 0;
  // True if the end of a frame is seen from its content, so that it can also be too short or too long.
  virtual bool ends_by_itself() const = 0;
};

// A TCP connection from 127.0.0.`from`.
class TcpLine : public Line {
 public:
  explicit TcpLine(int port, int from = 1);
  ~TcpLine() override;
  TcpLine(const TcpLine&) = delete;

  Bytes Ask(const Bytes& pdu) override;
  bool ends_by_itself() const override { return true; }

  static Bytes Frame(int transaction, int unit, const Bytes& pdu, int protocol = 0);
  // False: the drive does not take them all within a tenth of a second, or the connection has ended.
  bool Send(const Bytes& bytes);
  // One whole frame, header included; empty: there is none within `wait_ms`.
  Bytes Receive(int wait_ms = 3000);
  void EndSending();
  bool connected() const { return connected_; }

 private:
  int socket_, transaction_ = 0x0100;
  bool connected_ = false;
  Bytes there_;
};

// A serial line. `silence_ms`: the pause that ends a frame, as the drive states it.
class RtuLine : public Line {
 public:
  RtuLine(int terminal, int silence_ms) : terminal_(terminal), silence_ms_(silence_ms) {}

  Bytes Ask(const Bytes& pdu) override;
  bool ends_by_itself() const override { return false; }

  static Bytes Frame(int address, const Bytes& pdu);
  void Send(const Bytes& bytes);
  // The bytes of one reply; empty: there is none within `wait_ms`. A reply ends with a pause.
  Bytes Receive(int wait_ms = 3000);
  // Lets the line rest longer than the pause that ends a frame.
  void Rest() const;
  int silence_ms() const { return silence_ms_; }

 private:
  int terminal_, silence_ms_;
};

}  // namespace armcal::tests::modbus

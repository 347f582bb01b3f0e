// template - the two rings of a serial line.
#include "port/template/serial.hpp"

#include "armcal/core/sample_ring.hpp"

namespace armcal::port::target {
namespace {

// The longest Modbus RTU frame has 256 bytes.
core::SampleRing<std::uint8_t, 256> received;
core::SampleRing<std::uint8_t, 256> to_send;

std::size_t Read(void*, std::uint8_t* bytes, std::size_t capacity) {
  std::size_t count = 0;
  while (count < capacity && core::IsOk(received.Pop(bytes[count]))) ++count;
  return count;
}

std::size_t Write(void*, const std::uint8_t* bytes, std::size_t count) {
  std::size_t taken = 0;
  while (taken < count && core::IsOk(to_send.Push(bytes[taken]))) ++taken;
  // Here your driver enables the transmit interrupt.
  return taken;
}

}  // namespace

hardware::Serial TargetSerial() { return {nullptr, Read, Write}; }

void OnReceived(std::uint8_t byte) {
  (void)received.Push(byte);  // a full ring refuses the byte, and the checksum of the frame fails
}

bool NextToSend(std::uint8_t& byte) { return core::IsOk(to_send.Pop(byte)); }

}  // namespace armcal::port::target

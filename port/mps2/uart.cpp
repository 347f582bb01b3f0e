// mps2 - the registers of the CMSDK UART, and what its interrupt does.
#include "port/mps2/uart.hpp"

#include "armcal/core/sample_ring.hpp"

namespace armcal::port::mps2 {
namespace {

constexpr std::uint32_t kUart1 = 0x40005000;
constexpr std::uint32_t kPeripheral_Hz = 25000000;
constexpr std::uint32_t kUart1ReceiveIrq = 2;
constexpr std::uint32_t kInterruptEnable = 0xE000E100;

struct Registers {
  std::uint32_t data;
  std::uint32_t state;      // 1 transmitter full, 2 receiver full
  std::uint32_t control;    // 1 transmit, 2 receive, 8 receive interrupt
  std::uint32_t interrupt;  // write 2: receive interrupt taken
  std::uint32_t baud_divider;
};
volatile Registers& Uart() { return *reinterpret_cast<volatile Registers*>(kUart1); }

core::SampleRing<std::uint8_t, 256> received;

std::size_t Read(void*, std::uint8_t* bytes, std::size_t capacity) {
  std::size_t count = 0;
  while (count < capacity && core::IsOk(received.Pop(bytes[count]))) ++count;
  return count;
}

std::size_t Write(void*, const std::uint8_t* bytes, std::size_t count) {
  std::size_t sent = 0;
  while (sent < count && (Uart().state & 1u) == 0) Uart().data = bytes[sent++];
  return sent;
}

}  // namespace

void StartUart1(std::uint32_t baud) {
  Uart().baud_divider = kPeripheral_Hz / baud;
  Uart().control = 1u | 2u | 8u;
  *reinterpret_cast<volatile std::uint32_t*>(kInterruptEnable) = 1u << kUart1ReceiveIrq;
}

hardware::Serial Uart1() { return {nullptr, Read, Write}; }

void OnUart1() {
  Uart().interrupt = 2u;  // first: a byte that comes while bytes are taken must raise the interrupt again
  while ((Uart().state & 2u) != 0) {
    // A full ring refuses the byte and counts it. The checksum of the frame will fail.
    (void)received.Push(static_cast<std::uint8_t>(Uart().data));
  }
}

}  // namespace armcal::port::mps2

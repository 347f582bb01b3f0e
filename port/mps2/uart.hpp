// mps2 - UART1 (CMSDK) as the serial line.
#pragma once

#include <cstdint>

#include "armcal/hardware/serial.hpp"

namespace armcal::port::mps2 {

// Switches the UART on: 8 data bits, no parity, one stop bit, receive interrupt. Call once, before Uart1().
void StartUart1(std::uint32_t baud);

// Received bytes come out of a ring of 256 that the interrupt fills. A byte that finds it full is lost, and its frame
// with it. Written bytes go out as long as the transmitter takes them.
hardware::Serial Uart1();

// SerialInterrupt calls this. It puts received bytes into the ring.
void OnUart1();

}  // namespace armcal::port::mps2

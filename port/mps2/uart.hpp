// mps2 - UART1 (CMSDK) as the port's serial line; knows no frame.
#pragma once

#include <cstdint>

#include "armcal/hardware/serial.hpp"

namespace armcal::port::mps2 {

// Switches the UART on: 8 data bits, no parity, one stop bit, receive interrupt. Call once, before Uart1().
void StartUart1(std::uint32_t baud);

// Received bytes come out of the ring that the interrupt fills (256; a byte that finds it full is lost, and the frame
// with it). Written bytes go out as long as the transmitter takes them.
hardware::Serial Uart1();

// What SerialInterrupt has to do: received bytes into the ring.
void OnUart1();

}  // namespace armcal::port::mps2

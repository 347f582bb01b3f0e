// template - a serial line for a new target: two rings between its interrupts and the background.
#pragma once

#include <cstdint>

#include "armcal/hardware/serial.hpp"

namespace armcal::port::target {

hardware::Serial TargetSerial();

// Your receive interrupt calls this with every byte. A byte that finds the ring full is lost, and its frame with it.
void OnReceived(std::uint8_t byte);

// Your transmit interrupt calls this for the next byte to send. False: nothing to send; disable the interrupt until
// TargetSerial().Write has been called again.
bool NextToSend(std::uint8_t& byte);

}  // namespace armcal::port::target

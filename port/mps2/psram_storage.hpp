// mps2 - storage in the board's PSRAM, with the rules of NOR flash.
#pragma once

#include "armcal/hardware/storage.hpp"

namespace armcal::port::mps2 {

// 8 sectors of 4 KB, program unit 8 bytes, erased to 0xFF. Programming can only clear bits. QEMU may back the memory
// with a file; then its content survives a power cycle. If the tick lies in RAM, reading the code's flash during an
// erase is a fault: see flash_guard.hpp.
hardware::Storage PsramStorage();

// The same as two sectors of 128 KB, which take 2 s to erase. Erase answers kBusy meanwhile, and the code's flash may
// be read.
hardware::Storage SlowPsramStorage();

}  // namespace armcal::port::mps2

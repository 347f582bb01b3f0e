// mps2 - storage in the board's PSRAM under the rules of NOR flash; knows no record.
#pragma once

#include "armcal/hardware/storage.hpp"

namespace armcal::port::mps2 {

// 8 sectors of 4 KB, program unit 8 bytes, erased to 0xFF; programming can only clear bits. Under QEMU the memory may
// be backed by a file, and then outlives the power.
hardware::Storage PsramStorage();

}  // namespace armcal::port::mps2

// template - storage for a new target. It lies in RAM until you put your flash driver here.
#pragma once

#include "armcal/hardware/storage.hpp"

namespace armcal::port::target {

// It keeps the rules of flash: programming clears bits, and a unit is written once after each erase. It does not keep
// the content: a saved table is gone at power-off. Give the geometry of your flash, and call its driver in the three
// functions.
hardware::Storage TargetStorage();

}  // namespace armcal::port::target

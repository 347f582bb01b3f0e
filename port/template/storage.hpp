// template - storage for a new target, in RAM until its flash driver is there; knows no record.
#pragma once

#include "armcal/hardware/storage.hpp"

namespace armcal::port::target {

// Keeps the rules of flash (programming clears bits, a unit is written once per erase), but not the content: a table
// saved here is gone at power-off. Give your flash's geometry, and put its driver behind the three functions.
hardware::Storage TargetStorage();

}  // namespace armcal::port::target

// calibration - a log whose motion is read later than its torque; knows no method.
#pragma once

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::calibration {

// The same log with position, speed and acceleration of delay_s before each torque sample (cubic between samples, held
// at the ends): what a torque that is read late belongs to. A row stays in use if those that its motion is read between
// are.
Dataset Delayed(const Dataset& data, double delay_s);

}  // namespace armcal::calibration

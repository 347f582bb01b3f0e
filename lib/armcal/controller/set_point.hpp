// controller - where the axes shall be; knows no model.
#pragma once

namespace armcal::controller {

// Shapes: [n], rad (m), rad/s, rad/s^2.
template <int n>
struct SetPoint {
  float q[n], qd[n], qdd[n];
};

}  // namespace armcal::controller

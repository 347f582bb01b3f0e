// excitation tests - the arms that the tests move, and a published trajectory for one of them.
#pragma once

#include <string>

#include "host_sim/identify/excitation/series.hpp"

namespace armcal::excitation::test {

inline codegen::Model Arm(const codegen::Robot& robot) { return {robot, codegen::ReadCatalogue("codegen/effects")}; }
inline codegen::Robot RobotFile(const std::string& name) {
  return codegen::ReadRobot("codegen/robots/" + name + ".toml");
}

// A series that an independent search (another program, another language) found for er20_like without rotor inertias:
// cond(K) 4.37, torque peaks 311, 821, 301, 52, 33, 26 N m. Rows: joints; columns: a1..a5, b1..b5, q0.
inline Series PublishedSeries() {
  Eigen::Matrix<double, 6, 11> table;
  table << .655, 1.2176, -1.162, -.5455, .1168, .5204, -.1068, .4684, .0626, .2121, .1936, .6824, -.077, .6858, .3654,
      .4961, -.134, .1214, -.77, .2483, .149, -.3028, -.2999, -.7212, -.3128, .0754, -.565, -.7187, 1.2358, -.4499,
      -.0171, .1861, 1.0866, .591, .8689, 1.1264, .1469, 1.0624, .5263, -.1195, .4529, -.1367, -1.0026, .4296, -.6593,
      -.6565, .272, .3291, -1.1569, .2791, .7268, -.151, -.0649, -1.1331, -.1874, -.9344, .3225, -.6211, .9135, .3856,
      -.9368, -.3979, .4089, -.5671, .3119, .084;
  return {Family::kFourier, 10, table.transpose()};
}

inline Eigen::VectorXd OnePeriod(int samples) {
  return Eigen::VectorXd::LinSpaced(samples, 0, 10.0 * (samples - 1) / samples);
}

}  // namespace armcal::excitation::test

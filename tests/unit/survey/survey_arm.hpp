// survey tests - the arm, its records, and two trajectories. The trajectories are test data, not results.
#pragma once

#include "host_sim/study/survey/draws.hpp"

namespace armcal::survey::test {

inline const codegen::Robot& File() {
  static const codegen::Robot robot = codegen::ReadRobot("codegen/robots/er20_like.toml");
  return robot;
}
inline const codegen::Catalogue& AllRecords() {
  static const codegen::Catalogue records = Records(codegen::ReadCatalogue("codegen/effects"));
  return records;
}
inline codegen::Model Arm(Law law, Bodies bodies) {
  return {Variant(File(), law, bodies, SetStribeck(File().joints())), AllRecords()};
}
inline Levels LevelFile() { return ReadLevels("host_sim/study/survey/levels.toml"); }

// Found by another program in another language: cond(K) 4.37 with 48 columns, 4.40 with 60. Rows: joints; columns:
// a1..a5, b1..b5, q0.
inline excitation::Series StudyLinear() {
  Eigen::Matrix<double, 6, 11> t;
  t << .655, 1.2176, -1.162, -.5455, .1168, .5204, -.1068, .4684, .0626, .2121, .1936,      //
      .6824, -.077, .6858, .3654, .4961, -.134, .1214, -.77, .2483, .149, -.3028,           //
      -.2999, -.7212, -.3128, .0754, -.565, -.7187, 1.2358, -.4499, -.0171, .1861, 1.0866,  //
      .591, .8689, 1.1264, .1469, 1.0624, .5263, -.1195, .4529, -.1367, -1.0026, .4296,     //
      -.6593, -.6565, .272, .3291, -1.1569, .2791, .7268, -.151, -.0649, -1.1331, -.1874,   //
      -.9344, .3225, -.6211, .9135, .3856, -.9368, -.3979, .4089, -.5671, .3119, .084;
  return {excitation::Family::kFourier, 10, t.transpose()};
}
inline excitation::Series StudyNonlinear() {
  Eigen::Matrix<double, 6, 11> t;
  t << -.1871, .092, .3363, -.6384, .1317, .9081, -.7403, .0053, .5256, .0636, -.0278,       //
      -.607, .1389, .5022, -.0245, .6468, -.5639, .1132, -.8072, -.2398, .1626, -.1759,      //
      .0074, .4808, -.5612, -.1063, -.2627, -.6553, -.525, -.4661, -1.2593, -.101, .4958,    //
      .8122, .4889, -1.0284, -1.1417, -.9527, .1744, -.0997, -.2325, .7208, 1.1924, -.1888,  //
      -.2706, -.4792, .9947, .8888, -2.1211, .0648, -.5849, .9188, -.4388, .5963, -.2376,    //
      -1.0473, -.6329, -.0078, .0024, .1857, -1.3826, .4286, -.1152, -1.2332, -.4655, -.0389;
  return {excitation::Family::kFourier, 10, t.transpose()};
}

}  // namespace armcal::survey::test

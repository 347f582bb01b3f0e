// generator - the hardest values that any table of a model may hold, from the robot's limits, its prior and [ceilings].
#pragma once

#include <vector>

#include "codegen/src/generator/model.hpp"

namespace armcal::codegen {

// The numbers of model/ceilings.hpp, in its order.
struct Ceilings {
  struct OfJoint {
    double torque_Nm, friction_Nm, feed_Nm, scale_low, scale_high, sigma_low_Nm, sigma_high_Nm, v_min_low_radps,
        v_min_high_radps, speed_radps, position_low_rad, position_high_rad;
  };
  struct OfParameter {
    double low, high, sd, process_noise;
  };
  double least_fade_ms, longest_fade_ms, least_forgetting, coldest_degC, warmest_degC;
  std::vector<OfJoint> joint;
  std::vector<OfParameter> parameter;  // one for each entry of the table
  std::vector<bool> friction;          // front columns that brake their own joint; zero while it stands
  unsigned friction_reads = 0;         // bits of model/friction_grid.hpp
};

// Throws io::InputError: [ceilings] names no parameter of the model, or the model's own table lies beyond them.
Ceilings MakeCeilings(const Model& model);

}  // namespace armcal::codegen

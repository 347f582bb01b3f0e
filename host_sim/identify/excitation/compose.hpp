// excitation - the whole trajectory: blend in, periods of a series, slow moves, back to the first pose. Knows no
// search.
#pragma once

#include <string>
#include <vector>

#include "host_sim/data/trajectory/trajectory.hpp"
#include "host_sim/identify/excitation/peaks.hpp"
#include "host_sim/identify/excitation/series.hpp"

namespace armcal::excitation {

struct ComposeSettings {
  int periods = 4;
  int slow_speeds = 6;  // cells of constant speed in the slow part; 0: no slow part
  double step_s = 0.004;
  double margin = 0.05;  // of every limit, kept free
};

struct Section {
  std::string name;
  double begin_s = 0, end_s = 0;
};

struct Composed {
  trajectory::Trajectory trajectory;
  std::vector<Section> sections;
  std::vector<JointPeaks> peaks;  // of the spline through the trajectory, on the check grid
};

// Starts and ends at rest in the same pose, so that it may be repeated. The series is entered where it is slowest.
// InputError: no blend or slow part within the limits.
Composed Compose(const Observation& observation, const Series& series, const ComposeSettings& settings);

}  // namespace armcal::excitation

// report - writes charts that a reader can zoom and read values from; without JavaScript they are pictures.
#pragma once

#include <string>
#include <vector>

#include "host_sim/data/report/plot.hpp"

namespace armcal::report {

// One chart. Its series are lines over the same x.
struct Panel {
  std::string name;  // what the button says that shows and hides it
  Plot plot{};
  bool shown = true;
};

// Charts over one horizontal axis: they zoom together.
struct Live {
  std::vector<Panel> panels;
  // What a reader may look at instead: the first series minus each other one. Empty: this is not offered.
  std::string difference{};
};

inline constexpr std::size_t kLiveRows = 24000;  // about, of all panels together; 30 bytes each

// Pictures, and the data of the charts beside them if dygraphs was there when armcal was built.
// std::invalid_argument: series of one panel that differ in x.
std::string Html(const Live& live);

// What a page with live charts holds once, at its end: the library with its licence, and armcal's own script. Empty if
// dygraphs was not there.
std::string LiveScripts();

}  // namespace armcal::report

// report - one picture as a file of its own, for documents; knows no robot.
#pragma once

#include <string>
#include <string_view>

namespace armcal::report {

// What Svg() of a plot or of bars returns, as a complete SVG file: light ground, no variables, so that any viewer shows
// it. The same picture gives the same bytes.
std::string SvgFile(std::string_view svg);

}  // namespace armcal::report

// report - gives the colours and line styles of pictures, and makes a file of one picture.
#pragma once

#include <string>
#include <string_view>

namespace armcal::report {

// Values of the style's variables on light ground. Colours after Okabe and Ito: told apart by colour-blind readers.
inline constexpr std::string_view kLight =
    "--ink:#1b1f24;--soft:#59636e;--rule:#d5dae0;--faint:#eef1f4;--ground:#fff;"
    "--c0:#0072b2;--c1:#d55e00;--c2:#009e73;--c3:#cc79a7;--c4:#7a4a00;--c5:#3a9bdc;--c6:#555;--good:#009e73;--warn:#"
    "d55e00";

// Rules for what a canvas draws, in terms of the variables.
std::string PictureStyle();

// What Svg() of a plot or of bars returns, as a complete SVG file: light ground, no variables, so that any viewer shows
// it. The same picture gives the same bytes.
std::string SvgFile(std::string_view svg);

}  // namespace armcal::report

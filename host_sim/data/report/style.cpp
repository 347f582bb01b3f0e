// report - writes the style of pictures: as variables for a page, as plain colours for a file.
#include "host_sim/data/report/style.hpp"

#include <fmt/format.h>

#include "host_sim/data/report/canvas.hpp"

namespace armcal::report {

namespace {

constexpr std::string_view kRules =
    R"css(svg .title{font-size:13.5px;font-weight:600;fill:var(--ink)}svg .tick{fill:var(--soft)}svg .label{fill:var(--soft)}svg .number{fill:var(--soft);font-size:9.5px}
svg .grid{stroke:var(--rule);stroke-width:.6;fill:none}svg .zero{stroke:var(--soft);stroke-width:.8;fill:none}
svg .axis{stroke:var(--soft);stroke-width:1;fill:none}svg .shade{fill:var(--soft);fill-opacity:.14}
svg .line{fill:none;stroke-width:1.3;stroke-linejoin:round}svg .swatch{stroke-width:3}svg .dash{stroke-dasharray:5 3}
svg .dots{fill:none;stroke-width:3.4;stroke-linecap:round;stroke-opacity:.55}
)css";

// "--ink:#1b1f24;..." -> the value of "ink".
std::string_view Light(std::string_view name) {
  const std::size_t begin = kLight.find(fmt::format("--{}:", name)) + name.size() + 3;
  return kLight.substr(begin, kLight.find(';', begin) - begin);
}

std::string WithoutVariables(std::string style) {
  constexpr std::string_view kOpen = "var(--";
  for (std::size_t at = 0; (at = style.find(kOpen, at)) != std::string::npos;) {
    const std::size_t end = style.find(')', at), name = at + kOpen.size();
    style.replace(at, end + 1 - at, Light(std::string_view(style).substr(name, end - name)));
  }
  return style;
}

}  // namespace

std::string PictureStyle() {
  std::string style(kRules);
  for (int k = 0; k < kColours; ++k)
    style += fmt::format("svg .s{0}{{stroke:var(--c{0})}}svg .f{0}{{fill:var(--c{0})}}\n", k);
  return style;
}

std::string SvgFile(std::string_view svg) {
  constexpr std::string_view kTag = "<svg ";
  const std::size_t inside = svg.find('>') + 1;
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' {}<style>svg{{font:12px sans-serif}}{}</style>"
      "<rect width='100%' height='100%' fill='#fff'/>{}\n",
      svg.substr(kTag.size(), inside - kTag.size()), WithoutVariables(PictureStyle()), svg.substr(inside));
}

}  // namespace armcal::report

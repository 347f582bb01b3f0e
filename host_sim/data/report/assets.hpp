// report - holds the texts that pages carry; the build makes them of files.
#pragma once

#include <string_view>

namespace armcal::report::assets {

extern const std::string_view kPageStyle;   // assets/page.css
extern const std::string_view kLiveScript;  // assets/live.js
// The plotting library dygraphs and its licence, from Debian's package; both empty if it was not there.
extern const std::string_view kDygraphs, kDygraphsLicence;

}  // namespace armcal::report::assets

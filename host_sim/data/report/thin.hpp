// report - thins long series so that no peak and no gap is lost.
#pragma once

#include <cstddef>
#include <vector>

namespace armcal::report {

// Rising indices of the rows to draw. `columns` have one length and are cut into `stretches` equal parts. Of each part
// and each column the first lowest and the first highest value stay, and the first value that is not finite. The first
// and the last row stay, too. Where the extremes alone could be all rows, all rows stay.
std::vector<std::size_t> KeepExtremes(const std::vector<const std::vector<double>*>& columns, std::size_t stretches);

}  // namespace armcal::report

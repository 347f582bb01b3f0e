// bags - reads MATLAB files (.mat).
//
// The columns of a file are its vectors and matrices, under the names that MATLAB has for them: "t" is a vector,
// "q(:,2)" a column of a matrix with more rows than columns, "tau(2,:)" a row of one with more columns,
// "log.signals(1).values(1,1,:)" a signal of Simulink within structs.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/data/files/csv.hpp"

namespace armcal::bags {

bool IsMat(const std::filesystem::path& path);

// The columns named, as far as the file has them, or, without names, those of the most usual length. Other columns are
// in `ignored`. Numbers of any class become double; infinite ones become NaN. InputError, one line with the file: it is
// damaged or of another kind, the columns differ in length, or this program was built without libmatio.
files::NumericTable ReadMat(const std::filesystem::path& path, const std::vector<std::string>& columns);

}  // namespace armcal::bags

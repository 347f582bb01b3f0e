// generated/puma560 - names this folder's model for programs that are compiled for one model; knows nothing else.
#pragma once

#include "model.hpp"

namespace armcal::generated {
using SelectedModel = Puma560;
}  // namespace armcal::generated

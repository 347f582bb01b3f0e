// generated/ur10 - names this folder's model for programs that are compiled for one model; knows nothing else.
#pragma once

#include "model.hpp"

namespace armcal::generated {
using SelectedModel = Ur10;
}  // namespace armcal::generated

// generated/kuka_lwr4 - names this folder's model for programs that are compiled for one model; knows nothing else.
#pragma once

#include "model.hpp"

namespace armcal::generated {
using SelectedModel = KukaLwr4;
}  // namespace armcal::generated

// choice - fits one model to logs without a prior.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::choice {

struct ModelFit {
  Eigen::VectorXd z;   // [columns + eta]; empty: `why`
  std::string method;  // the method that fitted it
  std::string why;
};

// Weighted least squares for a linear model, variable projection for a nonlinear one. Variable projection has least
// squares inside, so a model never fits worse than one that it contains at fixed eta.
ModelFit FitModel(const codegen::Model& model, std::vector<const calibration::Dataset*> train,
                  const std::atomic<bool>* stop = nullptr);

}  // namespace armcal::choice

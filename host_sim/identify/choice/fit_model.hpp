// choice - fits one model to logs without a prior.
#pragma once

#include <atomic>
#include <string>
#include <vector>

#include "host_sim/identify/methods/method.hpp"

namespace armcal::choice {

// Weighted least squares for a linear model, variable projection for a nonlinear one. Variable projection has least
// squares inside, so a model never fits worse than one that it contains at fixed eta. Where columns read the load, the
// fit is made again with the load of the last one. The problem must not have a prior.
calibration::Solution SolveInRounds(calibration::Problem problem);

struct ModelFit {
  Eigen::VectorXd z;   // [columns + eta]; empty: `why`
  std::string method;  // the method that fitted it
  std::string why;
};

ModelFit FitModel(const codegen::Model& model, std::vector<const calibration::Dataset*> train,
                  const std::atomic<bool>* stop = nullptr);

}  // namespace armcal::choice

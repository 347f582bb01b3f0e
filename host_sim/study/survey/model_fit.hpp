// survey - one friction model fitted to logs without a prior, linear and nonlinear ones alike; knows no table.
#pragma once

#include "host_sim/study/survey/trial.hpp"

namespace armcal::survey {

struct ModelFit {
  Eigen::VectorXd z;   // empty: `why`
  std::string method;  // which of calibration's methods fitted it
  std::string why;
};

// Weighted least squares for a linear model, variable projection for a nonlinear one (least squares inside, so that a
// model never fits worse than one that it contains at fixed eta).
ModelFit FitModel(const codegen::Model& model, std::vector<const calibration::Dataset*> train,
                  const std::atomic<bool>* stop = nullptr);

// A robot file as it is, its declared effects too, with another friction law on every joint.
codegen::Robot WithLaw(const codegen::Robot& file, Law law, const Stribeck& stribeck);

}  // namespace armcal::survey

// choice - picks the method by the model, and keeps a failure as a sentence.
#include "host_sim/identify/choice/fit_model.hpp"

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/method.hpp"

namespace armcal::choice {

namespace {
constexpr int kRounds = 3;  // of a model with columns that read the load: the first one takes the load as zero
}

ModelFit FitModel(const codegen::Model& model, std::vector<const calibration::Dataset*> train,
                  const std::atomic<bool>* stop) {
  ModelFit fit;
  const calibration::Method& method =
      calibration::FindMethod(model.nonlinear() > 0 ? "variable_projection" : "weighted_pseudo_inverse");
  calibration::Problem problem = calibration::MakeProblem(model, std::move(train));
  problem.covariance.resize(0, 0);
  problem.stop = stop;
  fit.method = method.title;
  try {
    for (int round = 0; round < (model.depends_on_estimate() ? kRounds : 1); ++round) {
      const calibration::Solution solution = calibration::Solve(method, problem);
      if (!solution.z.allFinite()) return fit.z = Eigen::VectorXd(), fit.why = solution.remark, fit;
      fit.z = solution.z;
      problem.start.segment(model.front(), model.rigid()) = fit.z.segment(model.front(), model.rigid());
    }
  } catch (const io::InputError& error) {
    fit.why = error.what();
  }
  return fit;
}

}  // namespace armcal::choice

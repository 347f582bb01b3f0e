// survey - fits a model by the method that suits it.
#include "host_sim/study/survey/model_fit.hpp"

namespace armcal::survey {

ModelFit FitModel(const codegen::Model& model, std::vector<const calibration::Dataset*> train,
                  const std::atomic<bool>* stop) {
  ModelFit fit;
  const calibration::Method& method =
      calibration::FindMethod(model.nonlinear() > 0 ? "variable_projection" : "weighted_pseudo_inverse");
  calibration::Problem problem = calibration::MakeProblem(model, std::move(train));
  problem.covariance.resize(0, 0);
  problem.stop = stop;
  Attempt attempt = Try(method, problem);
  fit.method = method.title;
  if (attempt.solution && attempt.solution->z.allFinite()) fit.z = attempt.solution->z;
  else fit.why = attempt.solution ? attempt.solution->remark : attempt.why;
  return fit;
}

codegen::Robot WithLaw(const codegen::Robot& file, Law law, const Stribeck& stribeck) {
  codegen::Robot robot = file;
  const codegen::Robot variant = Variant(file, law, Bodies::kBase, stribeck);
  robot.effect.insert(robot.effect.begin(), variant.effect.begin(), variant.effect.end());
  return robot;
}

}  // namespace armcal::survey

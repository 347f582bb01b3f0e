// choice - fits in rounds where columns read the load, and keeps a failure as a sentence.
#include "host_sim/identify/choice/fit_model.hpp"

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/method.hpp"

namespace armcal::choice {

namespace {

constexpr int kRounds = 3;  // of a model with columns that read the load: the first one takes the load as zero

}  // namespace

calibration::Solution SolveInRounds(calibration::Problem problem) {
  const codegen::Model& model = *problem.model;
  const calibration::Method& method = calibration::LeastSquaresFor(model);
  const bool intervals = problem.intervals;
  const int rounds = model.depends_on_estimate() ? kRounds : 1;
  for (int round = 1;; ++round) {
    problem.intervals = intervals && round == rounds;
    calibration::Solution solution = calibration::Solve(method, problem);
    if (round == rounds || !solution.z.allFinite()) return solution;
    problem.start.segment(model.front(), model.rigid()) = solution.z.segment(model.front(), model.rigid());
  }
}

ModelFit FitModel(const codegen::Model& model, std::vector<const calibration::Dataset*> train,
                  const std::atomic<bool>* stop) {
  calibration::Problem problem = calibration::MakeProblem(model, std::move(train));
  problem.covariance.resize(0, 0);
  problem.stop = stop;
  ModelFit fit;
  fit.method = calibration::LeastSquaresFor(model).title;
  try {
    const calibration::Solution solution = SolveInRounds(std::move(problem));
    if (solution.z.allFinite()) fit.z = solution.z;
    else fit.why = solution.remark;
  } catch (const io::InputError& error) {
    fit.why = error.what();
  }
  return fit;
}

}  // namespace armcal::choice

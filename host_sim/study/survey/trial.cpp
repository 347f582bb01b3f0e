// survey - runs methods and judges them.
#include "host_sim/study/survey/trial.hpp"

#include <algorithm>
#include <cmath>

#include "codegen/src/io/input_error.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Truth::Truth(codegen::Model model_of_truth, const codegen::Signals& train_motion, const codegen::Signals& other_motion)
    : model(std::move(model_of_truth)),
      z(SetParameters(model)),
      bodies(calibration::BodyMean(model)),
      friction(Friction(model, z)),
      train(train_motion),
      other(other_motion),
      tau(Torque(model, train, z)),
      tau_other(Torque(model, other, z)),
      sigma_Nm(model.joints()) {
  for (int j = 0; j < model.joints(); ++j) sigma_Nm[j] = model.robot().joint[j].torque_noise_Nm;
}

Score Judge(const Truth& truth, const Levels& levels, const MatrixXd& measured, const calibration::Solution& solution,
            const VectorXd& bodies_before) {
  Score s;
  const BodyError body = CompareBodies(truth.bodies, solution.bodies, levels);
  const TorqueError train = CompareTorques(measured - Torque(truth.model, truth.train, solution.z), levels.tau_max_Nm);
  const MatrixXd difference = truth.tau_other - Torque(truth.model, truth.other, solution.z);
  const TorqueError other = CompareTorques(difference, levels.tau_max_Nm);
  s.e_d = body.e_d;
  s.e_d_link = body.per_link;
  s.massless = body.massless;
  s.e_f = FrictionError(truth.friction, Friction(truth.model, solution.z));
  s.e_T = train.abs_mean, s.e_T_std = train.std_signed;
  s.e_T_printed = train.mean_abs, s.e_T_std_printed = train.std_abs;
  s.J_e = s.e_d + s.e_f + s.e_T + s.e_T_std;
  s.J_true = s.e_d + s.e_f + other.abs_mean + other.std_signed;
  const double before = CompareBodies(truth.bodies, bodies_before, levels).e_d;
  s.e_d_over_prior = before > 0 ? s.e_d / before : std::nan("");
  s.e_base = BaseError(difference, truth.sigma_Nm);
  s.coverage = Coverage(truth.z, solution.z, solution.covariance);
  s.physical = body.impossible == 0;
  s.seconds = solution.seconds;
  s.memory_bytes = static_cast<double>(solution.memory_bytes);
  s.from_prior = solution.from_prior;
  s.remark = solution.remark;
  return s;
}

Attempt Try(const calibration::Method& method, const calibration::Problem& problem) {
  try {
    return {calibration::Solve(method, problem), ""};
  } catch (const io::InputError& e) {
    return {std::nullopt, e.what()};
  }
}

calibration::Problem WithPrior(const codegen::Model& model, std::vector<const calibration::Dataset*> train,
                               double relative_sd) {
  calibration::Problem p = calibration::MakeProblem(model, std::move(train));
  const auto narrow = [&](int i) {
    const double sd = relative_sd * std::abs(p.start[i]);
    p.covariance.row(i).setZero(), p.covariance.col(i).setZero();
    p.covariance(i, i) = sd * sd;
    p.lower[i] = std::max(p.lower[i], p.start[i] - 3 * sd);
    p.upper[i] = std::min(p.upper[i], p.start[i] + 3 * sd);
  };
  for (int c = 0; c < model.columns(); ++c)
    if (!model.is_rigid(c) && p.start[c] != 0) narrow(c);
  for (int k = 0; k < model.nonlinear(); ++k) narrow(model.columns() + k);
  return p;
}

Statistic Over(const std::vector<Score>& scores, double Score::*index) {
  std::vector<double> values;
  for (const Score& s : scores) values.push_back(s.*index);
  return Summarise(values);
}

Cell Mean(const std::vector<Score>& scores, double Score::*index) {
  const Statistic s = Over(scores, index);
  return {s.mean, s.low, s.high};
}

Cell Mean(const std::vector<double>& values) {
  const Statistic s = Summarise(values);
  return {s.mean, s.low, s.high};
}

}  // namespace armcal::survey

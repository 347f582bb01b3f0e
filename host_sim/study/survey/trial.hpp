// survey - one method on one data set, judged by every index; knows no table.
#pragma once

#include <optional>

#include "host_sim/identify/methods/method.hpp"
#include "host_sim/study/survey/arm.hpp"
#include "host_sim/study/survey/indices.hpp"
#include "host_sim/study/survey/sheet.hpp"

namespace armcal::survey {

// What an estimate is compared with: the model at the truth, the training motion and one that nothing was fitted to.
struct Truth {
  Truth(codegen::Model model_of_truth, const codegen::Signals& train_motion, const codegen::Signals& other_motion);

  codegen::Model model;
  Eigen::VectorXd z, bodies;
  Eigen::MatrixXd friction;
  codegen::Signals train, other;
  Eigen::MatrixXd tau, tau_other;  // noise-free
  Eigen::VectorXd sigma_Nm;        // Table 7, from the robot file
};

struct Score {
  double e_d = 0, e_f = 0, e_T = 0, e_T_std = 0, J_e = 0;  // as the survey's figures; torque against the measured one
  double e_T_printed = 0, e_T_std_printed = 0;             // as the survey's formulas
  double J_true = 0;          // J_e with e_T, e_T_Std against noise-free torque of the other motion
  double e_d_over_prior = 0;  // e_d / e_d of what was believed before
  double e_base = 0;          // torque-equivalent base parameter error on the other motion, in sigma
  double coverage = 0;
  double physical = 0;  // 1: every link can exist
  double seconds = 0, memory_bytes = 0, from_prior = 0;
  int massless = 0;
  Eigen::VectorXd e_d_link;
  std::string remark;
};

// measured: the torque that was fitted. bodies_before: what was believed before, [11 n].
Score Judge(const Truth& truth, const Levels& levels, const Eigen::MatrixXd& measured,
            const calibration::Solution& solution, const Eigen::VectorXd& bodies_before);

// The method's answer, or why there is none.
struct Attempt {
  std::optional<calibration::Solution> solution;
  std::string why;
};
Attempt Try(const calibration::Method& method, const calibration::Problem& problem);

// A prior for a model whose robot file says how far it may be off: relative deviations of eta and of effects, too.
calibration::Problem WithPrior(const codegen::Model& model, std::vector<const calibration::Dataset*> train,
                               double relative_sd);

// Mean of one index over draws as a cell with its interval.
Cell Mean(const std::vector<Score>& scores, double Score::*index);
Cell Mean(const std::vector<double>& values);
Statistic Over(const std::vector<Score>& scores, double Score::*index);

}  // namespace armcal::survey

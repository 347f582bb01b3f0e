// survey - one trial: a method or a friction model is fitted to one data set, and the indices of section 5 judge it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "host_sim/identify/methods/method.hpp"
#include "host_sim/study/survey/arm.hpp"
#include "host_sim/study/survey/data_files.hpp"
#include "host_sim/study/survey/plant_run.hpp"
#include "host_sim/study/survey/sheet.hpp"

namespace armcal::survey {

// Relative errors of one arm's bodies in m, c, I about the centre. e_di is the mean over link i, e_d the mean over
// links.
struct BodyError {
  double e_d = 0;
  Eigen::VectorXd per_link;
  int skipped = 0;     // entries whose set value is below the floor
  int massless = 0;    // links whose estimated mass is zero or NaN: c is 0/0, and its error counts as 1
  int impossible = 0;  // links with a negative mass or an inertia that no body has
};
// set, estimate: [11 n] about link origins.
BodyError CompareBodies(const Eigen::VectorXd& set, const Eigen::VectorXd& estimate, const Levels& levels);

// e_f: per joint the mean of |est - set| / |set| over its row, then the mean over joints.
double FrictionError(const Eigen::MatrixXd& set, const Eigen::MatrixXd& estimate);

// e_T and e_T_Std in both readings, error [samples x joints] in N m.
struct TorqueError {
  double mean_abs = 0;    // the printed formula, Mean(|e| / tau_max)
  double abs_mean = 0;    // the only formula that fits the survey's figures: |Mean(e)| / tau_max, mean over joints
  double std_signed = 0;  // of e / tau_max: the survey's figures
  double std_abs = 0;     // the printed formula, Std(|e| / tau_max)
};
TorqueError CompareTorques(const Eigen::MatrixXd& error_Nm, const std::vector<double>& tau_max_Nm);

// Root mean square of the torque difference in units of the noise. It is the effect of wrong base parameters alone.
double BaseError(const Eigen::MatrixXd& difference_Nm, const Eigen::VectorXd& sigma_Nm);

// Share of coordinates whose truth lies within 1.96 standard deviations; NaN without a covariance. Coordinates with
// variance 0 do not count.
double Coverage(const Eigen::VectorXd& truth, const Eigen::VectorXd& estimate, const Eigen::MatrixXd& covariance);

// RMS of (estimate - truth) / truth after settle_s, mean over columns; [samples x joints].
double FollowError(const Eigen::MatrixXd& truth, const Eigen::MatrixXd& estimate, double step_s, double settle_s);

// Mean over draws with its 95 % interval (Student's t; NaN with one draw), and the empirical 95th percentile.
struct Statistic {
  double mean, low, high, p95, largest;
  int draws;
};
Statistic Summarise(std::vector<double> values);

// What an estimate is compared with: the true parameters, the training motion, and a motion to which nothing was
// fitted.
struct Truth {
  // The model says what the parameters mean; the torque may come from elsewhere.
  Truth(codegen::Model model_of_truth, calibration::Dataset train_log, Instants other_run);

  // The training log with the noise of Table 7.
  calibration::Dataset Noisy(std::uint64_t seed) const;
  // The rows at which all joints' samples are used: those can be compared with a model.
  Eigen::MatrixXd Judged(const Eigen::MatrixXd& of_train) const;

  codegen::Model model;
  Eigen::VectorXd z, bodies;
  Eigen::MatrixXd friction;
  calibration::Dataset train;  // without noise
  codegen::Signals other;
  Eigen::MatrixXd tau_other;  // without noise
  Eigen::VectorXd sigma_Nm;   // Table 7, from the robot file
};

// The survey's analytic form: torque is K z of the model itself, and every row may be used.
Truth AnalyticTruth(codegen::Model model, const codegen::Signals& train, const codegen::Signals& other);

// The e_f that is left on average if the errors have the least covariance that the problem's rows and prior allow
// (Cramer and Rao; with a prior the Bayesian bound), all parameters of the model being unknown.
double LeastFrictionError(const Truth& truth, const calibration::Problem& problem);

struct Score {
  double e_d = 0, e_f = 0, e_T = 0, e_T_std = 0,
         J_e = 0;                               // as in the survey's figures; torque against the measured one
  double e_T_printed = 0, e_T_std_printed = 0;  // as the survey's formulas
  double J_true = 0;                            // J_e with e_T, e_T_Std against noise-free torque of the other motion
  double e_d_over_prior = 0;                    // e_d over the e_d of the prior
  double e_f_least = 0;                         // the bound of e_f for the same rows and prior
  double e_base = 0;                            // torque-equivalent base parameter error on the other motion, in sigma
  double coverage = 0;
  double physical = 0;  // 1: every link can exist
  double seconds = 0, memory_bytes = 0, from_prior = 0;
  int massless = 0;
  Eigen::VectorXd e_d_link;
  std::string remark;
};

// measured: the torque that was fitted. bodies_before: the prior's, [11 n].
Score Judge(const Truth& truth, const Levels& levels, const Eigen::MatrixXd& measured,
            const calibration::Solution& solution, const Eigen::VectorXd& bodies_before);

// The method's answer, or the reason why there is none.
struct Attempt {
  std::optional<calibration::Solution> solution;
  std::string why;
};
Attempt Try(const calibration::Method& method, const calibration::Problem& problem);

// The problem with a prior of this relative deviation for friction, effects and eta, too.
calibration::Problem WithPrior(const codegen::Model& model, std::vector<const calibration::Dataset*> train,
                               double relative_sd);

// Mean of one index over draws as a cell with its interval.
Cell Mean(const std::vector<Score>& scores, double Score::*index);
Cell Mean(const std::vector<double>& values);
Statistic Over(const std::vector<Score>& scores, double Score::*index);

// The robot file with its declared effects, and with another friction law on every joint.
codegen::Robot WithLaw(const codegen::Robot& file, Law law, const Stribeck& stribeck);

}  // namespace armcal::survey

// survey - the indices of section 5, in the survey's reading and in the one that judges; knows no method.
#pragma once

#include <Eigen/Core>
#include <string>
#include <vector>

#include "host_sim/study/survey/data_files.hpp"

namespace armcal::survey {

// Relative errors of one arm's bodies over m, c, I about the centre: e_di is link i's mean, e_d the mean of those.
struct BodyError {
  double e_d = 0;
  Eigen::VectorXd per_link;
  int skipped = 0;     // entries whose set value is below the floor
  int massless = 0;    // links whose estimated mass is zero or no number: c is 0/0, its error counts as 1
  int impossible = 0;  // links with a negative mass or an inertia that no body has
};
// set, estimate: [11 n] about link origins.
BodyError CompareBodies(const Eigen::VectorXd& set, const Eigen::VectorXd& estimate, const Levels& levels);

// e_f: per joint the mean of |est - set| / |set| over its row, then the mean over joints.
double FrictionError(const Eigen::MatrixXd& set, const Eigen::MatrixXd& estimate);

// e_T and e_T_Std in both readings, error [samples x joints] in N m.
struct TorqueError {
  double mean_abs = 0;    // the printed formula, Mean(|e| / tau_max)
  double abs_mean = 0;    // what the survey's figures can only be: |Mean(e)| / tau_max, mean over joints
  double std_signed = 0;  // of e / tau_max: the survey's figures
  double std_abs = 0;     // the printed formula, Std(|e| / tau_max)
};
TorqueError CompareTorques(const Eigen::MatrixXd& error_Nm, const std::vector<double>& tau_max_Nm);

// Root mean square of the torque difference in units of the noise: what a wrong base parameter costs, and only that.
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

}  // namespace armcal::survey

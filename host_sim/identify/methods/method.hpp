// methods - one interface for every identification method: those of the survey's section 3, and better ones.
//
// Unknowns z = [p, eta]: p the model's filter coordinates (phi of (12); body parameters, friction, effects), eta its
// nonlinear parameters (those of f in (13)). With `[parameters] set = "standard"` in the robot file p holds every body
// parameter, as the survey has it; otherwise base parameters.
#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "host_sim/identify/calibration/dataset.hpp"
#include "host_sim/identify/calibration/prior.hpp"

namespace armcal::calibration {

// Simulates the closed loop with given parameters along the log's own reference; returns the signals at the log's
// samples. Methods that build instruments call it with their own estimate, never with a truth.
using ClosedLoop = std::function<codegen::Signals(const Dataset& log, const Eigen::VectorXd& z)>;

struct Problem {
  const codegen::Model* model = nullptr;
  std::vector<const Dataset*> train;  // rows with used = 1 count; samples in order of time
  Eigen::VectorXd sigma_Nm;           // [n] standard deviation of a torque sample
  Eigen::VectorXd start;              // [z] prior mean
  Eigen::MatrixXd covariance;         // [z x z] prior; 0 x 0: none
  Eigen::VectorXd lower, upper;       // [z] ranges that a search may use
  ClosedLoop closed_loop;             // empty: the control law is not known
  double forgetting = 0.998;          // mu of (22)-(24)
  std::uint64_t seed = 1;
  bool intervals = false;                                             // asks for Solution::interval
  const std::atomic<bool>* stop = nullptr;                            // set: return the best so far
  std::function<void(double share, double objective)> progress = {};  // may be empty
};

struct Solution {
  Eigen::VectorXd z;
  Eigen::MatrixXd covariance;  // [z x z]; 0 x 0 where the method gives none
  // [z x 2] ends of the 95 % intervals where they were asked for and the method has them; an end is infinite if the
  // logs do not bound the coordinate on that side. 0 x 0: value +- 1.96 standard deviations is the method's best.
  Eigen::MatrixXd interval;
  Eigen::VectorXd bodies;  // [11 n] standard parameters about link origins, read out of z
  bool physical = false;   // every body of `bodies` can exist
  bool converged = true;
  int iterations = 0;
  double seconds = 0;            // of this call, one thread's CPU time
  std::size_t memory_bytes = 0;  // of what grows with samples or particles, and the method's own matrices
  double from_prior = 0;  // share of the posterior information that the prior gave, mean over coordinates; 0: none used
  Eigen::MatrixXd path;   // [samples x z] estimate after each sample; online methods only
  std::string remark;     // for the reader: "diverged at sample 311", ...
};

struct Method {
  const char* name;                           // "pseudo_inverse"
  const char* title;                          // "pseudo-inverse"
  const char* equation;                       // of the survey: "(15)"; empty where it has none
  bool nonlinear;                             // takes models with eta
  bool online;                                // one sample after the other
  bool needs_loop;                            // Problem::closed_loop
  bool needs_prior;                           // Problem::covariance
  bool needs_ranges;                          // Problem::lower, upper; a search, which takes seconds
  Solution (*solve)(const Problem& problem);  // throws io::InputError, one line, where the problem lacks what it needs
};

// All of them, those of the survey first.
const std::vector<Method>& Methods();
// InputError that names the known ones.
const Method& FindMethod(const std::string& name);
// Least squares without a prior: weighted for a linear model, variable projection for a nonlinear one.
const Method& LeastSquaresFor(const codegen::Model& model);
// Runs a method. InputError, one line, where it does not take such a model or the problem lacks what it needs.
Solution Solve(const Method& method, const Problem& problem);

// Prior mean, covariance and ranges from the model's table; ranges: +-3 prior standard deviations, cut to the bounds.
Problem MakeProblem(const codegen::Model& model, std::vector<const Dataset*> train);

// The same problem along other logs, which must outlive it.
Problem Along(const Problem& problem, const std::vector<Dataset>& logs);

// Rows of all used samples at eta: K [rows x columns], tau [rows], joint, log and sample of each row.
struct Rows {
  Eigen::MatrixXd K;
  Eigen::VectorXd tau;
  std::vector<int> joint, log, sample;
};
Rows StackRows(const Problem& problem, const Eigen::VectorXd& z);
// [n] Standard deviation of a torque sample by what z leaves of it; sigma_Nm of a joint that has no used row.
Eigen::VectorXd ResidualNoise(const Problem& problem, const Eigen::VectorXd& z);
// d tau / d eta at z, same rows: [rows x nonlinear].
Eigen::MatrixXd StackJacobian(const Problem& problem, const Eigen::VectorXd& z, const Rows& rows);

}  // namespace armcal::calibration

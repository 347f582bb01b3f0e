// methods - what the searches minimise, (16), (22) or (25), and the ranges and bodies that they may try.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

#include "codegen/src/generator/tape.hpp"
#include "host_sim/identify/methods/method.hpp"
#include "host_sim/identify/methods/row_inputs.hpp"

namespace armcal::calibration {

enum class Criterion {
  kSquares,     // (16): |tau_j - K phi|^2
  kForgetting,  // (22): sum over samples of mu^(N - i) (tau_j - K phi)^2; N - i counts samples of all logs
  kMeanSpread   // (25): sum over joints of |mean e_i| + k_e standard deviation of e_i (divisor N)
};

inline constexpr double kSpreadWeight = 1;  // k_e of (25); the survey gives no number

// For a linear model each joint keeps the mean of its rows [K tau] and the triangular factor of their (centred) Gram
// matrix. A value then costs some thousand multiplications, whatever the number of samples. For a nonlinear model each
// joint keeps its rows, and only columns that read a nonlinear parameter are evaluated again. Holds scratch: one object
// a thread.
class Objective {
 public:
  // InputError: no usable rows; a nonlinear model with memory or whose columns depend on the estimate.
  Objective(const Problem& problem, Criterion criterion);

  double operator()(const Eigen::VectorXd& z);
  // With gradient [z]. (25) is smoothed within a hundredth of sigma_j of its kinks, where mean or spread of e_i is
  // zero.
  double operator()(const Eigen::VectorXd& z, Eigen::VectorXd& gradient);

  std::size_t memory_bytes() const;

 private:
  // The rows of one joint that may be used.
  struct Joint {
    std::vector<int> column;  // filter coordinates it reads
    Eigen::MatrixXd K;        // [rows x column]; nonlinear models
    Eigen::VectorXd tau, weight;
    Eigen::RowVectorXd mean;  // [column + 1] of [K tau]; linear models
    Eigen::MatrixXd factor;   // [column + 1 x column + 1] upper: factor' factor = Gram matrix of [K tau]
    std::unique_ptr<RowInputs> inputs;
    std::vector<int> varying, slope;  // columns that read eta, place in `column`; eta that the torque reads
    std::unique_ptr<codegen::Tape> column_tape, slope_tape;
    Eigen::MatrixXd slope_value;  // [rows x slope] d tau / d eta
    double smoothing = 0;
  };
  struct Term {
    double value, d_mean, d_square;
  };
  Term Value(double mean, double square, double smoothing) const;
  double Evaluate(const Eigen::VectorXd& z, Eigen::VectorXd* gradient);
  double Linear(const Joint& joint, const Eigen::VectorXd& z, Eigen::VectorXd* gradient) const;
  double Direct(Joint& joint, const Eigen::VectorXd& z, Eigen::VectorXd* gradient) const;
  void Condense(Joint& joint) const;
  void Prepare(const Problem& problem, const Rows& rows, int j);

  const codegen::Model& model_;
  Criterion criterion_;
  bool linear_;
  std::vector<Joint> joint_;
};

// Where a search may look. Coordinates u in [0, 1] stand for the free coordinates of z within their ranges. The bodies
// that can exist are a convex set that holds Problem::start. So a point outside is moved back along the straight line
// to the start. If the robot file has no bodies, only base parameters are searched, and bodies are not checked.
class SearchSpace {
 public:
  // InputError: a free coordinate without a finite range, or bodies of the start that cannot exist (names them).
  SearchSpace(const Problem& problem, const char* method);

  int size() const { return static_cast<int>(free_.size()); }
  Eigen::VectorXd Point(const Eigen::VectorXd& u) const;  // u -> z
  Eigen::VectorXd Place(const Eigen::VectorXd& z) const;  // z -> u
  // z, moved towards the start until its bodies can exist.
  Eigen::VectorXd Possible(const Eigen::VectorXd& z) const;
  // Turns d value / d z into d value / d u.
  Eigen::VectorXd Gradient(const Eigen::VectorXd& dz) const;

  // Standard parameters: z determines a part of them, the prior the rest.
  Eigen::VectorXd Bodies(const Eigen::VectorXd& z) const;
  // Minus the sum over links of log det of the pseudo-inertia, relative to that of the start, and its gradient [z].
  // Infinite where a body cannot exist.
  double Barrier(const Eigen::VectorXd& z, Eigen::VectorXd& gradient) const;

  // "3 of 72 at an end of their range"; empty if none.
  std::string AtEnds(const Eigen::VectorXd& z) const;

 private:
  const codegen::Model& model_;
  Eigen::VectorXd start_, lower_, upper_, width_;  // [z], [free] ...
  std::vector<int> free_;
  Eigen::MatrixXd map_;     // [11 n x rigid]
  Eigen::VectorXd offset_;  // bodies = offset + map p
  double start_log_det_ = 0;
};

}  // namespace armcal::calibration

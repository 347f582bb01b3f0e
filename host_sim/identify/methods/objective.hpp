// methods - what a search minimises: (16), (22) or (25) as a function of z; knows no range and no search.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <utility>
#include <vector>

#include "codegen/src/generator/tape.hpp"
#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

enum class Criterion {
  kSquares,     // (16): |tau_j - K phi|^2
  kForgetting,  // (22): sum over samples of mu^(N - i) (tau_j - K phi)^2; N - i counts samples of all logs
  kMeanSpread   // (25): sum over joints of |mean e_i| + k_e standard deviation of e_i (divisor N)
};

inline constexpr double kSpreadWeight = 1;  // k_e of (25); the survey gives no number

// Linear models: each joint keeps the mean of its rows [K tau] and the triangular factor of their (centred) Gram
// matrix; a value then costs some thousand multiplications, whatever the number of samples. Nonlinear models: each
// joint keeps its rows, and only columns that read a nonlinear parameter are evaluated anew. Holds scratch: one a
// thread.
class Objective {
 public:
  // InputError: no usable rows; a nonlinear model with memory or whose columns depend on the estimate.
  Objective(const Problem& problem, Criterion criterion);

  double operator()(const Eigen::VectorXd& z);
  // With gradient [z]; (25) smoothed within a hundredth of sigma_j of its kinks, e_i of mean or spread zero.
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
    codegen::Signals signals;
    std::vector<int> varying, slope;  // columns that read eta, place in `column`; eta that the torque reads
    std::unique_ptr<codegen::Tape> column_tape, slope_tape;
    std::vector<codegen::Binding> input;       // of the graph
    std::vector<std::pair<int, int>> unknown;  // input, coordinate of z
    Eigen::MatrixXd slope_value;               // [rows x slope] d tau / d eta
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
  void Bind(const Problem& problem, const Rows& rows, const std::vector<int>& index, Joint& joint) const;

  const codegen::Model& model_;
  Criterion criterion_;
  bool linear_;
  std::vector<Joint> joint_;
};

}  // namespace armcal::calibration

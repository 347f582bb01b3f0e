// diagnosis - fits the declared model in whitened rows, and computes what a further column would gain.
//
// Frisch-Waugh: with Q the base's whitened, orthonormal columns and r the residual, columns C gain g' S^-1 g with
// S = C'C - (Q'C)'(Q'C), g = C'r. Trying a column never needs a refit.
#pragma once

#include <Eigen/Cholesky>
#include <utility>
#include <vector>

#include "host_sim/diagnose/diagnosis/curve_odds.hpp"
#include "host_sim/diagnose/diagnosis/noise.hpp"

namespace armcal::diagnosis {

// Columns of a term over all used rows of each joint it touches: block[r] is rows(joint) x columns, for joints[r].
struct Columns {
  std::vector<int> joints;
  std::vector<Eigen::MatrixXd> block;
  int count() const { return block.empty() ? 0 : static_cast<int>(block[0].cols()); }
};

struct Gain {
  double gain = 0;                // decrease of chi^2
  int rank = 0;                   // directions that the data see
  Eigen::VectorXd amplitude, sd;  // of the columns
  Eigen::VectorXd z;              // of the base with the columns in
};

// A parameter of the base that cannot take every value, for instance a Coulomb level.
struct Bounded {
  int joint, coordinate;
  double lower, upper;
};

// Raw (unwhitened) rows of the base model, shared by all metrics of one pass.
struct BaseRows {
  std::vector<RowIndex> index;            // [n]
  std::vector<std::vector<int>> columns;  // [n] the coordinates x that act on joint j
  std::vector<Eigen::MatrixXd> design;    // [n] rows x columns[j]
  std::vector<Eigen::VectorXd> target;    // [n] tau minus the prior mean's torque
  std::vector<Eigen::MatrixXd> gram;      // [n] design' design
  std::vector<Eigen::VectorXd> right;     // [n] design' target
  std::vector<Bounded> bounded;
  Eigen::MatrixXd L;  // x - mean = L z; z has unit prior
  Eigen::VectorXd mean;
  Eigen::MatrixXd precision;  // what is known of x beside the prior of z: of curves, how smooth and large; may be empty
  int joints() const { return static_cast<int>(index.size()); }
  int coordinates() const { return static_cast<int>(L.cols()); }
  // Brings gram and right of joint j up to its design, whose columns before `from` are as they were.
  void Multiply(int j, Eigen::Index from = 0);
};

// Columns against the base: their own products, B = Q'C, g = C'r. Projections of columns that never act at the same
// time add up.
struct Projection {
  Eigen::MatrixXd gram, B;
  Eigen::VectorXd g;
  Projection& operator+=(const Projection& other) {
    gram += other.gram, B += other.B, g += other.g;
    return *this;
  }
};

class Metric {
 public:
  Metric(const BaseRows& rows, std::vector<NoiseModel> noise);

  Projection Project(const Columns& c) const;
  Gain Try(const Projection& p) const;
  Gain Try(const Columns& c) const { return Try(Project(c)); }
  // Of a curve with these columns, `inner` of them in a row.
  CurveOdds OddsOf(const Projection& p, int inner) const;
  // No bounded parameter of the joints given leaves its range at g (by more than 2 standard deviations).
  bool InBounds(const Gain& g, const std::vector<int>& joints) const;
  const Eigen::VectorXd& Residual(int j) const { return residual_[static_cast<std::size_t>(j)]; }  // whitened
  Eigen::VectorXd RawResidual(int j) const;                                                        // torque units
  Eigen::VectorXd ResidualWith(const Columns& c, int j) const;  // torque units, C fitted too
  const std::vector<NoiseModel>& noise() const { return noise_; }
  const Eigen::VectorXd& z() const { return z_; }

  // Decrease of chi^2 on each of `folds` interleaved folds of `blocks` blocks, base and C fitted to the other folds.
  // precision: what is known of C's amplitudes; empty: nothing.
  Eigen::VectorXd FoldGains(const Columns& c, int blocks, int folds, const Eigen::MatrixXd& precision) const;

  // Share of the trace C a that lies in the fold which holds most of it: near 1, no other fold can tell of it.
  double LargestFold(const Columns& c, const Eigen::VectorXd& a, int blocks, int folds) const;

  // -2 log likelihood (up to a constant) of C's joints with C in the model and their noise fitted anew. If `noise` is
  // given it receives the noise models of all joints, those of C's joints fitted with C in.
  double RefittedDeviance(const Columns& c, std::vector<NoiseModel>* noise = nullptr) const;

  // Gain of `other` on the fitted trace of `fitted` (amplitudes a), and that trace's own chi^2 off the base.
  std::pair<double, double> Imitates(const Columns& other, const Columns& fitted, const Eigen::VectorXd& a) const;

  // Covariance of z and of C's amplitudes about zero, whatever the noise is within a block of time: coloured, larger
  // where the arm is fast. time: of each dataset.
  Eigen::MatrixXd RobustCovariance(const Columns& c, double block_s,
                                   const std::vector<const Eigen::VectorXd*>& time) const;

 private:
  Eigen::MatrixXd WhitenedColumns(const Columns& c, int r) const;
  void WhitenJoint(int j);
  void Solve();
  Eigen::MatrixXd PriorPrecision() const;  // of z

  const BaseRows& rows_;
  std::vector<NoiseModel> noise_;
  std::vector<Eigen::MatrixXd> map_;  // [n] rows of L of columns[j]
  // The whitened design in coordinates is q(j) q_map_[j]. White noise only scales: q is then the design itself.
  const Eigen::MatrixXd& q(int j) const { return coloured_[j].size() ? coloured_[j] : rows_.design[j]; }
  std::vector<Eigen::MatrixXd> coloured_;  // [n] whitened design; empty if the noise is white
  std::vector<Eigen::MatrixXd> q_map_;     // [n] map_, over the noise if it is white
  std::vector<Eigen::VectorXd> residual_, y_;
  std::vector<Eigen::MatrixXd> gram_;   // [n] of q q_map_
  std::vector<Eigen::VectorXd> right_;  // [n] (q q_map_)' y_
  Eigen::LLT<Eigen::MatrixXd> factor_;
  Eigen::MatrixXd prior_;
  Eigen::VectorXd z_, bounded_sd_;
};

}  // namespace armcal::diagnosis

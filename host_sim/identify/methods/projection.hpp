// methods - a nonlinear law with its linear part solved inside: what is left depends on eta alone.
//
// Golub and Pereyra 1973 with Kaufman's simplification: F(eta) = min_p |tau - K(eta) p|^2 + prior. Its Gauss-Newton
// Hessian is the Schur complement of p in the Hessian of all. Where the range of eta is positive, its logarithm is the
// search coordinate. F is in units of chi^2 / 2.
#pragma once

#include <vector>

#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

class Projection {
 public:
  // The problem must outlive it.
  explicit Projection(const Problem& problem);

  const Problem& problem() const { return problem_; }
  const std::vector<int>& eta() const { return eta_; }

  // Etas that only rows of one joint read, and the columns of these rows that read them. Each eta that several joints
  // read is a group of its own, whose joint is -1.
  struct Group {
    int joint;
    std::vector<int> eta, column;
  };
  const std::vector<Group>& groups() const { return group_; }

  // F at the eta in z; z's linear part becomes the best one. Gradient and Hessian in the search coordinates of eta.
  double Evaluate(Eigen::VectorXd& z, Eigen::VectorXd* gradient, Eigen::MatrixXd* hessian) const;

  // All of F at one z, by joint, from which F with another eta of one group follows at little cost.
  struct Whole {
    Rows rows;
    Eigen::MatrixXd A, H;
    Eigen::VectorXd z, weight, target, right;
    std::vector<std::vector<Eigen::Index>> own;  // rows of each group's joint
  };
  Whole At(const Eigen::VectorXd& z) const;
  // F for each group with its eta from `trial` and all others from `whole`.
  std::vector<double> Swapped(const Whole& whole, const Eigen::VectorXd& trial) const;
  // F of one group that has a joint, with other values of the columns that its eta changes: [own rows x group's
  // columns]. z: with the other eta. With `factor`: the Hessian's factor and the best linear part in whitened
  // coordinates.
  struct Solved {
    Eigen::MatrixXd H;
    Eigen::VectorXd w;
  };
  double OfColumns(const Whole& whole, std::size_t group, const Eigen::MatrixXd& columns, const Eigen::VectorXd& z,
                   Solved* solved = nullptr) const;

  bool logarithmic(int coordinate) const { return problem_.lower[coordinate] > 0; }
  // Eta moved by a step in search coordinates, kept in its range.
  Eigen::VectorXd Moved(const Eigen::VectorXd& z, const Eigen::VectorXd& step) const;

  // Row c of L, where p = start + L w.
  Eigen::RowVectorXd Whitened(int coordinate) const { return L_.row(coordinate); }

 private:
  std::vector<Eigen::MatrixXd> OwnColumns(const Whole& whole, const Eigen::VectorXd& z) const;
  Eigen::MatrixXd Scaled(const Eigen::MatrixXd& K, const Eigen::VectorXd& weight) const;
  void MakeGroups();
  double EtaCost(const Eigen::VectorXd& z) const;
  double EtaPrior(int coordinate) const;
  double Deviation(int coordinate, double value) const;

  const Problem& problem_;
  int columns_;
  std::vector<int> linear_, eta_;
  std::vector<Group> group_;
  Eigen::MatrixXd L_;
};

}  // namespace armcal::calibration

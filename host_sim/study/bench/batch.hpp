// bench - least squares over a log in three ways: summed without storing rows, stored normal equations, stored QR.
#pragma once

#include <Eigen/Core>

namespace armcal::bench {

// A log's columns, as a host program holds them. Shapes: [samples x joints].
struct Log {
  Eigen::MatrixXd q, qd, qdd, tau;
};
Log RandomLog(int samples, unsigned seed);

int Columns();  // filter coordinates

// Each returns the estimate, weight 1 for every row.
Eigen::VectorXd FusedGram(const Log& log);
// stored: [samples x joints rows x columns] and its torque, made anew by MakeStored.
void MakeStored(const Log& log, Eigen::MatrixXd& stored, Eigen::VectorXd& right);
Eigen::VectorXd StoredNormal(const Eigen::MatrixXd& stored, const Eigen::VectorXd& right);
Eigen::VectorXd StoredHouseholder(Eigen::MatrixXd& stored, const Eigen::VectorXd& right);  // overwrites stored

}  // namespace armcal::bench

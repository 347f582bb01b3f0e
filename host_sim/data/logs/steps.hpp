// logs - the time between samples: the usual step, and where samples are lost.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace armcal::logs {

// The middle value, of an even count the upper one of the two; 0 if there is none.
double Median(std::vector<double> x);

// Of the steps of t that rise [unit of t]; 0 if none does.
double MedianStep(const Eigen::VectorXd& t);

// The rows behind which samples are lost: the next stamp is late by more than half a step, and so are the stamps that
// follow. A stamp that alone is late jitters; nothing is lost there.
std::vector<int> LostBehind(const Eigen::VectorXd& t);

}  // namespace armcal::logs

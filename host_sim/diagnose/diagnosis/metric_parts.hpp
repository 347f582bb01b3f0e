// diagnosis - small pieces that every part of a metric uses.
#pragma once

#include "host_sim/diagnose/diagnosis/metric.hpp"
#include "host_sim/identify/calibration/tall_product.hpp"

namespace armcal::diagnosis {

// g' S^+ g with S = C'C - B' base^-1 B, directions judged against the columns' own size.
Gain SolveGain(const Eigen::LLT<Eigen::MatrixXd>& base, const Projection& p);

Eigen::MatrixXd WhitenAll(const NoiseModel& noise, const RowIndex& rows, const Eigen::MatrixXd& m);
using calibration::SelfProduct, calibration::TallProduct;

}  // namespace armcal::diagnosis

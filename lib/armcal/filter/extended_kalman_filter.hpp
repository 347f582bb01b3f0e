// filter - the Kalman filter over [front, dense, eta]; knows columns, not what they mean.
#pragma once

#include "armcal/filter/kalman_filter.hpp"

namespace armcal::filter {

// Rows are linearised at the estimate before the sample: y = tau - tau(x0) + h x0, h = [columns, d tau / d eta] at x0;
// whoever makes the rows keeps to that (estimator/live_model.hpp). In all else the same filter.
// The block form serves wherever process noise is on front columns only: eta is a dense column.
template <class Layout, Form form = Form::kDense>
using ExtendedKalmanFilter = KalmanFilter<Layout, form, Beside::kEta>;

}  // namespace armcal::filter

// math - every float kernel of lib in one object, to see what it links.
#include "armcal/estimator/estimator.hpp"
#include "armcal/feedforward/feed_forward.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/filter/model_bank.hpp"
#include "tests/unit/estimator/two_link_model.hpp"

namespace armcal {

using Model = test::TwoLink;
template class signal::SignalPath<2, 8>;
template class filter::KalmanFilter<Model>;
template class filter::KalmanFilter<Model, filter::Form::kBlock>;
template class filter::KalmanFilter<Model, filter::Form::kDense, filter::Beside::kEta>;
template class filter::ForgettingFilter<Model>;
template class filter::ModelBank<Model>;
template class feedforward::FeedForward<Model>;
template class estimator::Estimator<Model, filter::KalmanFilter<Model>>;
template class estimator::Estimator<Model, filter::ForgettingFilter<Model>>;
template class estimator::Estimator<Model, filter::ExtendedKalmanFilter<Model>>;
template class estimator::Estimator<Model, filter::ModelBank<Model>>;
template core::Status estimator::BuildAdoptedTable<Model>(const estimator::Table<Model>&, std::uint32_t,
                                                          physical::RigidPrior<Model, float>&,
                                                          estimator::AdoptedTable<Model>&);
template void physical::ReadBodies<Model, float>(const physical::RigidPrior<Model, float>&, const float*, float*);

void Elementary(const float* x, float* y) {
  math::SinCosBlock<6>(x, y, y + 6);
  y[12] = math::Exp(x[0]);
  y[13] = math::Log(x[0]);
  y[14] = math::Tanh(x[0]);
  y[15] = math::Cbrt(x[0]);
  y[16] = math::Pow(x[0], x[1]);
  y[17] = math::Divide(x[0], x[1]);
}

}  // namespace armcal

// estimator - hands a filter's result to the physical read-out; knows each filter's way to keep it, and no register.
#pragma once

#include <type_traits>

#include "armcal/estimator/estimator.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/physical/map_read_out.hpp"

namespace armcal::estimator {

// The estimate behind a finished read-out.
template <class Layout>
const auto& EstimateOf(const filter::ForgettingFilter<Layout>&,
                       const typename filter::ForgettingFilter<Layout>::ReadOut& done) {
  return done.estimate;
}
template <class Layout, filter::Form form, filter::Beside beside>
const auto& EstimateOf(const filter::KalmanFilter<Layout, form, beside>& filter,
                       const typename filter::KalmanFilter<Layout, form, beside>::ReadOut&) {
  return filter.estimate();
}

// From an estimator's filter between two samples: read_out.Step may follow while the estimator goes on. image, rigid:
// what the estimator runs on, and what BuildImage left for it; both must stay until the read-out is done. warm: the
// image is that of the last read-out. kBusy: rows have come in since the filter's own read-out; ask for one
// (RequestReadOut) and come back. Else as MapReadOut::Begin and AddSpread. Some kColumns^3 multiplications and
// additions; to cut that into slices call those two as here. Context: background.
template <class Model, class Filter, class T>
core::Status BeginPhysical(const Image<Model>& image, const RigidPrior<Model, float>& rigid,
                           const Estimator<Model, Filter>& estimator, bool warm,
                           physical::MapReadOut<Model, T>& read_out) {
  const typename Filter::ReadOut* done = estimator.read_out();
  if (done == nullptr) return core::Status::kBusy;
  core::Status status =
      read_out.Begin({rigid.mean, rigid.sd, image.committed.p, image.scale, image.prior.dense_ud}, done->x, warm);
  const auto& estimate = EstimateOf(estimator.filter(), *done);
  constexpr int kSize = std::decay_t<decltype(estimate)>::kSize;
  for (int p = 0; p < kSize && core::IsOk(status); ++p) {
    float spread[kSize];
    const float d = estimate.Spread(p, spread);
    status = read_out.AddSpread(d, spread);
  }
  return status;
}

// From a finished read-out: the parameters have moved further than the table's deviations allow, so what the data
// hardly tell is less certain than it says. Of tables that are right, one in a thousand is called so, or less. Context:
// background.
template <class Model, class T>
bool PriorIsTooNarrow(const physical::MapReadOut<Model, T>& read_out) {
  constexpr float kSigmas = 3.09f;  // of the normal distribution, for one in a thousand
  const auto& r = read_out.result();
  const float learned = math::Max(static_cast<float>(r.learned), 1.0f);
  return static_cast<float>(r.moved) > monitor::ChiSquareLimit(learned, kSigmas);
}

}  // namespace armcal::estimator

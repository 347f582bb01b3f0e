// estimator - hands a filter's result to the physical read-out; knows each filter's way to keep it, and no register.
#pragma once

#include "armcal/estimator/image.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"
#include "armcal/physical/map_read_out.hpp"

namespace armcal::estimator {

// The factor U D U' behind a finished read-out, packed. Shape: [UdSize(kColumns)].
template <class Layout>
const float* FactorOf(const filter::ForgettingFilter<Layout>&,
                      const typename filter::ForgettingFilter<Layout>::ReadOut& done) {
  return done.ud;
}
template <class Layout>
const float* FactorOf(const filter::KalmanFilter<Layout>& filter,
                      const typename filter::KalmanFilter<Layout>::ReadOut&) {
  return filter.factor();
}

// From a filter's finished read-out, before another row: read_out.Step may follow, and the filter may go on. rigid: the
// one that BuildImage filled in for this image; both must stay until the read-out is done. warm: the image is that of
// the last read-out. Answers as MapReadOut::Begin and AddSpread. Some kColumns^3 multiplications and additions; call
// those two yourself to cut it into slices. Context: background.
template <class Model, class Filter, class T>
core::Status BeginPhysical(const Image<Model>& image, const RigidPrior<Model, float>& rigid, const Filter& filter,
                           const typename Filter::ReadOut& done, bool warm, physical::MapReadOut<Model, T>& read_out) {
  constexpr int n = Model::kColumns;
  core::Status status =
      read_out.Begin({rigid.mean, rigid.sd, image.committed.p, image.scale, image.prior.dense_ud}, done.x, warm);
  const float* ud = FactorOf(filter, done);
  for (int j = 0; j < n && core::IsOk(status); ++j) {
    float column[n] = {};
    for (int i = 0; i < j; ++i) column[i] = ud[math::UdIndex(i, j)];
    column[j] = 1.0f;
    status = read_out.AddSpread(ud[math::UdIndex(j, j)], column);
  }
  return status;
}

}  // namespace armcal::estimator

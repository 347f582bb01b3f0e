// estimator - hands a filter's result to the physical read-out.
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

// Starts to copy estimate and covariance of an estimator's filter to `read_out`. Call it when no sample is being
// processed, and then ContinuePhysical until it answers kOk; the estimator must not Step before that, or the hand-over
// has to begin again. Then call read_out.Step until it returns true; the estimator may go on meanwhile. table: the
// table of the estimator. rigid: the work space that BuildAdoptedTable filled for this table. Both must not change
// until the read-out is done. warm: true if the last read-out was of the same table. kBusy: the filter has no finished
// read-out (Estimator::read_out); call RequestReadOut, wait, and call this again. All other answers are those of
// MapReadOut::Begin. Context: background.
template <class Model, class Filter, class Source, class T>
core::Status BeginPhysical(const AdoptedTable<Model>& table, const physical::RigidPrior<Model, float>& rigid,
                           const Estimator<Model, Filter, Source>& estimator, bool warm,
                           physical::MapReadOut<Model, T>& read_out) {
  const typename Filter::ReadOut* done = estimator.read_out();
  if (done == nullptr) return core::Status::kBusy;
  const core::Status begun =
      read_out.Begin({rigid.mean, rigid.sd, table.committed.p, table.scale, table.prior.dense_ud}, done->x, warm);
  if (core::IsOk(begun)) read_out.SetSource(estimator.read_outs());
  return begun;
}

// One slice of that: a column of the filter's factor, some kColumns^2 multiplications and additions. kBusy: call it
// again. kOk: all columns are copied. kWrongOrder: the estimator has stepped since BeginPhysical, so its estimate is
// another one; call BeginPhysical again. All other answers are those of MapReadOut::AddSpread. Context: background.
template <class Model, class Filter, class Source, class T>
core::Status ContinuePhysical(const Estimator<Model, Filter, Source>& estimator,
                              physical::MapReadOut<Model, T>& read_out) {
  const typename Filter::ReadOut* done = estimator.read_out();
  if (done == nullptr || estimator.read_outs() != read_out.source()) return core::Status::kWrongOrder;
  const auto& estimate = EstimateOf(estimator.filter(), *done);
  constexpr int kSize = std::decay_t<decltype(estimate)>::kSize;
  float spread[kSize];
  const float d = estimate.Spread(read_out.spreads(), spread);
  const core::Status status = read_out.AddSpread(d, spread);
  return core::IsOk(status) && read_out.spreads() < kSize ? core::Status::kBusy : status;
}

// Both at once, some kColumns^3 multiplications and additions: for a PC. Context: background.
template <class Model, class Filter, class Source, class T>
core::Status HandOverPhysical(const AdoptedTable<Model>& table, const physical::RigidPrior<Model, float>& rigid,
                              const Estimator<Model, Filter, Source>& estimator, bool warm,
                              physical::MapReadOut<Model, T>& read_out) {
  core::Status status = BeginPhysical(table, rigid, estimator, warm, read_out);
  if (!core::IsOk(status)) return status;
  do status = ContinuePhysical(estimator, read_out);
  while (status == core::Status::kBusy);
  return status;
}

// From a finished read-out. Returns true if the parameters have moved further than the table's deviations allow. Then
// parameters that the data hardly determine are less certain than the read-out says. A right table is called too narrow
// at most once in a thousand times. Context: background.
template <class Model, class T>
bool PriorIsTooNarrow(const physical::MapReadOut<Model, T>& read_out) {
  constexpr float kSigmas = 3.09f;  // of the normal distribution, for one in a thousand
  const auto& r = read_out.result();
  const float learned = math::Max(static_cast<float>(r.learned), 1.0f);
  return static_cast<float>(r.moved) > monitor::ChiSquareLimit(learned, kSigmas);
}

}  // namespace armcal::estimator

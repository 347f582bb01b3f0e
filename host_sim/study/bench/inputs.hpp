// bench - random joint states for a generated model, in any scalar; knows no time.
#pragma once

#include <random>
#include <vector>

#include "armcal/math/pack.hpp"
#include "armcal/model/sample.hpp"
#include "selected_model.hpp"

namespace armcal::bench {
namespace {

using Model = generated::SelectedModel;
constexpr int n = Model::kJoints;
static_assert(Model::kStates == 0, "an effect with memory needs samples in order; bench a model without");

template <class T>
constexpr int kLanes = 1;
template <class T, int N>
constexpr int kLanes<math::Pack<T, N>> = N;

template <class T>
using Input = model::ModelInput<T, n>;

// One call's output. Structural zeros are never written.
template <class T>
struct Rows {
  T front[Model::kFront > 0 ? Model::kFront : 1] = {};
  T dense[n * Model::kDense] = {};
};

template <class T>
[[gnu::noinline]] void Regressor(const Input<T>& x, Rows<T>& rows) {
  Model::Regressor(x, static_cast<const T*>(nullptr), static_cast<const T*>(nullptr), static_cast<const T*>(nullptr),
                   static_cast<T*>(nullptr), rows.front, rows.dense);
}

// Independent numbers in [-3, 3]: every quadrant of every angle.
template <class T>
std::vector<Input<T>> RandomInputs(int count, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(-3, 3);
  std::vector<Input<T>> inputs(count);
  const auto fill = [&](T& v) {
    if constexpr (kLanes<T> == 1) v = static_cast<T>(any(random));
    else
      for (int lane = 0; lane < kLanes<T>; ++lane) v.Set(lane, static_cast<decltype(v[0])>(any(random)));
  };
  for (Input<T>& x : inputs) {
    for (int j = 0; j < n; ++j) fill(x.q[j]), fill(x.qd[j]), fill(x.qdd[j]), x.temp[j] = T(25);
    x.t = T(1), x.dt = T(0.008);
  }
  return inputs;
}

}  // namespace
}  // namespace armcal::bench

// bench - what the program's two files share: random joint states, a clock, and least squares over a log.
//
// Everything here belongs to this program alone. It must not meet the same code compiled with other flags.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <ctime>
#include <functional>
#include <random>
#include <string>
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

constexpr double kBlock_ns = 5e5;  // in shorter blocks the clock's own cost counts

// CPU time, because wall time also counts what else the machine does.
inline double CpuTime_ns() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return 1e9 * static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_nsec);
}

// Makes the compiler assume that the memory is read and written here.
inline void Touch(const void* p) { asm volatile("" : : "g"(p) : "memory"); }

struct Work {
  std::string name;
  std::function<void(int calls)> run;
  double per_call = 1;  // evaluations or samples in one call
  std::vector<double> time_ns = {};
  int calls = 0;

  double quantile(double share) const {
    std::vector<double> sorted = time_ns;
    std::sort(sorted.begin(), sorted.end());
    return sorted[static_cast<std::size_t>(share * static_cast<double>(sorted.size() - 1))];
  }
  double median_ns() const { return quantile(0.5); }
};

// Times `blocks` blocks of each work in turn, so that other load of the machine affects all of them alike.
inline void Measure(std::vector<Work*> works, int blocks) {
  const auto time_ns = [](const Work& w) {
    const double start = CpuTime_ns();
    w.run(w.calls);
    return CpuTime_ns() - start;
  };
  for (Work* w : works)
    for (w->calls = 1; time_ns(*w) < kBlock_ns;) w->calls *= 2;
  for (int b = 0; b < blocks; ++b)
    for (Work* w : works) w->time_ns.push_back(time_ns(*w) / (w->calls * w->per_call));
}

}  // namespace

// A log's columns, as a host program holds them. Shapes: [samples x joints].
struct Log {
  Eigen::MatrixXd q, qd, qdd, tau;
};
Log RandomLog(int samples, unsigned seed);

int Columns();  // filter coordinates

// Each returns the estimate, weight 1 for every row.
Eigen::VectorXd FusedGram(const Log& log);
// stored: [samples x joints rows x columns]; right: its torque. MakeStored makes both again at each call.
void MakeStored(const Log& log, Eigen::MatrixXd& stored, Eigen::VectorXd& right);
Eigen::VectorXd StoredNormal(const Eigen::MatrixXd& stored, const Eigen::VectorXd& right);
Eigen::VectorXd StoredHouseholder(Eigen::MatrixXd& stored, const Eigen::VectorXd& right);  // overwrites stored

}  // namespace armcal::bench

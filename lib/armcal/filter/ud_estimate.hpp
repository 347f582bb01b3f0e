// filter - an estimate x and its covariance U D U' in the order of a filter: the room for it, and its verbs.
#pragma once

#include "armcal/filter/factor_work.hpp"

namespace armcal::filter {

// Verbs as in factor.hpp and factor_work.hpp. Context: background.
template <class Order>
class UdEstimate {
 public:
  using Columns = Order;
  static constexpr int kSize = Order::kSize;
  static constexpr const auto& kShape = Order::kShape;
  using Work = FactorWork<Order::kForm>;

  // What the rows of a sample spend.
  static constexpr int kRowsCost = [] {
    int cost = 0;
    for (int i = 0; i < Order::kJoints; ++i)
      cost += Work::RowCost(Order::kShape, Order::kAt.first[i], Order::FrontOf(i));
    return cost;
  }();

  float& u(int i, int p) { return factor().column(p)[i]; }
  float& d(int p) { return factor().d(p); }
  float d(int p) const { return factor().d(p); }
  float& x(int p) { return number_[p]; }
  float x(int p) const { return number_[p]; }
  const float* elements() const { return factor().element(); }  // [Order::kElements]
  // P is the sum over positions p of d u u', u [kSize] by columns: fills in u, returns d.
  float Spread(int p, float* u) const {
    for (int k = 0; k < kSize; ++k) u[k] = 0.0f;
    for (int i = kShape.Begin(p); i < p; ++i) u[kShape.column[i]] = factor().column(p)[i];
    u[kShape.column[p]] = 1.0f;
    return d(p);
  }

  template <class Prior>
  void Start(const Prior& prior) {
    StartAtPrior(factor(), prior.dense_ud, prior.active);
  }
  template <class Prior>
  std::uint32_t HoldFloor(const Prior& prior) {
    return filter::HoldFloor(factor(), prior.link_floor, prior.active);
  }
  bool AddDiagonal(float* variance, int& next, int& credit) const {
    return filter::AddDiagonal(factor(), variance, next, credit);
  }

  float* row() { return factor().row(); }  // room for a row h, by positions
  void BeginRow(int first, int joint, float y, float variance, float gate_sigma) {
    work_.BeginRow(factor(), first, Order::FrontOf(joint), y, variance, gate_sigma);
  }
  bool StepRow(const std::uint32_t* considered, int& credit) { return work_.StepRow(factor(), considered, credit); }
  float innovation() const { return work_.innovation(); }
  float variance() const { return work_.variance(); }
  bool inside() const { return work_.inside(); }
  void BeginUnitSum(int p, float c, int last) { work_.BeginUnitSum(factor(), p, c, last); }
  bool StepSum(int& credit) { return work_.StepSum(factor(), credit); }
  void AddUnit(int p, float c, int last) {  // the whole sum
    BeginUnitSum(p, c, last);
    int all = kNoSlices;
    (void)StepSum(all);
  }

 private:
  // Who only reads it has a const estimate.
  Factor<Order::kForm> factor() const { return {&kShape, const_cast<float*>(number_)}; }

  float number_[3 * kSize + Order::kElements] = {};
  Work work_;
};

}  // namespace armcal::filter

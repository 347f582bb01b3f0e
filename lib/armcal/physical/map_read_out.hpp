// physical - the physical read-out: from a filter's result to the most probable bodies that can exist.
//
//   min over t of  (w(t) - w^)' P^-1 (w(t) - w^) / 2  -  w(t)' C^-1 w(t) / 2  +  |(t - t0) / sd|^2 / 2
//                  - eps / 2 sum logdet J(t) - eps / 2 sum log rotor,                      eps = 1, 0.1, 0.01
// t: (m, c, I about the centre, rotor) of each link, and the dense effects. w: the dense columns. w^ and P: the
// filter's mean and covariance. C: the covariance of its prior. J: the 4 x 4 pseudo-inertia (Wensing, Kim, Slotine
// 2018). The second term removes the filter's own prior, which is quadratic in w. The third term puts the table's prior
// in its place, which is quadratic in t. In the prior, front columns (friction) are independent of the bodies. So
// leaving them out of P is the same as minimising over them; they follow at the end.
//
// The method is Newton's. A step that leaves the cone or gains too little is halved. A step is straight in m, m c and I
// about the origin. In these the data are exactly quadratic and the barrier is convex, so sharp data do not make a
// curved valley. Only the prior is curved there; this is neglected.
#pragma once

#include "armcal/core/status.hpp"
#include "armcal/math/symmetric.hpp"
#include "armcal/physical/map_problem.hpp"

namespace armcal::physical {

// T: double, on a PC and on cores with a double FPU; float is too coarse for P^-1 - C^-1. Takes some 60 KB for six
// joints. Use: Begin, then AddSpread for every column of the filter's factor, then Step until it returns true. After
// the last AddSpread the filter may take rows again. Everything that MapPrior points to must not change until Step
// returns true. One Step costs at most some kFree^2 multiplications and additions, one AddSpread some kColumns^2.
// Context of every call: background.
template <class Layout, class T>
class MapReadOut {
 public:
  using Arm = MapArm<Layout, T>;
  static constexpr int kBodies = Arm::kBodies, kFree = Arm::kFree, kColumns = Layout::kColumns;
  static constexpr T kBarrier[] = {T(1), T(0.1), T(0.01)};  // eps, in units of chi^2
  static constexpr int kMostSteps = 100;

  using Result = MapResult<Layout, T>;

  // x [kColumns]: the filter's mean in prior units, prior included. warm: start at the last solution with the last eps;
  // only if the prior is the same. kUnphysical: see MapArm::Start. kNotFinite: x is not finite. On refusal the object
  // is as before.
  core::Status Begin(const MapPrior<Layout>& prior, const float* x, bool warm = false) {
    bool good = true;
    for (int k = 0; k < kColumns; ++k) good &= math::IsFinite(x[k]);
    if (!good) return core::Status::kNotFinite;
    Arm arm;
    if (!arm.Start(prior)) return core::Status::kUnphysical;

    arm_ = arm;
    for (T& u : trial_.u) u = T(0);
    arm_.Place(trial_);
    warm_ = warm && result_.converged;
    for (int k = 0; k < kColumns; ++k) x_[k] = T(x[k]);
    for (T& u : ud_) u = T(0);
    halvings_ = 0;
    Enter(Stage::kSpread);
    return core::Status::kOk;
  }

  // Adds to the filter's covariance in prior units: P += d column column'. Call it for every column of the filter's
  // factor, in any order. column [kColumns]. kNotFinite: a number is not finite, or d < 0. Then the read-out cannot go
  // on, and result() is the last one. kNotFinite also if it is called before Begin, or after the first Step.
  core::Status AddSpread(float d, const float* column) {
    bool good = math::IsFinite(d) && d >= 0.0f;
    for (int k = 0; k < kColumns; ++k) {
      good &= math::IsFinite(column[k]);
      spread_[k] = T(column[k]);
    }
    if (!good) Enter(Stage::kDone);
    if (stage_ != Stage::kSpread) return core::Status::kNotFinite;
    math::UdAdd<kColumns>(ud_, T(d), spread_);
    ++next_;
    return core::Status::kOk;
  }
  // A number of the caller's: which estimate it has begun with.
  void SetSource(std::uint32_t number) { source_ = number; }
  std::uint32_t source() const { return source_; }
  // Columns that AddSpread has taken since Begin; 0 from the first Step on.
  int spreads() const { return stage_ == Stage::kSpread ? next_ : 0; }

  // One bounded slice. Returns true when the read-out is done and result() holds it.
  bool Step() {
    const int k = next_++;
    switch (stage_) {
      case Stage::kSpread:
        if (!warm_) point_ = trial_;
        level_ = warm_ ? kLast : 0;
        result_ = Result{};
        information_.Clear();
        for (T& g : gradient_) g = T(0);
        Enter(Stage::kData);
        return false;
      case Stage::kData:
        information_.AddRow(k, arm_.prior(), x_, ud_, gradient_);
        if (next_ == DataInformation<Layout, T>::kRows) Enter(Stage::kStart);
        return false;
      case Stage::kStart:
        for (int i = 0; i < kFree; ++i) change_[i] = Shift(i);
        information_.Times(change_, turned_);
        for (int i = 0; i < kFree; ++i) gradient_[i] += turned_[i];
        Enter(Stage::kColumn);
        return false;
      case Stage::kColumn:
        MakeOrFactor(k, kBarrier[level_]);
        if (next_ == 2 * kFree) Enter(Stage::kLower);
        return false;
      case Stage::kLower:
        math::SolveLower<kFree>(factor_, step_);
        Enter(Stage::kUpper);
        return false;
      case Stage::kUpper:
        math::SolveUpper<kFree>(factor_, step_);
        Enter(Stage::kTrial);
        return false;
      case Stage::kTrial:
        Try(halvings_);
        Enter(Stage::kWeigh);
        return false;
      case Stage::kWeigh:
        Weigh();
        return false;
      case Stage::kCurvature:
        MakeOrFactor(k, T(0));
        if (next_ == 2 * kFree) Enter(Stage::kBody);
        return false;
      case Stage::kBody:
        ReadBody(k);
        if (next_ == kBodies) Enter(Stage::kColumnRead);
        return false;
      case Stage::kColumnRead:
        ReadColumn(k);
        if (next_ == kColumns) Enter(Stage::kDone);
        return false;
      case Stage::kDone:
        break;
    }
    return true;
  }

  const Result& result() const { return result_; }

 private:
  // clang-format off
  enum class Stage : std::uint8_t {
    kSpread, kData, kStart, kColumn, kLower, kUpper, kTrial, kWeigh, kCurvature, kBody, kColumnRead, kDone
  };
  // clang-format on
  static constexpr int kLast = 2;  // of kBarrier
  // The prior's curvature is 1 in every direction, and data only add to it. So a smaller pivot is the filter's
  // rounding.
  static constexpr T kLeastPivot = T(0.5);

  void Enter(Stage stage) {
    stage_ = stage;
    next_ = 0;
  }

  // y of point_ (see DataInformation).
  T Shift(int i) const { return i < kBodies ? point_.body[i] - T(arm_.prior().body[i]) : point_.u[i]; }

  // A column of the Hessian takes two slices.
  void MakeOrFactor(int slice, T eps) {
    const int k = slice / 2;
    if (slice % 2 == 0) MakeColumn(k, eps);
    else math::CholeskyColumn(factor_, k, kLeastPivot, factor_ + math::UdIndex(0, k));
  }

  // Makes column k of the Hessian, where the factor's column will stand, and sets entry k of minus the gradient.
  void MakeColumn(int k, T eps) {
    T* column = factor_ + math::UdIndex(0, k);
    const int begin = k < kBodies ? k / Arm::kBlock * Arm::kBlock : k;
    const int end = k < kBodies ? begin + Arm::kBlock : k + 1;
    T push[Arm::kBlock] = {T(1)}, slope = T(0);
    if (k < kBodies) arm_.Push(point_, k, push);
    for (int c = begin; c < end; ++c) slope += gradient_[c] * push[c - begin];
    for (int i = 0; i < end; ++i) {
      change_[i] = T(0);
      for (int c = begin; c < end; ++c) change_[i] += information_.at(i, c) * push[c - begin];
    }
    arm_.ToFree(point_, k < kBodies ? k / Arm::kBlock + 1 : Arm::kLinks, change_);
    for (int i = 0; i <= k; ++i) column[i] = change_[i];
    slope += arm_.AddCurvature(point_, eps, k, column);
    step_[k] = slope_[k] = -slope;
  }

  // Makes the trial point of the step, halved `halvings` times, and what barrier and prior change there.
  void Try(int halvings) {
    share_ = T(1);
    for (int i = 0; i < halvings; ++i) share_ *= T(0.5);
    cost_ = T(0);
    arm_.Step(point_, share_, step_, trial_);
    inside_ = arm_.AddBarrierChange(point_, trial_, cost_);
    cost_ *= T(0.5) * kBarrier[level_];
    for (int i = 0; i < kFree; ++i) {
      const T moved = trial_.u[i] - point_.u[i];
      change_[i] = i < kBodies ? trial_.body[i] - point_.body[i] : moved;
      if (i < kBodies) cost_ += moved * (point_.u[i] + T(0.5) * moved);
    }
  }

  // Adds what the data change there. The step is taken, or halved once more, or given up. Then enters the next stage.
  void Weigh() {
    constexpr T kGain = T(1e-4);                        // a gain is at least this share of the expected decrease
    constexpr T kEnough = T(0.1), kNothing = T(1e-10);  // expected decrease at which an eps ends; the same, last eps
    constexpr T kConverged = T(1e-4);
    constexpr int kMostHalvings = 30;
    T expected = T(0);
    for (int i = 0; i < kFree; ++i) expected += slope_[i] * step_[i];
    information_.Times(change_, turned_);
    for (int i = 0; i < kFree; ++i) cost_ += change_[i] * (gradient_[i] + T(0.5) * turned_[i]);
    const bool last = level_ == kLast, gain = inside_ && cost_ < -kGain * share_ * expected;
    const bool enough = expected <= (last ? kNothing : kEnough);
    if (gain) {
      for (int i = 0; i < kFree; ++i) gradient_[i] += turned_[i];
      point_ = trial_;
    }
    result_.steps += gain;
    if (!gain && !enough && halvings_ < kMostHalvings) {
      ++halvings_;
      return Enter(Stage::kTrial);
    }
    halvings_ = 0;
    if (gain && !enough && result_.steps < kMostSteps) return Enter(Stage::kColumn);
    result_.barrier = kBarrier[level_];
    result_.converged = expected <= kConverged;
    level_ += !last;
    Enter(last ? Stage::kCurvature : Stage::kColumn);
  }

  // The standard deviation of a quantity with gradient g over u. g is overwritten.
  T Deviation(T* g) const {
    math::SolveLower<kFree>(factor_, g);
    T square = T(0);
    for (int i = 0; i < kFree; ++i) square += g[i] * g[i];
    return math::Sqrt(square);
  }

  void ReadBody(int k) {
    for (T& g : change_) g = T(0);
    change_[k] = arm_.sd(k);
    result_.body[k] = point_.body[k];
    result_.body_sd[k] = Deviation(change_);
    result_.Learn(point_.u[k], result_.body_sd[k], arm_.sd(k));
  }

  void ReadColumn(int k) {
    constexpr int kFront = Layout::kFront;
    T row[Layout::kDense] = {}, value = T(0), variance = T(0);
    if (k < kFront) FrontGivenDense<Layout>(x_, ud_, k, row, value, variance);
    else row[k - kFront] = T(1);
    RowOfBodies<Layout>(arm_.prior().scale, row, change_);
    for (int i = 0; i < kFree; ++i) value += change_[i] * Shift(i);
    arm_.ToFree(point_, Arm::kLinks, change_);
    const T sd = Deviation(change_), scale = T(arm_.prior().scale[k]);
    result_.column[k] = T(arm_.prior().column[k]) + scale * value;
    result_.column_sd[k] = scale * math::Sqrt(variance + sd * sd);
    if (k < kFront || k >= kFront + Layout::kRigid) result_.Learn(value, result_.column_sd[k], scale);
  }

  Arm arm_;
  T x_[kColumns] = {}, spread_[kColumns] = {};
  T ud_[math::UdSize(kColumns)] = {};  // the filter's covariance in the order [front, dense]
  DataInformation<Layout, T> information_;
  T gradient_[kFree] = {};              // of the data term over y, at point_
  T factor_[math::UdSize(kFree)] = {};  // of the Hessian over u
  T step_[kFree] = {}, slope_[kFree] = {}, change_[kFree] = {}, turned_[kFree] = {};
  MapPoint<Layout, T> point_, trial_;
  Result result_;
  T share_ = T(1), cost_ = T(0);  // of the step that is tried
  int next_ = 0, level_ = 0, halvings_ = 0;
  std::uint32_t source_ = 0;
  bool warm_ = false, inside_ = false;
  Stage stage_ = Stage::kDone;
};

}  // namespace armcal::physical

// plant - reads and computes what the torque's reading undergoes.
#include "host_sim/machine/plant/reading_effects.hpp"

#include <cmath>
#include <deque>

namespace armcal::plant {
namespace {

// A shunt or a sensor whose scale is wrong.
class Gain : public ReadingEffect {
 public:
  explicit Gain(const io::TomlReader& keys) : error_(keys.Number("error")) {}
  double Pass(double torque, double, double, double) override { return torque * (1 + error_); }
  std::unique_ptr<ReadingEffect> Copy() const override { return std::make_unique<Gain>(*this); }

 private:
  double error_;
};

// The zero of an amplifier that warms up, and breathes with the fan of its cabinet.
class ZeroDrift : public ReadingEffect {
 public:
  explicit ZeroDrift(const io::TomlReader& keys)
      : torque_Nm_(keys.Number("torque_Nm")),
        time_s_(keys.Positive("time_constant_s")),
        swing_Nm_(keys.Number("swing_Nm", 0)),
        swing_s_(keys.Positive("swing_s", 20)) {}
  double Pass(double torque, double, double since_s, double) override {
    return torque - torque_Nm_ * std::expm1(-since_s / time_s_) + swing_Nm_ * std::sin(2 * M_PI * since_s / swing_s_);
  }
  std::unique_ptr<ReadingEffect> Copy() const override { return std::make_unique<ZeroDrift>(*this); }

 private:
  double torque_Nm_, time_s_, swing_Nm_, swing_s_;
};

// Two phase sensors of unequal zero and scale: the reading ripples once and twice in an electrical turn.
class PhaseSensors : public ReadingEffect {
 public:
  explicit PhaseSensors(const io::TomlReader& keys)
      : pole_pairs_(keys.Positive("pole_pairs")),
        zero_Nm_(keys.NotNegative("zero_Nm", 0)),
        scale_(keys.NotNegative("scale_error", 0)) {}
  double Pass(double torque, double, double, double motor_angle_rad) override {
    const double angle = pole_pairs_ * motor_angle_rad;
    return torque * (1 + scale_ * std::cos(2 * angle)) + zero_Nm_ * std::cos(angle);
  }
  std::unique_ptr<ReadingEffect> Copy() const override { return std::make_unique<PhaseSensors>(*this); }

 private:
  double pole_pairs_, zero_Nm_, scale_;
};

// A converter that ends before the torque does.
class ConverterEnd : public ReadingEffect {
 public:
  explicit ConverterEnd(const io::TomlReader& keys) : limit_Nm_(keys.Positive("limit_Nm")) {}
  double Pass(double torque, double, double, double) override { return torque; }
  double limit_Nm() const override { return limit_Nm_; }
  std::unique_ptr<ReadingEffect> Copy() const override { return std::make_unique<ConverterEnd>(*this); }

 private:
  double limit_Nm_;
};

// The reading waits in the wire: a queue of whole ticks.
class Wire : public ReadingEffect {
 public:
  explicit Wire(const io::TomlReader& keys) : late_s_(keys.Positive("late_s")) {}
  double Pass(double torque, double tick_s, double, double) override {
    queue_.push_back(torque);
    if (static_cast<double>(queue_.size()) > late_s_ / tick_s + 1.5) queue_.pop_front();
    return queue_.front();
  }
  std::unique_ptr<ReadingEffect> Copy() const override { return std::make_unique<Wire>(*this); }

 private:
  double late_s_;
  std::deque<double> queue_;
};

// The current loop reports a smoothed torque: one or two first-order lags, exact for a torque held over the tick.
class Smoothing : public ReadingEffect {
 public:
  explicit Smoothing(const io::TomlReader& keys)
      : lag_s_(keys.Positive("lag_s")), stages_(static_cast<int>(keys.Integer("stages", 1, 2, 1))) {}
  double Pass(double torque, double tick_s, double, double) override {
    if (!began_) held_[0] = held_[1] = torque;  // as if the torque had been so before
    began_ = true;
    const double rest = std::exp(-tick_s / lag_s_);
    for (int i = 0; i < stages_; ++i) torque = held_[i] = torque + (held_[i] - torque) * rest;
    return torque;
  }
  std::unique_ptr<ReadingEffect> Copy() const override { return std::make_unique<Smoothing>(*this); }

 private:
  double lag_s_;
  int stages_;
  double held_[2] = {0, 0};
  bool began_ = false;
};

template <class Effect>
std::unique_ptr<ReadingEffect> Read(const io::TomlReader& keys) {
  return std::make_unique<Effect>(keys);
}

}  // namespace

const ReadingEffectReaders& AllReadingEffects() {
  static const ReadingEffectReaders readers{{"torque_gain_error", Read<Gain>},
                                            {"torque_drift", Read<ZeroDrift>},
                                            {"current_ripple", Read<PhaseSensors>},
                                            {"torque_saturation", Read<ConverterEnd>},
                                            {"time_delay", Read<Wire>},
                                            {"torque_filter", Read<Smoothing>}};
  return readers;
}

}  // namespace armcal::plant

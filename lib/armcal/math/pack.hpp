// math - several samples side by side as one scalar, for the vector units of a PC; no firmware includes it.
//
// A generated model runs on a Pack as on any scalar. Pack<double, 8> and Pack<float, 16> fill one 512-bit register;
// narrower machines use two or four registers and give the same bits. Every operation acts on each lane by itself, and
// a comparison gives a mask for each lane, so nothing branches.
#pragma once

#include <cmath>
#include <cstdint>
#include <type_traits>

#include "armcal/math/elementary.hpp"

namespace armcal::math {

template <class T, int N>
struct Pack {
  static constexpr int kLanes = N;
  typedef T Lanes __attribute__((vector_size(N * sizeof(T))));
  using Bits = decltype(Lanes{} < Lanes{});
  struct Mask {
    Bits bits;  // all ones where a condition holds
  };

  Lanes lane;

  Pack() = default;
  explicit Pack(const Lanes& lanes) : lane(lanes) {}
  template <class S, class = std::enable_if_t<std::is_arithmetic_v<S>>>
  Pack(S x) : lane(static_cast<T>(x) - Lanes{}) {}  // the same value in every lane

  T operator[](int i) const { return lane[i]; }
  void Set(int i, T x) { lane[i] = x; }

  friend Pack operator+(const Pack& a, const Pack& b) { return Pack(a.lane + b.lane); }
  friend Pack operator-(const Pack& a, const Pack& b) { return Pack(a.lane - b.lane); }
  friend Pack operator*(const Pack& a, const Pack& b) { return Pack(a.lane * b.lane); }
  friend Pack operator/(const Pack& a, const Pack& b) { return Pack(a.lane / b.lane); }
  friend Pack operator-(const Pack& a) { return Pack(-a.lane); }
  Pack& operator+=(const Pack& b) { return lane += b.lane, *this; }
  Pack& operator-=(const Pack& b) { return lane -= b.lane, *this; }
  Pack& operator*=(const Pack& b) { return lane *= b.lane, *this; }
  friend Mask operator<(const Pack& a, const Pack& b) { return {a.lane < b.lane}; }
  friend Mask operator>(const Pack& a, const Pack& b) { return {a.lane > b.lane}; }
  friend Mask operator<=(const Pack& a, const Pack& b) { return {a.lane <= b.lane}; }
  friend Mask operator>=(const Pack& a, const Pack& b) { return {a.lane >= b.lane}; }
  friend Pack Select(const Mask& mask, const Pack& yes, const Pack& no) { return Pack(mask.bits ? yes.lane : no.lane); }

  // The functions that elementary.hpp calls for a scalar that is not float.
  friend Pack abs(const Pack& x) {
    return Each(x, [](T v) { return std::abs(v); });
  }
  friend Pack sqrt(const Pack& x) {
    return Each(x, [](T v) { return std::sqrt(v); });
  }
  friend Pack exp(const Pack& x) {
    return Each(x, [](T v) { return math::Exp(v); });
  }
  friend Pack log(const Pack& x) {
    return Each(x, [](T v) { return math::Log(v); });
  }
  friend Pack tanh(const Pack& x) {
    return Each(x, [](T v) { return math::Tanh(v); });
  }
  friend Pack cbrt(const Pack& x) {
    return Each(x, [](T v) { return math::Cbrt(v); });
  }

  // float: the bits of SinCos(float). double: |x| <= 1e5, absolute error < 2.3e-16.
  friend void SinCos(const Pack& x, Pack& s, Pack& c) {
    if constexpr (std::is_same_v<T, double>) {
      SinCosDouble(x.lane, s.lane, c.lane);
    } else {
      for (int i = 0; i < N; ++i) {
        T si, ci;
        math::SinCos(x.lane[i], si, ci);
        s.lane[i] = si, c.lane[i] = ci;
      }
    }
  }

 private:
  template <class F>
  static Pack Each(const Pack& x, F f) {
    Pack y;
    for (int i = 0; i < N; ++i) y.lane[i] = f(x.lane[i]);
    return y;
  }

  // Reduces as SinCos(float) does, with three parts of pi/2. The first two have 33 bits, so k < 2^20 times them is
  // exact.
  static void SinCosDouble(const Lanes& x, Lanes& s, Lanes& c) {
    constexpr double kRound = 6755399441055744.0;  // 1.5 * 2^52: x + kRound holds round(x) in its low bits
    const Lanes shifted = x * 0.63661977236758138 + kRound;
    const Bits quadrant = reinterpret_cast<Bits>(shifted);
    const Lanes k = shifted - kRound;
    const Lanes r = ((x - k * 1.5707963267341256) - k * 6.077100506303966e-11) - k * 2.0222662487959074e-21;
    const Lanes z = r * r;
    const Lanes sin_p =
        -0.16666666666666666 +
        z * (0.008333333333330948 +
             z * (-0.00019841269836756774 +
                  z * (2.7557316101617874e-06 + z * (-2.5051131650235181e-08 + z * 1.5918115263265974e-10))));
    const Lanes cos_p =
        0.041666666666666664 +
        z * (-0.0013888888888887398 +
             z * (2.4801587298764561e-05 +
                  z * (-2.7557317271145144e-07 + z * (2.087614614655861e-09 + z * -1.1382623647474604e-11))));
    const Lanes sin_r = r + r * z * sin_p;
    // 1 - z/2 loses some bits. The loss is known exactly, and is added together with the small terms.
    const Lanes half = 0.5 * z, one = 1.0 - half;
    const Lanes cos_r = one + (((1.0 - one) - half) + z * z * cos_p);
    const Bits odd = (quadrant & 1) != 0;
    const Lanes sin_x = odd ? cos_r : sin_r, cos_x = odd ? sin_r : cos_r;
    const Bits sin_sign = (quadrant & 2) << 62, cos_sign = ((quadrant + 1) & 2) << 62;
    s = reinterpret_cast<Lanes>(reinterpret_cast<Bits>(sin_x) ^ sin_sign);
    c = reinterpret_cast<Lanes>(reinterpret_cast<Bits>(cos_x) ^ cos_sign);
  }
};

}  // namespace armcal::math

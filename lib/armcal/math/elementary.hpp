// math - elementary functions that give the same bits on every target.
//
// For float, and for Log of a double, the functions are written here: without a branch and without a library call
// (std::sqrt is one instruction with -fno-math-errno). NaN in gives NaN out. For any other scalar they call the
// function that argument-dependent lookup or std:: finds. So double, long double and counting scalars run the same
// generated code. The polynomials are weighted minimax fits made for this file. Each error below is the largest over
// the stated range; tests/unit/math checks it against long double. Context: any.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#include <type_traits>
#include <utility>

// Contraction (-ffp-contract=fast, which is GCC's default) changes bits, too. No compiler tells a program of it:
// whoever builds a table asks Contracts in mul_add.hpp.
#ifdef __FAST_MATH__
#error "armcal needs exact IEEE arithmetic: argument reduction and the NaN checks fail under -ffast-math"
#endif

namespace armcal::math {

inline std::uint32_t BitsOf(float x) {
  std::uint32_t b;
  std::memcpy(&b, &x, sizeof b);
  return b;
}
inline float FloatOf(std::uint32_t b) {
  float x;
  std::memcpy(&x, &b, sizeof x);
  return x;
}
// All ones if the condition holds. Kernels choose by mask, never by branch.
constexpr std::uint32_t MaskOf(bool condition) { return 0u - static_cast<std::uint32_t>(condition); }
inline float Masked(float x, std::uint32_t mask) { return FloatOf(BitsOf(x) & mask); }  // x or +0, even for NaN
inline float Select(bool condition, float yes, float no) {
  const std::uint32_t m = MaskOf(condition);
  return FloatOf((BitsOf(yes) & m) | (BitsOf(no) & ~m));
}
template <class T>
T Select(bool condition, const T& yes, const T& no) {
  return condition ? yes : no;
}
inline bool IsFinite(float x) { return (BitsOf(x) & 0x7F800000u) != 0x7F800000u; }

namespace internal {
template <class T>  // false: a pack (pack.hpp), whose comparisons give one answer a lane
constexpr bool kIsOne = std::is_same_v<decltype(std::declval<T>() < std::declval<T>()), bool>;
}  // namespace internal

template <class T>
constexpr T Min(const T& a, const T& b) {
  if constexpr (internal::kIsOne<T>) return b < a ? b : a;
  else return Select(b < a, b, a);
}
template <class T>
constexpr T Max(const T& a, const T& b) {
  if constexpr (internal::kIsOne<T>) return a < b ? b : a;
  else return Select(a < b, b, a);
}
inline float Sign(float x) {  // -1, 0, 1; 0 for NaN
  const std::uint32_t magnitude = BitsOf(x) & 0x7FFFFFFFu;
  const std::uint32_t nonzero = (magnitude + 0x7FFFFFFFu) >> 31, is_nan = (0x7F800000u - magnitude) >> 31;
  return FloatOf((0x3F800000u | (BitsOf(x) & 0x80000000u)) & (0u - (nonzero & ~is_nan)));
}
template <class T>
T Sign(const T& x) {
  if constexpr (internal::kIsOne<T>) return T(static_cast<float>((x > T(0)) - (x < T(0))));
  else return Select(x > T(0), T(1), Select(x < T(0), T(-1), T(0)));
}
inline float Abs(float x) { return FloatOf(BitsOf(x) & 0x7FFFFFFFu); }
template <class T>
T Abs(const T& x) {
  using std::abs;
  return abs(x);
}
template <class T>
T Sqrt(const T& x) {
  using std::sqrt;
  return sqrt(x);
}

// a / b, and 0 where |b| < 1e-30 (a NaN in b stays NaN).
template <class T>
T Divide(const T& a, const T& b) {
  const auto tiny = Abs(b) < T(1e-30f);
  return Select(tiny, T(0), a / Select(tiny, T(1), b));
}

namespace internal {
constexpr float kRound = 12582912.0f;  // 1.5 * 2^23: x + kRound holds round(x) in its low bits, |x| < 2^22
}  // namespace internal

// s = sin x, c = cos x. float: |x| <= 1000, absolute error < 1.2e-7; beyond, the error grows with |x|.
inline void SinCos(float x, float& s, float& c) {
  // k multiples of pi/2; the first two parts of pi/2 have 12 and 13 bits, so k < 2^10 times them is exact.
  const float shifted = x * 0.6366197724f + internal::kRound;
  const std::uint32_t quadrant = BitsOf(shifted);
  const float k = shifted - internal::kRound;
  const float r = ((x - k * 1.5703125f) - k * 0.000483810902f) - k * 1.589325477e-08f;
  const float z = r * r;
  const float sin_r = r + r * z * (-0.1666665494f + z * (0.008332177588f + z * -0.0001951722092f));
  const float cos_r = (1.0f - 0.5f * z) + z * z * (0.04166664685f + z * (-0.001388736678f + z * 2.4438364e-05f));
  const bool odd = (quadrant & 1u) != 0;
  s = FloatOf(BitsOf(Select(odd, cos_r, sin_r)) ^ ((quadrant & 2u) << 30));
  c = FloatOf(BitsOf(Select(odd, sin_r, cos_r)) ^ (((quadrant + 1u) & 2u) << 30));
}
template <class T>
void SinCos(const T& x, T& s, T& c) {
  using std::cos;
  using std::sin;
  s = sin(x);
  c = cos(x);
}

// Shapes: x, s, c [N]. One loop that a compiler can turn into vectors.
template <int N, class T>
void SinCosBlock(const T* x, T* s, T* c) {
  for (int i = 0; i < N; ++i) SinCos(x[i], s[i], c[i]);
}

// float: relative error < 2e-7 for -87 <= x <= 88; 0 below, exp(88) above.
inline float Exp(float x) {
  const float clamped = Select(x < -87.0f, -87.0f, Select(x > 88.0f, 88.0f, x));
  const float shifted = clamped * 1.442695041f + internal::kRound;
  const float k = shifted - internal::kRound;
  const float r = (clamped - k * 0.6931152344f) - k * 3.194618495e-05f;
  const float p =
      0.5000000096f + r * (0.1666651851f + r * (0.04166620478f + r * (0.008368928792f + r * 0.001395055945f)));
  const float scale = FloatOf((BitsOf(shifted) + 127u) << 23);  // 2^k
  return Masked((1.0f + (r + r * r * p)) * scale, ~MaskOf(x < -87.0f));
}
template <class T>
T Exp(const T& x) {
  using std::exp;
  return exp(x);
}

// float: absolute error < 6e-8 + 1.2e-7 |log x| for x >= 1.18e-38; below (0 and negative too) the value there, -87.3.
inline float Log(float x) {
  constexpr float kSmallest = 1.17549435e-38f;
  const std::uint32_t bits = BitsOf(Select(x < kSmallest, kSmallest, x));
  const std::uint32_t offset = bits - 0x3F3504F3u;  // exponent of x / sqrt(1/2)
  const float e = static_cast<float>(static_cast<std::int32_t>(offset) >> 23);
  const float f = FloatOf((offset & 0x007FFFFFu) + 0x3F3504F3u) - 1.0f;  // sqrt(1/2) - 1 <= f < sqrt(2) - 1
  const float a =
      0.1421797390f + f * (-0.1238393205f + f * (0.1187806861f + f * (-0.1179440181f + f * 0.06908686115f)));
  const float p = 0.3333331004f + f * (-0.2499998688f + f * (0.200022573f + f * (-0.1666925259f + f * a)));
  const float low = f * f * (f * p - 0.5f) + e * 3.194618495e-05f;
  return (f + low) + e * 0.6931152344f + Masked(x, MaskOf(!IsFinite(x)));  // infinity and NaN pass through
}
// double, for cores with a double FPU: relative error < 5e-16 for x >= 2.3e-308; below (0 and negative too) the value
// there, -708.4.
inline double Log(double x) {
  constexpr double kSmallest = 2.2250738585072014e-308;
  const double y = x < kSmallest ? kSmallest : x;
  std::uint64_t bits;
  std::memcpy(&bits, &y, sizeof bits);
  const std::uint64_t offset = bits - 0x3FE6A09E667F3BCDu;  // exponent of x / sqrt(1/2)
  const double e = static_cast<double>(static_cast<std::int32_t>(static_cast<std::uint32_t>(offset >> 32)) >> 20);
  bits = (offset & 0x000FFFFFFFFFFFFFu) + 0x3FE6A09E667F3BCDu;
  double mantissa;
  std::memcpy(&mantissa, &bits, sizeof mantissa);
  // log(1 + f) = 2 artanh(s), s = f / (2 + f), |s| < 0.1716: a series of odd powers, cut where it is below a rounding.
  const double f = mantissa - 1.0, s = f / (2.0 + f), z = s * s;
  constexpr double kOdd[] = {1.0 / 21, 1.0 / 19, 1.0 / 17, 1.0 / 15, 1.0 / 13,
                             1.0 / 11, 1.0 / 9,  1.0 / 7,  1.0 / 5,  1.0 / 3};
  double series = 1.0 / 23;
  for (const double odd : kOdd) series = series * z + odd;
  // 2 s = f - s f exactly, so that f, which has no error, is the leading term.
  const double low = s * (2.0 * z * series - f) + e * 1.9082149292705877e-10;
  const double beyond = y <= 1.7976931348623157e308 ? 0.0 : y;  // infinity and NaN pass through
  return (f + low) + e * 0.69314718036912382 + beyond;
}
template <class T>
T Log(const T& x) {
  using std::log;
  return log(x);
}

// x^y for x > 0. For x <= 0 the result is 0, also if y is 0. float: relative error < (2 + |y log x|) 2e-7.
template <class T>
T Pow(const T& x, const T& y) {
  return Select(x > T(0), Exp(y * Log(x)), x * T(0));
}

// float: relative error < 3e-7.
inline float Tanh(float x) {
  const float a = Abs(x);
  const float z = a * a;
  const float near = a + a * z *
                             (-0.3333328022f +
                              z * (0.1333138368f + z * (-0.05373400263f + z * (0.0206181303f + z * -0.005679312377f))));
  const float e = Exp(-2.0f * a);
  const float far = (1.0f - e) / (1.0f + e);
  return FloatOf(BitsOf(Select(a < 0.625f, near, far)) | (BitsOf(x) & 0x80000000u));
}
template <class T>
T Tanh(const T& x) {
  using std::tanh;
  return tanh(x);
}

// float: relative error < 3e-7 for 1e-37 <= |x| <= 1e38; 0 for 0.
inline float Cbrt(float x) {
  const float a = Abs(x);
  float y = FloatOf(BitsOf(a) / 3u + 709957000u);  // a third of the exponent: 4 % off at most
  for (int i = 0; i < 2; ++i) {                    // Halley: the error to the third power each time
    const float cube = y * y * y;
    y = y * ((cube + 2.0f * a) / (2.0f * cube + a));
  }
  y = Masked(y, MaskOf(!(a < 1e-37f)));
  return FloatOf(BitsOf(y) | (BitsOf(x) & 0x80000000u));
}
template <class T>
T Cbrt(const T& x) {
  using std::cbrt;
  return cbrt(x);
}

}  // namespace armcal::math

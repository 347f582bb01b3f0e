// tests - the elementary functions over their stated range, through all exponents, and at the ends of float.
#include <limits>

#include "armcal/math/mul_add.hpp"
#include "port/runner/line.hpp"
#include "tests/target/numbers.hpp"

using namespace armcal::math;    // NOLINT: all of it is under test
using namespace armcal::target;  // NOLINT: the bench of these programs
using armcal::port::runner::Line;

namespace {

constexpr int kLines = 16, kPoints = 2048;  // a line

// f at points spread evenly over the bit patterns from lower to upper (so over the exponents), and at their negatives.
template <class F>
void Sweep(const char* name, float lower, float upper, F f) {
  const std::uint32_t first = BitsOf(lower), step = (BitsOf(upper) - first) / (kLines * kPoints);
  for (int line = 0; line < kLines; ++line) {
    Digest digest;
    for (int k = 0; k < kPoints; ++k) {
      const float x = FloatOf(first + step * static_cast<std::uint32_t>(line * kPoints + k));
      f(x, digest);
      f(-x, digest);
    }
    Line(name).Decimal(line).Hex(digest.value()).End();
  }
}

// One function at the ends of float.
template <class F>
void Ends(const char* name, F f) {
  using Float = std::numeric_limits<float>;
  Line line(name);
  for (const float x : {0.0f, Float::denorm_min(), Float::min(), Float::max(), Float::infinity()})
    line.Hex(ResultBits(f(x))).Hex(ResultBits(f(-x)));
  line.Hex(ResultBits(f(Float::quiet_NaN()))).End();
}

template <class F>
void One(const char* name, float lower, float upper, F f) {
  Sweep(name, lower, upper, [&](float x, Digest& digest) { digest.Add(f(x)); });
  Ends(name, f);
}

template <class F>
void Two(const char* name, float lower, float upper, F f) {
  Numbers numbers(5);
  Sweep(name, lower, upper, [&](float x, Digest& digest) { digest.Add(f(x, numbers.Between(-3.0f, 3.0f))); });
}

}  // namespace

int Program() {
  Sweep("sincos", 1e-6f, 1000.0f, [](float x, Digest& digest) {
    float s, c;
    SinCos(x, s, c);
    digest.Add(s);
    digest.Add(c);
  });
  One("exp", 1e-6f, 88.0f, [](float x) { return Exp(x); });
  One("log", 1.18e-38f, 3.4e38f, [](float x) { return Log(x); });
  One("tanh", 1e-6f, 20.0f, [](float x) { return Tanh(x); });
  One("cbrt", 1e-37f, 1e38f, [](float x) { return Cbrt(x); });
  One("sqrt", 1e-37f, 1e38f, [](float x) { return Sqrt(Abs(x)); });
  One("sign", 1e-37f, 1e38f, [](float x) { return Sign(x); });
  Two("pow", 1e-10f, 1e10f, [](float x, float y) { return Pow(x, y); });
  Two("divide", 1e-35f, 1e35f, [](float x, float y) { return Divide(y, x); });
  Two("min_max", 1e-6f, 10.0f, [](float x, float y) { return Min(x, y) - Max(y, x * 0.5f); });
  Two("mul_add", 1e-6f, 10.0f, [](float x, float y) { return MulAdd(x, y, -x * 3.0f); });
  return 0;
}

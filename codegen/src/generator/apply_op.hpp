// generator - what each operation computes, for any scalar; included by graph.hpp.
#pragma once

#include <cmath>

namespace armcal::codegen {

template <class T>
inline __attribute__((always_inline)) T ApplyOp(Op op, T a, T b) {
  using std::abs, std::cbrt, std::cos, std::exp, std::log, std::pow, std::sin, std::sqrt, std::tanh;
  switch (op) {
    case Op::kNegate:
      return -a;
    case Op::kAdd:
      return a + b;
    case Op::kSubtract:
      return a - b;
    case Op::kMultiply:
      return a * b;
    case Op::kDivide:
      return b == T(0) ? T(0) : a / b;
    case Op::kSin:
      return sin(a);
    case Op::kCos:
      return cos(a);
    case Op::kExp:
      return exp(a);
    case Op::kLog:
      return log(a);
    case Op::kTanh:
      return tanh(a);
    case Op::kCbrt:
      return cbrt(a);
    case Op::kSqrt:
      return sqrt(a);
    case Op::kAbs:
      return abs(a);
    case Op::kSign:
      return T((a > T(0)) - (a < T(0)));
    case Op::kMin:
      return b < a ? b : a;
    case Op::kMax:
      return a < b ? b : a;
    case Op::kPow:
      return a > T(0) ? pow(a, b) : T(0);
    case Op::kConstant:
    case Op::kInput:
      break;
  }
  return T(0);
}

}  // namespace armcal::codegen

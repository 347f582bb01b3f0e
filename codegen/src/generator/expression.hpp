// generator - reads the text of an expression into a graph.
//
// Grammar: + - * / ^ ( ), numbers, names, name[index], functions. Total: division by zero gives zero, log and sqrt see
// only what is above zero, pow(x, y) needs x >= 0 (x^2, x^3, x^4 take any x). Functions:
//   abs sign sgn sin cos exp log tanh sqrt cbrt  min max pow  clamp(x, lo, hi)  step(x) (0 below, 1 above)  sech(x)
//   bspline(x, lo, hi, i, n): the i-th (0..n-1) of n cubic B-splines on [lo, hi], x clamped to that range
// Functions with memory; each keeps states from sample to sample, all exact for an input held over the sample and
// stable for every step; `dt` is the time since the sample before:
//   previous(x)           x one sample ago (at the first sample x itself)
//   lowpass(x, T)         first order, time constant T > 0
//   spring_stretch(x, w0, zeta)  how far a mass that follows x on a spring and a damper is ahead of x, 0 <= zeta < 1
//   spring_rate(x, w0, zeta)  that mass's speed
//   play(x, gap)          play operator: follows x once it has moved gap/2 away
//   delay(x, d, n)        x a time d ago, 0 <= d <= n dt, linear between samples; n a whole number
// sgn is the sign law of the caller (sign or tanh(x / width)); sign is the plain one.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "codegen/src/generator/graph.hpp"

namespace armcal::codegen {

struct Scope {
  // Value of a name or name[index, ...]; indices are the texts between the brackets. Returns false for an unknown name.
  std::function<bool(const std::string& name, const std::vector<std::string>& indices, Expr& value)> lookup;
  std::function<Expr(Expr)> sgn;  // the sign law
};

// Throws io::InputError: `where`, column, what was expected.
Expr ParseExpression(Graph& graph, const std::string& text, const Scope& scope, const std::string& where);

}  // namespace armcal::codegen

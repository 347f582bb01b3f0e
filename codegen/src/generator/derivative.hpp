// generator - derivatives and substitution on an expression graph.
#pragma once

#include <unordered_map>

#include "codegen/src/generator/graph.hpp"

namespace armcal::codegen {

// d e / d input, states held. Conventions: abs' = sign, sign' = 0, and where a divisor is 0 the quotient's derivative
// is 0.
Expr Derivative(Expr e, Expr input);

// d e / d parameter along a run: every state that e reads brings its own sensitivity, a state that this call adds to
// the graph (it starts at zero: initial values do not depend on parameters).
Expr TotalDerivative(Expr e, Expr parameter);

// e with nodes (by id) replaced.
Expr Substitute(Expr e, const std::unordered_map<int, Expr>& by);

// True if e reads `input`.
bool Reads(Expr e, Expr input);

}  // namespace armcal::codegen

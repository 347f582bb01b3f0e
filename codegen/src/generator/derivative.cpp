// generator - the rule of each operation, and the chain rule through the states.
#include "codegen/src/generator/derivative.hpp"

namespace armcal::codegen {
namespace {

using Memo = std::unordered_map<int, Expr>;

Expr Rule(Graph& g, const Node& n, Expr e, Expr a, Expr b, Expr da, Expr db) {
  const auto sign = [&](Expr x) { return g.Unary(Op::kSign, x); };
  switch (n.op) {
    case Op::kNegate:
      return -da;
    case Op::kAdd:
      return da + db;
    case Op::kSubtract:
      return da - db;
    case Op::kMultiply:
      return da * b + a * db;
    case Op::kDivide:
      return (da - e * db) / b;
    case Op::kSin:
      return g.Unary(Op::kCos, a) * da;
    case Op::kCos:
      return -(g.Unary(Op::kSin, a) * da);
    case Op::kExp:
      return e * da;
    case Op::kLog:
      return da / a;
    case Op::kTanh:
      return (g.Constant(1) - e * e) * da;
    case Op::kCbrt:
      return da / (3.0 * (e * e));
    case Op::kSqrt:
      return da / (2.0 * e);
    case Op::kAbs:
      return sign(a) * da;
    case Op::kMin:  // (a + b - |a - b|) / 2
      return 0.5 * ((da + db) - sign(a - b) * (da - db));
    case Op::kMax:
      return 0.5 * ((da + db) + sign(a - b) * (da - db));
    case Op::kPow: {  // a^b with a > 0; 0 elsewhere
      const Expr by_base = b * g.Binary(Op::kPow, a, b - 1.0) * da;
      // where a = 0 the power is 0, too; the bound keeps the logarithm finite there
      const Expr log = g.Unary(Op::kLog, g.Binary(Op::kMax, a, g.Constant(1e-30)));
      return db.IsZero() ? by_base : by_base + e * log * db;
    }
    case Op::kSign:
    case Op::kConstant:
    case Op::kInput:
      break;
  }
  return g.Constant(0);
}

Expr Differentiate(Expr e, Expr input, Memo& memo) {
  Graph& g = *e.graph();
  if (e.id() == input.id()) return g.Constant(1);
  const Node n = g.nodes()[e.id()];  // a copy: the graph grows
  if (n.op == Op::kConstant || n.op == Op::kInput) return g.Constant(0);
  if (const auto it = memo.find(e.id()); it != memo.end()) return it->second;
  const Expr zero = g.Constant(0), a(&g, n.a), b = n.b >= 0 ? Expr(&g, n.b) : zero;
  const Expr da = Differentiate(a, input, memo), db = n.b >= 0 ? Differentiate(b, input, memo) : zero;
  const Expr result = da.IsZero() && db.IsZero() ? zero : Rule(g, n, e, a, b, da, db);
  memo.emplace(e.id(), result);
  return result;
}

Expr Replace(Expr e, const Memo& by, Memo& memo) {
  Graph& g = *e.graph();
  if (const auto it = by.find(e.id()); it != by.end()) return it->second;
  const Node n = g.nodes()[e.id()];
  if (n.op == Op::kConstant || n.op == Op::kInput) return e;
  if (const auto it = memo.find(e.id()); it != memo.end()) return it->second;
  const Expr a = Replace(Expr(&g, n.a), by, memo);
  const Expr result = n.b < 0 ? g.Unary(n.op, a) : g.Binary(n.op, a, Replace(Expr(&g, n.b), by, memo));
  memo.emplace(e.id(), result);
  return result;
}

bool Find(const Graph& g, int id, int wanted, std::unordered_map<int, bool>& seen) {
  if (id == wanted) return true;
  const Node& n = g.nodes()[id];
  if (n.op == Op::kConstant || n.op == Op::kInput || !seen.emplace(id, true).second) return false;
  return Find(g, n.a, wanted, seen) || (n.b >= 0 && Find(g, n.b, wanted, seen));
}

}  // namespace

Expr Derivative(Expr e, Expr input) {
  Memo memo;
  return Differentiate(e, input, memo);
}

bool Reads(Expr e, Expr input) {
  std::unordered_map<int, bool> seen;
  return Find(*e.graph(), e.id(), input.id(), seen);
}

Expr TotalDerivative(Expr e, Expr parameter) {
  Graph& g = *e.graph();
  Expr sum = Derivative(e, parameter);
  const std::string of = g.input(parameter).symbol;
  const std::size_t count = g.states().size();
  for (std::size_t k = 0; k < count; ++k) {
    const StateVariable s = g.states()[k];
    if (s.name.rfind("d ", 0) == 0 || !Reads(e, s.value)) continue;
    const Expr through = Derivative(e, s.value);
    if (through.IsZero()) continue;
    const Expr sensitivity =
        g.State("d " + s.name + " / d " + of, g.Constant(0), [&](Expr) { return TotalDerivative(s.next, parameter); });
    sum = sum + through * sensitivity;
  }
  return sum;
}

Expr Substitute(Expr e, const std::unordered_map<int, Expr>& by) {
  Memo memo;
  return Replace(e, by, memo);
}

}  // namespace armcal::codegen

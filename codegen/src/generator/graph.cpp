// generator - builds an expression graph in its normal form.
#include "codegen/src/generator/graph.hpp"

#include <cstring>
#include <utility>

namespace armcal::codegen {

bool Expr::IsConstant(double value) const {
  const Node& n = graph_->nodes()[id_];
  return n.op == Op::kConstant && n.value == value;
}

Expr Graph::Make(Op op, int a, int b, double value) {
  char key[1 + 2 * sizeof(int) + sizeof(double)];
  key[0] = static_cast<char>(op);
  std::memcpy(key + 1, &a, sizeof a);
  std::memcpy(key + 1 + sizeof a, &b, sizeof b);
  std::memcpy(key + 1 + 2 * sizeof a, &value, sizeof value);
  const auto [it, fresh] = known_.try_emplace(std::string(key, sizeof key), static_cast<int>(nodes_.size()));
  if (fresh) nodes_.push_back({op, a, b, value});
  return {this, it->second};
}

Expr Graph::Constant(double value) {
  if (value < 0) return Negate(Make(Op::kConstant, -1, -1, -value));
  return Make(Op::kConstant, -1, -1, value == 0 ? 0.0 : value);  // no negative zero
}

Expr Graph::Input(const InputId& input) {
  const auto [it, fresh] = input_ids_.try_emplace(input, static_cast<int>(inputs_.size()));
  if (fresh) inputs_.push_back(input);
  return Make(Op::kInput, it->second, -1);
}

void Graph::Name(Expr e, const std::string& name) {
  int id = e.id();
  if (nodes_[id].op == Op::kNegate) id = nodes_[id].a;
  if (nodes_[id].op != Op::kConstant && nodes_[id].op != Op::kInput) names_.try_emplace(id, name);
}

Expr Graph::State(const std::string& name, Expr initial, const std::function<Expr(Expr)>& next) {
  for (const StateVariable& s : states_)
    if (s.name == name) return s.value;
  const Expr value = Symbol(name);
  const std::size_t k = states_.size();
  states_.push_back({name, value, initial, value});
  const Expr following = next(value);  // may make states of its own, or ask for this one
  states_[k].next = following;
  return value;
}

Expr Graph::Negate(Expr a) {
  const Node& n = nodes_[a.id()];
  if (n.op == Op::kNegate) return {this, n.a};
  if (n.op == Op::kConstant && n.value == 0) return a;
  return Make(Op::kNegate, a.id(), -1);
}

namespace {
// value of a constant or of a negated constant
bool Value(const Graph& g, int id, double& value) {
  const Node& n = g.nodes()[id];
  if (n.op == Op::kConstant) return value = n.value, true;
  if (n.op == Op::kNegate && g.nodes()[n.a].op == Op::kConstant) return value = -g.nodes()[n.a].value, true;
  return false;
}
}  // namespace

Expr Graph::Unary(Op op, Expr a) {
  double value = 0;
  if (Value(*this, a.id(), value)) return Constant(ApplyOp<double>(op, value, 0.0));
  if (op == Op::kNegate) return Negate(a);
  const Node& n = nodes_[a.id()];
  if (n.op == Op::kNegate) {
    const Expr inner{this, n.a};
    if (op == Op::kCos || op == Op::kAbs) return Unary(op, inner);
    if (op == Op::kSin || op == Op::kTanh || op == Op::kCbrt || op == Op::kSign) return Negate(Unary(op, inner));
  }
  if (op == Op::kAbs && n.op == Op::kAbs) return a;
  return Make(op, a.id(), -1);
}

Expr Graph::Binary(Op op, Expr a, Expr b) {
  double va = 0, vb = 0;
  const bool ca = Value(*this, a.id(), va), cb = Value(*this, b.id(), vb);
  if (ca && cb) return Constant(ApplyOp<double>(op, va, vb));
  const auto negated = [this](Expr e) { return nodes_[e.id()].op == Op::kNegate; };
  const auto inner = [this](Expr e) { return Expr(this, nodes_[e.id()].a); };
  switch (op) {
    case Op::kAdd:
      if (ca && va == 0) return b;
      if (cb && vb == 0) return a;
      if (negated(a) && negated(b)) return Negate(Binary(Op::kAdd, inner(a), inner(b)));
      if (negated(b)) return Binary(Op::kSubtract, a, inner(b));
      if (negated(a)) return Binary(Op::kSubtract, b, inner(a));
      if (a.id() > b.id()) std::swap(a, b);
      return Make(op, a.id(), b.id());
    case Op::kSubtract:
      if (a.id() == b.id()) return Constant(0);
      if (cb && vb == 0) return a;
      if (ca && va == 0) return Negate(b);
      if (negated(b)) return Binary(Op::kAdd, a, inner(b));
      if (negated(a)) return Negate(Binary(Op::kAdd, inner(a), b));
      if (a.id() > b.id()) return Negate(Make(op, b.id(), a.id()));
      return Make(op, a.id(), b.id());
    case Op::kMultiply:
      if ((ca && va == 0) || (cb && vb == 0)) return Constant(0);
      if (ca && va == 1) return b;
      if (cb && vb == 1) return a;
      if (negated(a) && negated(b)) return Binary(op, inner(a), inner(b));
      if (negated(a)) return Negate(Binary(op, inner(a), b));
      if (negated(b)) return Negate(Binary(op, a, inner(b)));
      if (a.id() > b.id()) std::swap(a, b);
      return Make(op, a.id(), b.id());
    case Op::kDivide:
      if (ca && va == 0) return Constant(0);
      if (cb && vb != 0) return Binary(Op::kMultiply, a, Constant(1 / vb));
      if (negated(a) && negated(b)) return Binary(op, inner(a), inner(b));
      if (negated(a)) return Negate(Binary(op, inner(a), b));
      if (negated(b)) return Negate(Binary(op, a, inner(b)));
      return Make(op, a.id(), b.id());
    case Op::kMin:
    case Op::kMax:
      return a.id() == b.id() ? a : Make(op, a.id(), b.id());
    case Op::kPow:
      if (cb && vb == 1) return a;
      if (cb && (vb == 2 || vb == 3 || vb == 4)) {
        const Expr square = Binary(Op::kMultiply, a, a);
        return vb == 2 ? square : Binary(Op::kMultiply, square, vb == 3 ? a : square);
      }
      return Make(op, a.id(), b.id());
    default:
      return Make(op, a.id(), b.id());
  }
}

Expr operator-(Expr a) { return a.graph()->Unary(Op::kNegate, a); }
Expr operator+(Expr a, Expr b) { return a.graph()->Binary(Op::kAdd, a, b); }
Expr operator-(Expr a, Expr b) { return a.graph()->Binary(Op::kSubtract, a, b); }
Expr operator*(Expr a, Expr b) { return a.graph()->Binary(Op::kMultiply, a, b); }
Expr operator/(Expr a, Expr b) { return a.graph()->Binary(Op::kDivide, a, b); }
Expr operator*(double a, Expr b) { return b.graph()->Constant(a) * b; }
Expr operator+(Expr a, double b) { return a + a.graph()->Constant(b); }
Expr operator-(Expr a, double b) { return a - a.graph()->Constant(b); }

}  // namespace armcal::codegen

// generator - a graph of expressions in which equal expressions are one node.
//
// Normal form: signs outward (a*(-b) = -(a*b)), differences in one order (b-a = -(a-b)), constants folded, 0 and +-1
// removed. Equal expressions are one node, so nothing is computed twice.
#pragma once

#include <cmath>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <unordered_map>
#include <vector>

#include "codegen/src/generator/quantity.hpp"

namespace armcal::codegen {

enum class Op : std::uint8_t {
  kConstant,
  kInput,
  kNegate,
  kAdd,
  kSubtract,
  kMultiply,
  kDivide,  // kDivide: 0 where the divisor is 0
  kSin,
  kCos,
  kExp,
  kLog,
  kTanh,
  kCbrt,
  kSqrt,
  kAbs,
  kSign,
  kMin,
  kMax,
  kPow,
};

struct Node {
  Op op;
  int a = -1, b = -1;  // operands; kInput: a = input number
  double value = 0;    // kConstant
};

class Graph;

// A handle; copies are cheap. Valid as long as its graph.
class Expr {
 public:
  Expr() = default;
  Expr(Graph* graph, int id) : graph_(graph), id_(id) {}
  int id() const { return id_; }
  Graph* graph() const { return graph_; }
  bool IsConstant(double value) const;
  bool IsZero() const { return IsConstant(0); }

 private:
  Graph* graph_ = nullptr;
  int id_ = -1;
};

// A value carried from one sample to the next. `value` is an input node: what `next` gave at the sample before.
struct StateVariable {
  std::string name;
  Expr value, initial, next;
};

class Graph {
 public:
  Graph() = default;
  Graph(const Graph&) = delete;
  Graph& operator=(const Graph&) = delete;

  Expr Constant(double value);
  Expr Input(const InputId& input);  // the same input gives the same node
  // A nonlinear parameter, or whatever else has nothing but a name.
  Expr Symbol(const std::string& name) { return Input(SymbolId(name)); }
  Expr Unary(Op op, Expr a);
  Expr Binary(Op op, Expr a, Expr b);
  void Name(Expr e, const std::string& name);  // a readable name for the emitted temporary; the first one stays

  // The state of this name, made on first use; `next` gets its value and gives the one of the next sample.
  Expr State(const std::string& name, Expr initial, const std::function<Expr(Expr value)>& next);

  const std::vector<Node>& nodes() const { return nodes_; }
  const std::vector<InputId>& inputs() const { return inputs_; }
  const InputId& input(Expr e) const { return inputs_[nodes_[e.id()].a]; }  // of an input node
  const std::unordered_map<int, std::string>& names() const { return names_; }
  const std::vector<StateVariable>& states() const { return states_; }

 private:
  Expr Make(Op op, int a, int b, double value = 0);
  Expr Negate(Expr a);

  std::vector<Node> nodes_;
  std::vector<InputId> inputs_;
  std::unordered_map<int, std::string> names_;
  std::map<InputId, int> input_ids_;
  std::vector<StateVariable> states_;
  std::unordered_map<std::string, int> known_;
};

Expr operator-(Expr a);
Expr operator+(Expr a, Expr b);
Expr operator-(Expr a, Expr b);
Expr operator*(Expr a, Expr b);
Expr operator/(Expr a, Expr b);
Expr operator*(double a, Expr b);
Expr operator+(Expr a, double b);
Expr operator-(Expr a, double b);

// The value of one node operation; folding and every evaluator share it.
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

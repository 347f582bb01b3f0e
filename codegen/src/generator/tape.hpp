// generator - evaluates a graph: at one point in any scalar, or over a whole log in blocks; knows no robot.
#pragma once

#include <span>
#include <vector>

#include "codegen/src/generator/graph.hpp"

namespace armcal::codegen {

// Where one graph input comes from: a column (one value a sample) or one value for all samples.
struct Binding {
  const double* column = nullptr;
  double value = 0;
};

// The part of a graph that some roots need, in order. Immutable; many threads may evaluate it.
class Tape {
 public:
  Tape(const Graph& graph, std::vector<Expr> roots);

  // bindings: one per graph input (Graph::inputs()); out: one pointer per root, each to `samples` values.
  void Evaluate(std::span<const Binding> bindings, int samples, std::span<double* const> out) const;

  // One point. inputs: one value per graph input.
  template <class T>
  std::vector<T> EvaluateAt(std::span<const T> inputs) const {
    std::vector<T> value(step_.size());
    for (std::size_t k = 0; k < step_.size(); ++k) {
      const Node& s = step_[k];
      if (s.op == Op::kConstant) value[k] = static_cast<T>(s.value);
      else if (s.op == Op::kInput) value[k] = inputs[s.a];
      else value[k] = ApplyOp<T>(s.op, value[s.a], s.b < 0 ? T(0) : value[s.b]);
    }
    std::vector<T> out;
    for (const int r : root_) out.push_back(value[r]);
    return out;
  }

 private:
  std::vector<Node> step_;  // operands renumbered to steps
  std::vector<int> root_;
};

}  // namespace armcal::codegen

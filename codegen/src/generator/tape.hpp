// generator - evaluates a graph at one point or over a whole log.
#pragma once

#include <functional>
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
  Tape(const Graph& graph, const std::vector<Expr>& roots);

  // bindings: one per graph input (Graph::inputs()); out: one pointer per root, each to `samples` values.
  void Evaluate(std::span<const Binding> bindings, int samples, std::span<double* const> out) const;

  // The same without storing a log's worth: visit(begin, count, root) for each block of count <= kBlock samples from
  // `begin`; root: one pointer per root to the block's values, valid during the call.
  static constexpr int kBlock = 64;
  using Visit = std::function<void(int begin, int count, std::span<const double* const> root)>;
  void ForEachBlock(std::span<const Binding> bindings, int samples, const Visit& visit) const;

  // One point. inputs: one value per graph input; out: one per root. scratch is kept between calls.
  template <class T>
  void EvaluateAt(std::span<const T> inputs, std::vector<T>& scratch, std::span<T> out) const {
    scratch.resize(step_.size());
    for (std::size_t k = 0; k < step_.size(); ++k) {
      const Node& s = step_[k];
      if (s.op == Op::kConstant) scratch[k] = static_cast<T>(s.value);
      else if (s.op == Op::kInput) scratch[k] = inputs[s.a];
      else scratch[k] = ApplyOp<T>(s.op, scratch[s.a], s.b < 0 ? T(0) : scratch[s.b]);
    }
    for (std::size_t r = 0; r < root_.size(); ++r) out[r] = scratch[root_[r]];
  }
  template <class T>
  std::vector<T> EvaluateAt(std::span<const T> inputs) const {
    std::vector<T> scratch, out(root_.size());
    EvaluateAt<T>(inputs, scratch, out);
    return out;
  }

 private:
  // How one evaluation goes about it. A block of each step's values lies in a lane; lanes of values that nobody needs
  // any more are used again, so that a six-axis model's block stays in the nearest caches.
  struct Plan {
    std::vector<char> fixed;  // the same for all samples: computed once
    std::vector<int> lane;
    int lanes = 0;
  };
  Plan MakePlan(std::span<const Binding> bindings) const;
  // Filled before the first step, or from a log.
  bool HasOwnLane(const Plan& plan, int step) const { return plan.fixed[step] || step_[step].op == Op::kInput; }

  std::vector<Node> step_;  // operands renumbered to steps
  std::vector<int> root_;
};

}  // namespace armcal::codegen

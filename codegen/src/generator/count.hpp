// generator - counts the multiplications and additions that some roots of a graph need; knows no robot.
#pragma once

#include <span>
#include <vector>

#include "codegen/src/generator/graph.hpp"

namespace armcal::codegen {

// Counting again and again over one growing graph; a unary minus is free, as in the emitted text.
class OperationCounter {
 public:
  explicit OperationCounter(const Graph& graph) : graph_(graph) {}

  int Count(std::span<const Expr> roots) {
    const auto& nodes = graph_.nodes();
    seen_.resize(nodes.size(), 0);
    ++pass_;
    int count = 0;
    for (const Expr& r : roots) stack_.push_back(r.id());
    while (!stack_.empty()) {
      const int id = stack_.back();
      stack_.pop_back();
      if (id < 0 || seen_[id] == pass_) continue;
      seen_[id] = pass_;
      const Node& n = nodes[id];
      if (n.op == Op::kInput) continue;
      count += n.op == Op::kAdd || n.op == Op::kSubtract || n.op == Op::kMultiply;
      stack_.push_back(n.a), stack_.push_back(n.b);
    }
    return count;
  }

 private:
  const Graph& graph_;
  std::vector<int> seen_, stack_;
  int pass_ = 0;
};

}  // namespace armcal::codegen

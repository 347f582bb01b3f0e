// generator - block evaluation of a graph; the inner loops run over samples so that the compiler vectorises them.
#include "codegen/src/generator/tape.hpp"

#include <algorithm>

namespace armcal::codegen {
namespace {
constexpr int kBlock = 64;  // samples per block: ~1500 steps x 64 x 8 bytes stay in the second-level cache
}

Tape::Tape(const Graph& graph, std::vector<Expr> roots) {
  const auto& nodes = graph.nodes();
  std::vector<char> needed(nodes.size(), 0);
  for (const Expr& r : roots) needed[r.id()] = 1;
  for (int i = static_cast<int>(nodes.size()) - 1; i >= 0; --i) {  // operands precede their node
    if (!needed[i] || nodes[i].op == Op::kInput) continue;
    if (nodes[i].a >= 0) needed[nodes[i].a] = 1;
    if (nodes[i].b >= 0) needed[nodes[i].b] = 1;
  }
  std::vector<int> position(nodes.size(), -1);
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (!needed[i]) continue;
    position[i] = static_cast<int>(step_.size());
    Node s = nodes[i];
    if (s.op != Op::kInput && s.a >= 0) s.a = position[s.a];
    if (s.b >= 0) s.b = position[s.b];
    step_.push_back(s);
  }
  for (const Expr& r : roots) root_.push_back(position[r.id()]);
}

void Tape::Evaluate(std::span<const Binding> bindings, int samples, std::span<double* const> out) const {
  std::vector<double> value(step_.size() * kBlock);
  const auto lane = [&](int step) { return value.data() + static_cast<std::size_t>(step) * kBlock; };
  for (std::size_t k = 0; k < step_.size(); ++k)  // what does not change from block to block
    if (step_[k].op == Op::kConstant) std::fill_n(lane(k), kBlock, step_[k].value);
    else if (step_[k].op == Op::kInput && !bindings[step_[k].a].column)
      std::fill_n(lane(k), kBlock, bindings[step_[k].a].value);
  for (int begin = 0; begin < samples; begin += kBlock) {
    const int count = std::min(kBlock, samples - begin);
    for (std::size_t k = 0; k < step_.size(); ++k) {
      const Node& s = step_[k];
      double* z = lane(k);
      if (s.op == Op::kConstant) continue;
      if (s.op == Op::kInput) {
        if (const double* column = bindings[s.a].column) std::copy_n(column + begin, count, z);
        continue;
      }
      const double* a = lane(s.a);
      const double* b = s.b < 0 ? a : lane(s.b);
      switch (s.op) {
        case Op::kNegate:
          for (int i = 0; i < kBlock; ++i) z[i] = -a[i];
          break;
        case Op::kAdd:
          for (int i = 0; i < kBlock; ++i) z[i] = a[i] + b[i];
          break;
        case Op::kSubtract:
          for (int i = 0; i < kBlock; ++i) z[i] = a[i] - b[i];
          break;
        case Op::kMultiply:
          for (int i = 0; i < kBlock; ++i) z[i] = a[i] * b[i];
          break;
        default:
          for (int i = 0; i < count; ++i) z[i] = ApplyOp<double>(s.op, a[i], b[i]);
      }
    }
    for (std::size_t r = 0; r < root_.size(); ++r) std::copy_n(lane(root_[r]), count, out[r] + begin);
  }
}

}  // namespace armcal::codegen

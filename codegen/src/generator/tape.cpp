// generator - block evaluation of a graph; the inner loops run over samples so that the compiler vectorises them.
#include "codegen/src/generator/tape.hpp"

#include <algorithm>
#include <cmath>

// One binary for every PC: the widest vectors that the machine has. Without contraction all give the same bits.
#if defined(__x86_64__) && !defined(__SANITIZE_ADDRESS__)
#define WIDEST_VECTORS __attribute__((target_clones("avx512f", "avx2", "default")))
#else
#define WIDEST_VECTORS
#endif

namespace armcal::codegen {
namespace {

constexpr int kBlock = Tape::kBlock;

// z = a op b over one block. Lanes differ.
WIDEST_VECTORS void Apply(Op op, const double* __restrict a, const double* __restrict b, double* __restrict z) {
  switch (op) {
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
      for (int i = 0; i < kBlock; ++i) z[i] = ApplyOp<double>(op, a[i], b[i]);
  }
}

bool IsGiven(const Node& n) { return n.op == Op::kConstant || n.op == Op::kInput; }

}  // namespace

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
  AssignLanes();
}

void Tape::AssignLanes() {
  const int steps = static_cast<int>(step_.size());
  lane_.assign(steps, -1);
  std::vector<int> last(steps, -1);  // the step that reads it last
  for (int k = 0; k < steps; ++k) {
    const Node& s = step_[k];
    if (IsGiven(s)) {
      lane_[k] = lanes_++;  // filled before the first step: its lane is its own
      last[k] = steps;
      continue;
    }
    last[s.a] = std::max(last[s.a], k);
    if (s.b >= 0) last[s.b] = std::max(last[s.b], k);
  }
  for (const int r : root_) last[r] = steps;
  std::vector<int> free;
  for (int k = 0; k < steps; ++k) {
    const Node& s = step_[k];
    if (IsGiven(s)) continue;
    if (free.empty()) free.push_back(lanes_++);
    lane_[k] = free.back();
    free.pop_back();
    if (last[s.a] == k) free.push_back(lane_[s.a]);
    if (s.b >= 0 && s.b != s.a && last[s.b] == k) free.push_back(lane_[s.b]);
  }
}

void Tape::ForEachBlock(std::span<const Binding> bindings, int samples, const Visit& visit) const {
  std::vector<double> value(static_cast<std::size_t>(lanes_) * kBlock);
  const auto lane = [&](int step) { return value.data() + static_cast<std::size_t>(lane_[step]) * kBlock; };
  for (std::size_t k = 0; k < step_.size(); ++k)  // what does not change from block to block
    if (step_[k].op == Op::kConstant) std::fill_n(lane(k), kBlock, step_[k].value);
    else if (step_[k].op == Op::kInput && !bindings[step_[k].a].column)
      std::fill_n(lane(k), kBlock, bindings[step_[k].a].value);
  std::vector<const double*> root;
  for (const int r : root_) root.push_back(lane(r));
  for (int begin = 0; begin < samples; begin += kBlock) {
    const int count = std::min(kBlock, samples - begin);
    for (std::size_t k = 0; k < step_.size(); ++k) {
      const Node& s = step_[k];
      if (s.op == Op::kConstant) continue;
      if (s.op != Op::kInput) Apply(s.op, lane(s.a), s.b < 0 ? lane(s.a) : lane(s.b), lane(k));
      else if (const double* column = bindings[s.a].column) std::copy_n(column + begin, count, lane(k));
    }
    visit(begin, count, root);
  }
}

void Tape::Evaluate(std::span<const Binding> bindings, int samples, std::span<double* const> out) const {
  ForEachBlock(bindings, samples, [&](int begin, int count, std::span<const double* const> root) {
    for (std::size_t r = 0; r < root.size(); ++r) std::copy_n(root[r], count, out[r] + begin);
  });
}

}  // namespace armcal::codegen

// generator - evaluates a graph in blocks. The inner loops run over samples so that the compiler vectorises them.
#include "codegen/src/generator/tape.hpp"

#include <algorithm>
#include <cmath>

#include "codegen/src/generator/vector_units.hpp"
#include "codegen/src/io/watch.hpp"

// The C library's vector functions are good to a few last bits.
#if defined(__x86_64__) && defined(__GLIBC__) && !defined(__clang__)
#define HAS_VECTOR_FORM extern "C" __attribute__((simd("notinbranch")))
HAS_VECTOR_FORM double sin(double) noexcept;
HAS_VECTOR_FORM double cos(double) noexcept;
HAS_VECTOR_FORM double exp(double) noexcept;
HAS_VECTOR_FORM double tanh(double) noexcept;
#endif

namespace armcal::codegen {
namespace {

constexpr int kBlock = Tape::kBlock;
constexpr int kUnwatched = 64 * kBlock;  // samples between two looks of a watch

template <Op op>
inline __attribute__((always_inline)) void ApplyTo(const double* __restrict a, const double* __restrict b,
                                                   double* __restrict z) {
  for (int i = 0; i < kBlock; ++i) z[i] = ApplyOp<double>(op, a[i], b[i]);
}

// z = a op b over one block. Lanes differ. One loop an operation: the compiler vectorises those that it can.
ARMCAL_VECTOR_UNITS("avx512f", "avx2")
void ApplyToBlock(Op op, const double* a, const double* b, double* z) {
  switch (op) {
    case Op::kNegate:
      return ApplyTo<Op::kNegate>(a, b, z);
    case Op::kAdd:
      return ApplyTo<Op::kAdd>(a, b, z);
    case Op::kSubtract:
      return ApplyTo<Op::kSubtract>(a, b, z);
    case Op::kMultiply:
      return ApplyTo<Op::kMultiply>(a, b, z);
    case Op::kDivide:
      return ApplyTo<Op::kDivide>(a, b, z);
    case Op::kSin:
      return ApplyTo<Op::kSin>(a, b, z);
    case Op::kCos:
      return ApplyTo<Op::kCos>(a, b, z);
    case Op::kExp:
      return ApplyTo<Op::kExp>(a, b, z);
    case Op::kTanh:
      return ApplyTo<Op::kTanh>(a, b, z);
    case Op::kSqrt:
      return ApplyTo<Op::kSqrt>(a, b, z);
    case Op::kAbs:
      return ApplyTo<Op::kAbs>(a, b, z);
    case Op::kSign:
      return ApplyTo<Op::kSign>(a, b, z);
    case Op::kMin:
      return ApplyTo<Op::kMin>(a, b, z);
    case Op::kMax:
      return ApplyTo<Op::kMax>(a, b, z);
    default:
      for (int i = 0; i < kBlock; ++i) z[i] = ApplyOp<double>(op, a[i], b[i]);
  }
}

}  // namespace

Tape::Tape(const Graph& graph, const std::vector<Expr>& roots) {
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

Tape::Plan Tape::MakePlan(std::span<const Binding> bindings) const {
  const int steps = static_cast<int>(step_.size());
  Plan plan{std::vector<char>(steps), std::vector<int>(steps), 0};
  std::vector<int> last(steps, -1);  // the step that reads it last
  for (int k = 0; k < steps; ++k) {
    const Node& s = step_[k];
    if (s.op == Op::kConstant || s.op == Op::kInput) {
      plan.fixed[k] = s.op == Op::kConstant || !bindings[s.a].column;
    } else {
      plan.fixed[k] = plan.fixed[s.a] && (s.b < 0 || plan.fixed[s.b]);
      last[s.a] = k;
      if (s.b >= 0) last[s.b] = k;
    }
    if (!HasOwnLane(plan, k)) continue;
    plan.lane[k] = plan.lanes++;
    last[k] = steps;
  }
  for (const int r : root_) last[r] = steps;
  std::vector<int> free;
  const auto release = [&](int operand, int k) {
    if (last[operand] == k && !HasOwnLane(plan, operand)) free.push_back(plan.lane[operand]);
  };
  for (int k = 0; k < steps; ++k) {
    if (HasOwnLane(plan, k)) continue;
    const Node& s = step_[k];
    if (free.empty()) free.push_back(plan.lanes++);
    plan.lane[k] = free.back();
    free.pop_back();
    release(s.a, k);
    if (s.b >= 0 && s.b != s.a) release(s.b, k);
  }
  return plan;
}

void Tape::ForEachBlock(std::span<const Binding> bindings, int samples, const Visit& visit) const {
  const Plan plan = MakePlan(bindings);
  std::vector<double> value(static_cast<std::size_t>(plan.lanes) * kBlock);
  const auto lane = [&](int step) { return value.data() + static_cast<std::size_t>(plan.lane[step]) * kBlock; };
  std::vector<int> varying;
  for (std::size_t k = 0; k < step_.size(); ++k) {
    const Node& s = step_[k];
    if (!plan.fixed[k]) varying.push_back(static_cast<int>(k));
    else if (s.op == Op::kConstant) std::fill_n(lane(k), kBlock, s.value);
    else if (s.op == Op::kInput) std::fill_n(lane(k), kBlock, bindings[s.a].value);
    else std::fill_n(lane(k), kBlock, ApplyOp<double>(s.op, *lane(s.a), s.b < 0 ? 0 : *lane(s.b)));
  }
  std::vector<const double*> at(step_.size()), root(root_.size());  // each step's block
  for (std::size_t k = 0; k < step_.size(); ++k) at[k] = lane(static_cast<int>(k));
  for (int begin = 0; begin < samples; begin += kBlock) {
    if (begin % kUnwatched == 0) io::CancellationPoint();
    const int count = std::min(kBlock, samples - begin);
    for (const int k : varying) {
      const Node& s = step_[k];
      if (s.op != Op::kInput) ApplyToBlock(s.op, at[s.a], at[s.b < 0 ? s.a : s.b], lane(k));
      else if (count == kBlock) at[k] = bindings[s.a].column + begin;
      else at[k] = std::copy_n(bindings[s.a].column + begin, count, lane(k)) - count;
    }
    for (std::size_t r = 0; r < root.size(); ++r) root[r] = at[root_[r]];
    visit(begin, count, root);
  }
}

void Tape::Evaluate(std::span<const Binding> bindings, int samples, std::span<double* const> out) const {
  ForEachBlock(bindings, samples, [&](int begin, int count, std::span<const double* const> root) {
    for (std::size_t r = 0; r < root.size(); ++r) std::copy_n(root[r], count, out[r] + begin);
  });
}

}  // namespace armcal::codegen

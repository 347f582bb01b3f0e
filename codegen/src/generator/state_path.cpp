// generator - states sample by sample, since each needs the one before; all else in blocks.
#include "codegen/src/generator/state_path.hpp"

#include <algorithm>
#include <cmath>

#include "codegen/src/generator/derivative.hpp"

namespace armcal::codegen {
namespace {
constexpr double kRounding = 1e-3;  // of a step: times are written with so many digits
}

std::vector<Expr> InitialValues(const Graph& graph, std::size_t count) {
  std::vector<Expr> out;
  std::unordered_map<int, Expr> known;
  for (std::size_t k = 0; k < count; ++k) {  // a state is made after those that its start reads
    out.push_back(Substitute(graph.states()[k].initial, known));
    known.emplace(graph.states()[k].value.id(), out.back());
  }
  return out;
}

Eigen::VectorXd SampleSteps(const Eigen::VectorXd& t, int samples, double usual, std::vector<char>& restart) {
  restart.assign(samples, 0);
  if (t.size() > 1) {
    std::vector<double> all;
    for (int k = 1; k < samples; ++k) all.push_back(t[k] - t[k - 1]);
    std::nth_element(all.begin(), all.begin() + static_cast<std::ptrdiff_t>(all.size() / 2), all.end());
    usual = all[all.size() / 2];
  }
  Eigen::VectorXd dt = Eigen::VectorXd::Constant(samples, usual);
  for (int k = 1; k < samples && t.size(); ++k) {
    const double step = t[k] - t[k - 1];
    if (step <= 0 || step >= 1.5 * usual) restart[k] = 1;
    else if (std::abs(step - usual) > kRounding * usual) dt[k] = step;
  }
  return dt;
}

Binding BindSteps(const Eigen::VectorXd& dt) {
  if (dt.size() && (dt.array() == dt[0]).all()) return {nullptr, dt[0]};
  return {dt.data(), 0};
}

namespace {

// What hangs on a state must be run sample by sample. All else that the states need is known ahead, in whole blocks.
struct Recursion {
  Recursion(const Graph& graph, std::size_t count);

  std::vector<Expr> ahead;  // values[0..] of a sample; after these the states, after these the steps
  std::vector<Node> step;   // operands: places in values
  std::vector<int> next;    // [state] place in values
};

Recursion::Recursion(const Graph& graph, std::size_t count) {
  const auto& nodes = graph.nodes();
  const int size = static_cast<int>(nodes.size());
  std::vector<char> carried(size, 0), needed(size, 0);                                // carried: hangs on a state
  for (std::size_t k = 0; k < count; ++k) carried[graph.states()[k].value.id()] = 2;  // 2: is one
  const auto has_operands = [&](int i) { return nodes[i].op != Op::kInput && nodes[i].op != Op::kConstant; };
  for (int i = 0; i < size; ++i) {
    if (!has_operands(i)) continue;
    for (const int operand : {nodes[i].a, nodes[i].b}) carried[i] |= operand >= 0 && carried[operand];
  }
  for (std::size_t k = 0; k < count; ++k) needed[graph.states()[k].next.id()] = 1;
  for (int i = size - 1; i >= 0; --i) {
    if (!needed[i] || !carried[i] || !has_operands(i)) continue;
    for (const int operand : {nodes[i].a, nodes[i].b})
      if (operand >= 0) needed[operand] = 1;
  }
  std::vector<int> place(size, -1);
  for (int i = 0; i < size; ++i) {
    if (!needed[i] || carried[i]) continue;
    place[i] = static_cast<int>(ahead.size());
    ahead.emplace_back(graph.states()[0].value.graph(), i);
  }
  const int states_at = static_cast<int>(ahead.size());
  for (std::size_t k = 0; k < count; ++k) place[graph.states()[k].value.id()] = states_at + static_cast<int>(k);
  for (int i = 0; i < size; ++i) {
    if (!needed[i] || carried[i] != 1) continue;
    place[i] = states_at + static_cast<int>(count + step.size());
    step.push_back({nodes[i].op, place[nodes[i].a], nodes[i].b < 0 ? place[nodes[i].a] : place[nodes[i].b]});
  }
  for (std::size_t k = 0; k < count; ++k) next.push_back(place[graph.states()[k].next.id()]);
}

}  // namespace

Eigen::MatrixXd StatePath(const Graph& graph, std::size_t count, std::span<const Binding> bindings, int samples,
                          std::span<const char> restart) {
  const Recursion run(graph, count);
  const Tape start(graph, InitialValues(graph, count));
  Eigen::MatrixXd path(samples, static_cast<Eigen::Index>(count));
  std::vector<double> input(bindings.size()), scratch, values(run.ahead.size() + count + run.step.size());
  const std::span<double> state(values.data() + run.ahead.size(), count);
  std::vector<double> after(count);
  const auto restart_at = [&](int k) {
    for (std::size_t i = 0; i < bindings.size(); ++i)
      input[i] = bindings[i].column ? bindings[i].column[k] : bindings[i].value;
    start.EvaluateAt<double>(input, scratch, after);
  };
  Tape(graph, run.ahead)
      .ForEachBlock(bindings, samples, [&](int begin, int block, std::span<const double* const> ahead) {
        for (int i = 0; i < block; ++i) {
          const int k = begin + i;
          if (k == 0 || restart[k]) restart_at(k);
          for (std::size_t a = 0; a < ahead.size(); ++a) values[a] = ahead[a][i];
          for (std::size_t s = 0; s < count; ++s) path(k, static_cast<Eigen::Index>(s)) = state[s] = after[s];
          double* out = state.data() + count;
          for (const Node& n : run.step) *out++ = ApplyOp<double>(n.op, values[n.a], values[n.b]);
          for (std::size_t s = 0; s < count; ++s) after[s] = values[run.next[s]];
        }
      });
  return path;
}

}  // namespace armcal::codegen

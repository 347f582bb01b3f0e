// generator - runs the states sample by sample and everything else in blocks of samples.
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

std::vector<char> StatesOf(const Graph& graph, const std::vector<Expr>& roots) {
  const auto& nodes = graph.nodes();
  std::vector<char> needed(nodes.size(), 0), out(graph.states().size(), 0);
  for (const Expr& r : roots) needed[r.id()] = 1;
  for (bool more = true; more;) {
    more = false;
    for (std::size_t i = nodes.size(); i-- > 0;) {
      if (!needed[i] || nodes[i].op == Op::kInput || nodes[i].op == Op::kConstant) continue;
      for (const int operand : {nodes[i].a, nodes[i].b})
        if (operand >= 0) needed[operand] = 1;
    }
    for (std::size_t k = 0; k < out.size(); ++k) {
      const auto& state = graph.states()[k];
      if (out[k] || !needed[state.value.id()]) continue;
      out[k] = needed[state.next.id()] = needed[state.initial.id()] = 1;
      more = true;
    }
  }
  return out;
}

namespace {

// Whether each node hangs on an open state: 1, or is one: 2.
std::vector<char> Carried(const Graph& graph, std::span<const char> open) {
  const auto& nodes = graph.nodes();
  std::vector<char> carried(nodes.size(), 0);
  for (std::size_t k = 0; k < open.size(); ++k)
    if (open[k]) carried[graph.states()[k].value.id()] = 2;
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].op == Op::kInput || nodes[i].op == Op::kConstant) continue;
    for (const int operand : {nodes[i].a, nodes[i].b}) carried[i] |= operand >= 0 && carried[operand];
  }
  return carried;
}

// What hangs on a state must be run sample by sample. All else that the states need is known ahead, in whole blocks.
struct Recursion {
  Recursion(const Graph& graph, std::span<const char> open);

  std::vector<int> state;   // those that are open
  std::vector<Expr> ahead;  // values[0..] of a sample; after these the states, after these the steps
  std::vector<Node> step;   // operands: places in values
  std::vector<int> next;    // [state] place in values
};

Recursion::Recursion(const Graph& graph, std::span<const char> open) {
  const auto& nodes = graph.nodes();
  const int size = static_cast<int>(nodes.size());
  const std::vector<char> carried = Carried(graph, open);
  std::vector<char> needed(size, 0);
  for (std::size_t k = 0; k < open.size(); ++k)
    if (open[k]) state.push_back(static_cast<int>(k)), needed[graph.states()[k].next.id()] = 1;
  for (int i = size - 1; i >= 0; --i) {
    if (!needed[i] || carried[i] != 1) continue;
    for (const int operand : {nodes[i].a, nodes[i].b})
      if (operand >= 0) needed[operand] = 1;
  }
  std::vector<int> place(size, -1);
  for (int i = 0; i < size; ++i) {
    if (!needed[i] || carried[i]) continue;
    place[i] = static_cast<int>(ahead.size());
    ahead.emplace_back(graph.states()[0].value.graph(), i);
  }
  int at = static_cast<int>(ahead.size());
  for (const int k : state) place[graph.states()[k].value.id()] = at++;
  for (int i = 0; i < size; ++i) {
    if (!needed[i] || carried[i] != 1) continue;
    place[i] = at++;
    step.push_back({nodes[i].op, place[nodes[i].a], nodes[i].b < 0 ? place[nodes[i].a] : place[nodes[i].b]});
  }
  for (const int k : state) next.push_back(place[graph.states()[k].next.id()]);
}

}  // namespace

Eigen::MatrixXd StatePath(const Graph& graph, std::size_t count, std::span<const Binding> bindings, int samples,
                          std::span<const char> restart, std::vector<char> wanted) {
  std::vector<Binding> bound(bindings.begin(), bindings.end());
  const Tape start(graph, InitialValues(graph, count));
  std::vector<double> input(bindings.size()), scratch, initial(count);
  const auto start_at = [&](int k) {
    for (std::size_t i = 0; i < bindings.size(); ++i)
      input[i] = bindings[i].column ? bindings[i].column[k] : bindings[i].value;
    start.EvaluateAt<double>(input, scratch, initial);
  };
  Eigen::MatrixXd path = Eigen::MatrixXd::Zero(samples, static_cast<Eigen::Index>(count));
  std::vector<char> open = std::move(wanted);
  if (open.empty()) open.assign(count, 1);
  // A state whose next value hangs on no open state is that value a sample later: known ahead, too.
  for (;;) {
    const std::vector<char> carried = Carried(graph, open);
    std::vector<std::size_t> ready;
    std::vector<Expr> next;
    for (std::size_t s = 0; s < count; ++s)
      if (open[s] && !carried[graph.states()[s].next.id()]) ready.push_back(s), next.push_back(graph.states()[s].next);
    if (ready.empty()) break;
    Tape(graph, next).ForEachBlock(bound, samples, [&](int begin, int block, std::span<const double* const> value) {
      for (std::size_t r = 0; r < ready.size(); ++r)
        for (int i = 0; i < block && begin + i + 1 < samples; ++i)
          path(begin + i + 1, static_cast<Eigen::Index>(ready[r])) = value[r][i];
    });
    for (int k = 0; k < samples; ++k) {
      if (k > 0 && !restart[k]) continue;
      start_at(k);
      for (const std::size_t s : ready) path(k, static_cast<Eigen::Index>(s)) = initial[s];
    }
    for (const std::size_t s : ready) {
      bound[graph.nodes()[graph.states()[s].value.id()].a].column = path.col(static_cast<Eigen::Index>(s)).data();
      open[s] = 0;
    }
  }
  const Recursion run(graph, open);
  if (run.state.empty()) return path;
  const std::size_t states = run.state.size();
  std::vector<double> values(run.ahead.size() + states + run.step.size()), after(states);
  double* const state = values.data() + run.ahead.size();
  Tape(graph, run.ahead).ForEachBlock(bound, samples, [&](int begin, int block, std::span<const double* const> ahead) {
    for (int i = 0; i < block; ++i) {
      const int k = begin + i;
      if (k == 0 || restart[k]) {
        start_at(k);
        for (std::size_t s = 0; s < states; ++s) after[s] = initial[static_cast<std::size_t>(run.state[s])];
      }
      for (std::size_t a = 0; a < ahead.size(); ++a) values[a] = ahead[a][i];
      for (std::size_t s = 0; s < states; ++s) path(k, run.state[s]) = state[s] = after[s];
      double* out = state + states;
      for (const Node& n : run.step) *out++ = ApplyOp<double>(n.op, values[n.a], values[n.b]);
      for (std::size_t s = 0; s < states; ++s) after[s] = values[run.next[s]];
    }
  });
  return path;
}

}  // namespace armcal::codegen

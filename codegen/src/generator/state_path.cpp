// generator - sample by sample, since every state needs the one before.
#include "codegen/src/generator/state_path.hpp"

#include <algorithm>

#include "codegen/src/generator/derivative.hpp"

namespace armcal::codegen {

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
    if (step > 0 && step < 1.5 * usual) dt[k] = step;
    else restart[k] = 1;
  }
  return dt;
}

Eigen::MatrixXd StatePath(const Graph& graph, std::size_t count, std::span<const Binding> bindings, int samples,
                          std::span<const char> restart) {
  std::vector<Expr> next;
  std::vector<int> input;  // graph input of each state
  for (std::size_t k = 0; k < count; ++k) {
    const StateVariable& s = graph.states()[k];
    next.push_back(s.next);
    input.push_back(graph.nodes()[s.value.id()].a);
  }
  const Tape start(graph, InitialValues(graph, count)), step(graph, next);
  Eigen::MatrixXd path(samples, static_cast<Eigen::Index>(count));
  std::vector<double> value(graph.inputs().size()), state(count), scratch;
  for (int k = 0; k < samples; ++k) {
    for (std::size_t i = 0; i < bindings.size(); ++i)
      value[i] = bindings[i].column ? bindings[i].column[k] : bindings[i].value;
    if (k == 0 || restart[k]) start.EvaluateAt<double>(value, scratch, state);
    for (std::size_t s = 0; s < count; ++s) value[input[s]] = path(k, s) = state[s];
    step.EvaluateAt<double>(value, scratch, state);
  }
  return path;
}

}  // namespace armcal::codegen

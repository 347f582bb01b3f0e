// generator - runs a graph's states over a log.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "codegen/src/generator/tape.hpp"

namespace armcal::codegen {

// Each state's starting value with the other states' starting values put in: a function of the first sample alone.
std::vector<Expr> InitialValues(const Graph& graph, std::size_t count);

// Time since the sample before; where it is no ordinary step (over 1.5 times the median), a new stretch begins and the
// median stands in, as it does for steps that differ from it by rounding. usual: the step of a log without times.
// restart: one a sample.
Eigen::VectorXd SampleSteps(const Eigen::VectorXd& t, int samples, double usual, std::vector<char>& restart);

// The steps as an input: one value if all are equal.
Binding BindSteps(const Eigen::VectorXd& dt);

// Which of the graph's states these roots hang on, the states that those need included: one flag a state.
std::vector<char> StatesOf(const Graph& graph, const std::vector<Expr>& roots);

// The first `count` states over a log: [samples x count], the value that each sample starts from (what the graph's
// state inputs stand for). bindings: one per graph input; those of the states are not read. restart[k] != 0: sample k
// starts anew. wanted: one flag a state, the others stay zero; empty: all. Samples must be in order.
Eigen::MatrixXd StatePath(const Graph& graph, std::size_t count, std::span<const Binding> bindings, int samples,
                          std::span<const char> restart, std::vector<char> wanted = {});

}  // namespace armcal::codegen

// generator - runs a graph's states over a log.
#pragma once

#include <span>
#include <vector>

#include <Eigen/Core>

#include "codegen/src/generator/tape.hpp"

namespace armcal::codegen {

// The starting value of each state as a function of the first sample alone: the starting values of the other states are
// put in.
std::vector<Expr> InitialValues(const Graph& graph, std::size_t count);

// Time since the sample before. A step above 1.5 times the median begins a new stretch, and the median takes its place.
// The median also replaces steps that differ from it by rounding. usual: the step of a log without times.
// restart: one entry for each sample; not 0 where a stretch begins.
Eigen::VectorXd SampleSteps(const Eigen::VectorXd& t, int samples, double usual, std::vector<char>& restart);

// The steps as an input: one value if all are equal.
Binding BindSteps(const Eigen::VectorXd& dt);

// The states of the graph that these roots need, directly or through other states. One entry for each state: 1 needed.
std::vector<char> StatesOf(const Graph& graph, const std::vector<Expr>& roots);

// The first `count` states over a log, [samples x count]. An entry is the value from which its sample starts; the
// graph's inputs of states have these values. bindings: one for each graph input; those of the states are not read.
// restart[k] != 0: sample k starts anew. wanted: one entry for each state, 0: stays zero; empty: all are wanted.
// Samples must be in order.
Eigen::MatrixXd StatePath(const Graph& graph, std::size_t count, std::span<const Binding> bindings, int samples,
                          std::span<const char> restart, std::vector<char> wanted = {});

}  // namespace armcal::codegen

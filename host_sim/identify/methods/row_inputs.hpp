// methods - what a model's expressions read, at chosen rows alone.
#pragma once

#include <span>
#include <utility>
#include <vector>

#include "codegen/src/generator/tape.hpp"
#include "host_sim/identify/methods/method.hpp"

namespace armcal::calibration {

class RowInputs {
 public:
  // index: places in `rows`.
  RowInputs(const Problem& problem, const Rows& rows, const std::vector<Eigen::Index>& index);
  RowInputs(const RowInputs&) = delete;
  RowInputs& operator=(const RowInputs&) = delete;

  // One binding per graph input, with the unknowns of z. Valid until the next call.
  std::span<const codegen::Binding> At(const Eigen::VectorXd& z);

  // Whether all that the expression reads is bound: signals of the sample and unknowns. Memory and the committed model
  // are not.
  bool Covers(codegen::Expr e) const;

  std::size_t numbers() const;  // that it stores

 private:
  codegen::Signals signals_;
  std::vector<codegen::Binding> input_;
  std::vector<std::pair<std::size_t, int>> unknown_;  // input, coordinate of z
  std::vector<std::size_t> unbound_;
};

}  // namespace armcal::calibration

// methods - gathers the signals of some rows, and binds them to a graph's inputs.
#include "host_sim/identify/methods/row_inputs.hpp"

#include <algorithm>
#include <map>

#include "codegen/src/generator/derivative.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;

RowInputs::RowInputs(const Problem& problem, const Rows& rows, const std::vector<Eigen::Index>& index) {
  const codegen::Model& model = *problem.model;
  const auto count = static_cast<Eigen::Index>(index.size());
  const auto place = [&](Eigen::Index r) { return static_cast<std::size_t>(index[static_cast<std::size_t>(r)]); };
  const auto log = [&](Eigen::Index r) -> const codegen::Signals& {
    return problem.train[static_cast<std::size_t>(rows.log[place(r)])]->s;
  };
  const auto gather = [&](MatrixXd codegen::Signals::* signal) {
    MatrixXd out = MatrixXd::Zero(count, model.joints());
    for (Eigen::Index r = 0; r < count; ++r)
      if (const MatrixXd& whole = log(r).*signal; whole.cols() == out.cols())
        out.row(r) = whole.row(rows.sample[place(r)]);
    return out;
  };
  codegen::Signals& s = signals_;
  s.q = gather(&codegen::Signals::q), s.qd = gather(&codegen::Signals::qd);
  s.qdd = gather(&codegen::Signals::qdd), s.temp = gather(&codegen::Signals::temp);
  s.t.setZero(count);
  for (Eigen::Index r = 0; r < count; ++r)
    if (log(r).t.size()) s.t[r] = log(r).t[rows.sample[place(r)]];
  std::map<codegen::InputId, const double*> column = {{{codegen::Quantity::kTime}, s.t.data()}};
  for (int i = 0; i < model.joints(); ++i) {
    column[{codegen::Quantity::kPosition, i}] = s.q.col(i).data();
    column[{codegen::Quantity::kSpeed, i}] = s.qd.col(i).data();
    column[{codegen::Quantity::kAcceleration, i}] = s.qdd.col(i).data();
    column[{codegen::Quantity::kTemperature, i}] = s.temp.col(i).data();
  }
  std::map<codegen::InputId, int> coordinate;
  for (int c = 0; c < model.columns(); ++c)
    coordinate[{.quantity = codegen::Quantity::kCoordinate, .parameter = c}] = c;
  for (int k = 0; k < model.nonlinear(); ++k)
    coordinate[codegen::SymbolId(model.unknowns()[k].name)] = model.columns() + k;
  for (const codegen::InputId& name : model.graph().inputs()) {
    if (coordinate.contains(name)) unknown_.push_back({input_.size(), coordinate[name]});
    else if (!column.contains(name)) unbound_.push_back(input_.size());
    input_.push_back({column.contains(name) ? column[name] : nullptr, 0});
  }
}

std::span<const codegen::Binding> RowInputs::At(const Eigen::VectorXd& z) {
  for (const auto& [input, coordinate] : unknown_) input_[input].value = z[coordinate];
  return input_;
}

bool RowInputs::Covers(codegen::Expr e) const {
  return std::none_of(unbound_.begin(), unbound_.end(), [&](std::size_t input) {
    return codegen::Reads(e, e.graph()->Input(e.graph()->inputs()[input]));
  });
}

std::size_t RowInputs::numbers() const { return static_cast<std::size_t>(4 * signals_.q.size()); }

}  // namespace armcal::calibration

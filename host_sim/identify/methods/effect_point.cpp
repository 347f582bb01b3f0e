// methods - evaluates friction and effects at one instant, from the model's graph.
#include "host_sim/identify/methods/effect_point.hpp"

#include <map>

#include "codegen/src/io/input_error.hpp"

namespace armcal::calibration {

using codegen::Expr;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

std::vector<Expr> ColumnRoots(const codegen::Model& model) {
  std::vector<Expr> roots;
  for (int j = 0; j < model.joints(); ++j)
    for (int c = 0; c < model.columns(); ++c)
      if (!model.is_rigid(c) && !model.rows()[j][c].IsZero()) roots.push_back(model.rows()[j][c]);
  return roots;
}

std::vector<Expr> SlopeRoots(const codegen::Model& model) {
  std::vector<Expr> roots;
  for (const auto& row : model.jacobian())
    for (const Expr e : row)
      if (!e.IsZero()) roots.push_back(e);
  return roots;
}

}  // namespace

EffectPoint::EffectPoint(const codegen::Model& model)
    : model_(model), column_tape_(model.graph(), ColumnRoots(model)), slope_tape_(model.graph(), SlopeRoots(model)) {
  if (model.states() > 0)
    throw io::InputError(model.robot().name +
                         ": this method takes one sample by itself; expected no effect with memory");
  for (int j = 0; j < model.joints(); ++j) {
    for (int c = 0; c < model.columns(); ++c)
      if (!model.is_rigid(c) && !model.rows()[j][c].IsZero()) column_place_.push_back({j, c});
    for (int k = 0; k < model.nonlinear(); ++k)
      if (!model.jacobian()[j][k].IsZero()) slope_place_.push_back({j, k});
  }
  std::map<codegen::InputId, Source> known = {{{codegen::Quantity::kTime}, {Source::kTime, 0}}};
  for (int j = 0; j < model.joints(); ++j) {
    known[{codegen::Quantity::kPosition, j}] = {Source::kPosition, j};
    known[{codegen::Quantity::kSpeed, j}] = {Source::kSpeed, j};
    known[{codegen::Quantity::kAcceleration, j}] = {Source::kAcceleration, j};
    known[{codegen::Quantity::kTemperature, j}] = {Source::kTemperature, j};
  }
  for (int d = 0; d < model.rigid(); ++d)
    known[{.quantity = codegen::Quantity::kBaseParameter, .parameter = d}] = {Source::kCommitted, model.front() + d};
  for (int c = 0; c < model.columns(); ++c)
    known[{.quantity = codegen::Quantity::kCoordinate, .parameter = c}] = {Source::kCoordinate, c};
  for (int k = 0; k < model.nonlinear(); ++k)
    known[codegen::SymbolId(model.unknowns()[k].name)] = {Source::kEta, model.columns() + k};
  for (const codegen::InputId& input : model.graph().inputs())
    source_.push_back(known.contains(input) ? known[input] : Source{});
  input_.assign(source_.size(), 0);
}

void EffectPoint::Set(double t, const VectorXd& q, const VectorXd& qd, const VectorXd& qdd, const VectorXd& temp,
                      const VectorXd& z) {
  z_ = z;
  for (std::size_t i = 0; i < source_.size(); ++i) {
    const int k = source_[i].index;
    switch (source_[i].kind) {
      case Source::kZero:
        break;
      case Source::kTime:
        input_[i] = t;
        break;
      case Source::kPosition:
        input_[i] = q[k];
        break;
      case Source::kSpeed:
        input_[i] = qd[k];
        break;
      case Source::kAcceleration:
        input_[i] = qdd[k];
        break;
      case Source::kTemperature:
        input_[i] = temp.size() > k ? temp[k] : 0;
        break;
      case Source::kCommitted:
      case Source::kCoordinate:
      case Source::kEta:
        input_[i] = z[k];
        break;
    }
  }
}

void EffectPoint::Columns(MatrixXd& row) {
  value_.resize(column_place_.size());
  column_tape_.EvaluateAt<double>(input_, scratch_, value_);
  for (std::size_t i = 0; i < value_.size(); ++i) row(column_place_[i].joint, column_place_[i].column) = value_[i];
}

void EffectPoint::Slope(MatrixXd& slope) {
  value_.resize(slope_place_.size());
  slope_tape_.EvaluateAt<double>(input_, scratch_, value_);
  for (std::size_t i = 0; i < value_.size(); ++i) slope(slope_place_[i].joint, slope_place_[i].column) = value_[i];
}

VectorXd EffectPoint::Torque() {
  value_.resize(column_place_.size());
  column_tape_.EvaluateAt<double>(input_, scratch_, value_);
  VectorXd torque = VectorXd::Zero(model_.joints());
  for (std::size_t i = 0; i < value_.size(); ++i)
    torque[column_place_[i].joint] += value_[i] * z_[column_place_[i].column];
  return torque;
}

}  // namespace armcal::calibration

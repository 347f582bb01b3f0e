// generator - evaluates a model over whole logs.
#include <map>

#include "codegen/src/generator/model.hpp"
#include "codegen/src/generator/state_path.hpp"

namespace armcal::codegen {

struct Model::Bound {
  std::vector<Binding> input;  // one per graph input
  Eigen::VectorXd dt;
  Eigen::MatrixXd state;
};

// states: how many of the graph's states the roots need.
Model::Bound Model::Bind(const Signals& s, std::span<const double> committed, std::span<const double> eta,
                         int states) const {
  std::map<InputId, Binding> value;
  for (int j = 0; j < joints(); ++j) {
    value[{Quantity::kPosition, j}].column = s.q.col(j).data();
    value[{Quantity::kSpeed, j}].column = s.qd.col(j).data();
    value[{Quantity::kAcceleration, j}].column = s.qdd.col(j).data();
    if (s.temp.cols() > j) value[{Quantity::kTemperature, j}].column = s.temp.col(j).data();
  }
  if (s.t.size()) value[{Quantity::kTime}].column = s.t.data();
  for (int d = 0; d < rigid_ && !committed.empty(); ++d)
    value[{.quantity = Quantity::kBaseParameter, .parameter = d}].value = committed[front_ + d];
  for (int k = 0; k < nonlinear(); ++k)
    value[SymbolId(unknown_[k].name)].value = eta.empty() ? table_[parameters() - nonlinear() + k].mean : eta[k];
  Bound bound;
  std::vector<char> restart;
  if (states > 0) {
    bound.dt = SampleSteps(s.t, s.samples(), robot_.sample_ticks / robot_.tick_rate_Hz, restart);
    value[{Quantity::kTimeStep}] = BindSteps(bound.dt);
  }
  const auto in_order = [&] {
    bound.input.clear();
    for (const InputId& input : graph_->inputs()) bound.input.push_back(value[input]);
  };
  in_order();
  if (states > 0) {
    bound.state = StatePath(*graph_, states, bound.input, s.samples(), restart);
    for (int k = 0; k < states; ++k) value[SymbolId(graph_->states()[k].name)].column = bound.state.col(k).data();
    in_order();
  }
  return bound;
}

namespace {
// Evaluates [joint][column] expressions into one N x columns matrix a joint; zero expressions cost nothing.
void EvaluateRows(const Graph& graph, const std::vector<std::vector<Expr>>& rows, std::span<const Binding> bindings,
                  int samples, std::vector<Eigen::MatrixXd>& out, const Tape* tape = nullptr) {
  std::vector<Expr> roots;
  std::vector<double*> target;
  out.resize(rows.size());
  for (std::size_t i = 0; i < rows.size(); ++i) {
    out[i].resize(samples, static_cast<Eigen::Index>(rows[i].size()));
    for (std::size_t c = 0; c < rows[i].size(); ++c) {
      roots.push_back(rows[i][c]);
      target.push_back(out[i].col(static_cast<Eigen::Index>(c)).data());
    }
  }
  if (tape) return tape->Evaluate(bindings, samples, target);
  Tape(graph, roots).Evaluate(bindings, samples, target);
}
}  // namespace

void Model::Regressor(const Signals& s, std::span<const double> committed, std::span<const double> eta,
                      std::vector<Eigen::MatrixXd>& row) const {
  EvaluateRows(*graph_, rows_, Bind(s, committed, eta, states_).input, s.samples(), row, regressor_tape_.get());
}

void Model::ForEachBlock(const Signals& s, std::span<const double> committed, std::span<const double> eta,
                         const Tape::Visit& visit) const {
  const Bound bound = Bind(s, committed, eta, states_);
  regressor_tape_->ForEachBlock(bound.input, s.samples(), visit);
}

void Model::Jacobian(const Signals& s, std::span<const double> committed, std::span<const double> p,
                     std::span<const double> eta, std::vector<Eigen::MatrixXd>& row) const {
  Bound bound = Bind(s, committed, eta, states_ + sensitivities());
  for (std::size_t i = 0; i < graph_->inputs().size(); ++i)
    if (const InputId& input = graph_->inputs()[i]; input.quantity == Quantity::kCoordinate)
      bound.input[i].value = p[input.parameter];
  EvaluateRows(*graph_, jacobian_, bound.input, s.samples(), row);
}

void Model::BodyColumns(const Signals& s, int body, std::vector<Eigen::MatrixXd>& out) const {
  std::vector<std::vector<Expr>> rows;
  for (const auto& r : body_rows_) rows.emplace_back(r.begin() + kBodyBlock * body, r.begin() + kBodyBlock * body + 10);
  EvaluateRows(*graph_, rows, Bind(s, {}, {}, 0).input, s.samples(), out);
  const Eigen::MatrixXd slide = SlideMap(robot_).block(kBodyBlock * body, kBodyBlock * body, 10, 10);
  for (auto& m : out) m = (m * slide).eval();
}

void Model::GravityRegressor(const Signals& s, std::vector<Eigen::MatrixXd>& row) const {
  std::vector<std::vector<Expr>> rows;
  for (const auto& r : gravity_rows_) {
    rows.emplace_back();
    for (const int c : base_.column) rows.back().push_back(r[c]);
  }
  EvaluateRows(*graph_, rows, Bind(s, {}, {}, 0).input, s.samples(), row);
}

}  // namespace armcal::codegen

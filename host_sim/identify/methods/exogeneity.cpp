// methods - one joint after the other along its instruments, all of them judged together; knows no file.
#include "host_sim/identify/methods/exogeneity.hpp"

#include <algorithm>
#include <cmath>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/data/logs/butterworth.hpp"
#include "host_sim/data/logs/quintic_spline.hpp"
#include "host_sim/identify/methods/augmented_regression.hpp"
#include "host_sim/identify/methods/closed_loop.hpp"
#include "host_sim/identify/methods/simulated_logs.hpp"

namespace armcal::calibration {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kLevel = 0.05;
constexpr double kMatters = 0.05;   // bias over residual; with rows enough any test finds less than any use would
constexpr double kSmoothed = 0.2;   // of the bandwidth
constexpr double kEnough_Hz = 100;  // of rows: motion and its noise lie below 60 Hz, and rows cost

std::vector<int> Present(const codegen::Model& model, int joint) {
  std::vector<int> present;
  for (const int c : MakePrior(model).active)
    if (c < model.columns() && !model.rows()[joint][c].IsZero()) present.push_back(c);
  return present;
}

// The smallest p of m is judged at level / m, the next at level / (m - 1), ... until one is not small enough.
void JudgeByHolm(std::vector<JointExogeneity>& joint) {
  std::vector<JointExogeneity*> tested;
  for (JointExogeneity& j : joint)
    if (j.restrictions > 0) tested.push_back(&j);
  std::sort(tested.begin(), tested.end(), [](const auto* a, const auto* b) { return a->p < b->p; });
  for (std::size_t k = 0; k < tested.size() && tested[k]->p < kLevel / static_cast<double>(tested.size() - k); ++k)
    tested[k]->exogenous = tested[k]->bias_Nm < kMatters * tested[k]->left_Nm;
}

double Rate_Hz(const Dataset& d) { return (d.samples() - 1) / (d.s.t[d.samples() - 1] - d.s.t[0]); }

// Every m-th sample; used where all m are.
Dataset Thinned(const Dataset& d, int m) {
  Dataset out = d;
  const auto rows = Eigen::seqN(0, d.samples() / m, m);
  out.s.t = d.s.t(rows), out.tau = d.tau(rows, Eigen::all);
  for (auto signal : {&codegen::Signals::q, &codegen::Signals::qd, &codegen::Signals::qdd, &codegen::Signals::temp})
    if ((d.s.*signal).size() > 0) out.s.*signal = (d.s.*signal)(rows, Eigen::all);
  out.used = d.used(rows, Eigen::all);
  for (int k = 1; k < m; ++k) out.used = out.used.cwiseMin(d.used(Eigen::seqN(k, d.samples() / m, m), Eigen::all));
  return out;
}

// Joint's used rows of one log, below those that are there.
void AddRows(const Dataset& data, const MatrixXd& measured, const MatrixXd& instrument, const std::vector<int>& columns,
             int joint, JointRows& rows) {
  std::vector<int> used;
  const auto before = rows.tau.size();
  for (int k = 0, run = 0; k < data.samples(); ++k) {
    run = data.used(k, joint) ? run + 1 : 0;
    if (run == 1) rows.pieces.push_back({before + static_cast<Eigen::Index>(used.size()), 0});
    if (run > 0) ++rows.pieces.back().count, used.push_back(k);
  }
  const auto after = before + static_cast<Eigen::Index>(used.size());
  rows.X.conservativeResize(after, static_cast<Eigen::Index>(columns.size()));
  rows.Z.conservativeResize(after, static_cast<Eigen::Index>(columns.size()));
  rows.tau.conservativeResize(after);
  rows.X.bottomRows(after - before) = measured(used, columns);
  rows.Z.bottomRows(after - before) = instrument(used, columns);
  rows.tau.tail(after - before) = data.tau.col(joint)(used);
}

Dataset AlongSpline(const Dataset& data, const MatrixXd& q) {
  Dataset out = data;
  const logs::QuinticSpline spline(data.s.t, q);
  out.s.q = spline.Evaluate(data.s.t, 0), out.s.qd = spline.Evaluate(data.s.t, 1);
  out.s.qdd = spline.Evaluate(data.s.t, 2);
  return out;
}

}  // namespace

bool Exogeneity::passed() const {
  return std::all_of(joint.begin(), joint.end(), [](const JointExogeneity& j) { return j.exogenous; });
}

Exogeneity TestExogeneity(const codegen::Model& model, const std::vector<const Dataset*>& data,
                          const std::vector<Dataset>& instruments, const VectorXd& z) {
  const std::span<const double> p{z.data(), static_cast<std::size_t>(model.columns())};
  const std::span<const double> eta{z.data() + model.columns(), static_cast<std::size_t>(model.nonlinear())};
  std::vector<JointRows> rows(static_cast<std::size_t>(model.joints()));
  for (std::size_t l = 0; l < data.size(); ++l) {
    // What remembers the samples before has to see them all.
    const int every = model.states() > 0 ? 1 : std::max(1, static_cast<int>(Rate_Hz(*data[l]) / kEnough_Hz));
    const Dataset log = Thinned(*data[l], every);
    std::vector<MatrixXd> measured, instrument;
    model.Regressor(log.s, p, eta, measured);
    model.Regressor(Thinned(instruments[l], every).s, p, eta, instrument);
    for (std::size_t j = 0; j < rows.size(); ++j)
      AddRows(log, measured[j], instrument[j], Present(model, static_cast<int>(j)), static_cast<int>(j), rows[j]);
  }
  Exogeneity out;
  for (const JointRows& r : rows) out.joint.push_back(r.tau.size() ? AugmentedRegression(r) : JointExogeneity{});
  JudgeByHolm(out.joint);
  return out;
}

std::vector<Dataset> SimulatedInstruments(const Problem& problem, const VectorXd& z) {
  LoopLogs loop(problem, "exogeneity test");
  loop.Simulate(z);
  return loop.logs();
}

std::vector<Dataset> ReferenceInstruments(const std::vector<const Dataset*>& data) {
  std::vector<Dataset> out;
  for (const Dataset* d : data) out.push_back(AlongSpline(*d, d->reference));
  return out;
}

std::vector<Dataset> SmoothedInstruments(const std::vector<const Dataset*>& data) {
  std::vector<Dataset> out;
  for (const Dataset* d : data) {
    const double rate = Rate_Hz(*d);
    MatrixXd q = d->s.q;
    for (int j = 0; j < d->joints(); ++j) {
      const double bandwidth = d->cutoff_Hz.size() > j ? d->cutoff_Hz[j] : 0.4 * rate;
      q.col(j) = logs::ZeroPhaseLowPass(q.col(j), kSmoothed * bandwidth, rate);
    }
    out.push_back(AlongSpline(*d, q));
  }
  return out;
}

namespace {

// Empty where the arm that the robot file describes does not follow its reference in simulation.
std::vector<Dataset> Simulated(const codegen::Model& model, const std::vector<Dataset>& data,
                               const std::map<std::string, MatrixXd>& reference, const VectorXd& z) {
  if (model.robot().control.structure.empty() || model.states() > 0) return {};
  Problem problem = MakeProblem(model, Pointers(data));
  try {
    problem.closed_loop = MakeClosedLoop(model, reference);
    return SimulatedInstruments(problem, z);
  } catch (const io::InputError&) {
    return {};  // the reference itself serves, too
  }
}

}  // namespace

Exogeneity CheckExogeneity(const codegen::Model& model, const std::vector<Dataset>& data, const VectorXd& z,
                           Instruments best) {
  const std::map<std::string, MatrixXd> reference = References(data);
  std::string kind = kSimulatedLoop;
  std::vector<Dataset> instruments;
  if (best == Instruments::kSimulated && !reference.empty()) instruments = Simulated(model, data, reference, z);
  if (instruments.empty()) {
    kind = reference.empty() ? kSmoothedPositions : kCommandedMotion;
    instruments = reference.empty() ? SmoothedInstruments(Pointers(data)) : ReferenceInstruments(Pointers(data));
  }
  Exogeneity e = TestExogeneity(model, Pointers(data), instruments, z);
  e.instruments = kind;
  return e;
}

}  // namespace armcal::calibration

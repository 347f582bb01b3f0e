// diagnosis - fits the base model with the current terms.
#include "host_sim/diagnose/diagnosis/work.hpp"

#include <algorithm>
#include <cmath>

#include "codegen/src/generator/state_path.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
constexpr int kPasses = 3;
constexpr double kSettled = 1e-3;  // relative change of the residuals' spread after which nothing else moves
}  // namespace

std::vector<const Chosen*> Confirmed(const std::vector<Chosen>& chosen, const Chosen* without) {
  std::vector<const Chosen*> out;
  for (const Chosen& c : chosen)
    if (&c != without && c.confirmed) out.push_back(&c);
  return out;
}

namespace {
bool Any(const std::set<codegen::InputId>& reads, codegen::Quantity quantity) {
  return std::any_of(reads.begin(), reads.end(), [&](const auto& input) { return input.quantity == quantity; });
}
}  // namespace

Quantities MakeQuantities(const codegen::Model& model, const calibration::Dataset& data,
                          const std::set<codegen::InputId>& reads) {
  Quantities out;
  out.data = &data;
  out.dt = codegen::SampleSteps(data.s.t, data.samples(), 0, out.restart);
  for (const codegen::InputId& input : reads)
    if (input.quantity == codegen::Quantity::kBodyColumn && !out.body.contains(input.body))
      model.BodyColumns(data.s, input.body, out.body[input.body]);
  return out;
}

void Follow(const codegen::Model& model, const codegen::ArmTorque& arm, const VectorXd& x,
            const std::vector<double>& eta, const std::set<codegen::InputId>& reads, Quantities& quantities) {
  const calibration::Dataset& data = *quantities.data;
  arm.Evaluate(data.s, {x.data() + model.front(), static_cast<std::size_t>(model.rigid())}, reads, quantities.parts);
  if (Any(reads, codegen::Quantity::kModelTorque) || Any(reads, codegen::Quantity::kDelayedTorque))
    quantities.tau_model = calibration::Predict(model, data, x, eta);
}

MatrixXd CandidateTorque(const Candidate& candidate, const Quantities& quantities, const std::vector<double>& eta,
                         const VectorXd& amplitude) {
  const auto& s = quantities.data->s;
  MatrixXd tau = MatrixXd::Zero(s.samples(), s.q.cols());
  std::vector<std::vector<VectorXd>> value;
  candidate.Evaluate(quantities, eta, value);
  for (int c = 0; c < candidate.columns(eta); ++c)
    for (std::size_t r = 0; r < candidate.rows().size(); ++r)
      if (value[c][r].size()) tau.col(candidate.rows()[r]) += amplitude[c] * value[c][r];
  return tau;
}

Diagnosis::Work::Work(const codegen::Model& m, const codegen::Catalogue& catalogue,
                      std::vector<const calibration::Dataset*> logs)
    : model(m),
      arm(m),
      train(std::move(logs)),
      logged(train),
      prior(calibration::MakePrior(m)),
      candidates(MakeCandidates(catalogue, m)) {
  if (train.empty()) throw io::InputError("diagnose: expected at least one training log");
  declared = calibration::WeightedFit(model, train);
  estimate.x = declared.x;
  estimate.sigma = declared.sigma;
  for (const auto& e : model.effects())
    for (const auto& p : model.table())
      if (p.effect == e.record->name && p.state == "standby") standby.push_back(p.effect);
  for (const auto& c : candidates) all_reads.merge(c->inputs());
  evidence.model = &model;
  IndexRows();
}

void Diagnosis::Work::IndexRows() {
  evidence.index.assign(model.joints(), {});
  for (int j = 0; j < model.joints(); ++j)
    for (std::size_t log = 0; log < train.size(); ++log) {
      int previous = -2;
      for (int k = 0; k < train[log]->samples(); ++k) {
        if (!train[log]->used(k, j)) continue;
        evidence.index[j].dataset.push_back(static_cast<int>(log));
        evidence.index[j].sample.push_back(k);
        evidence.index[j].segment_begin.push_back(k != previous + 1);
        previous = k;
      }
    }
}

void Diagnosis::Work::AlignLogs() {
  double by_s = 0;
  for (const Chosen& c : chosen) by_s += c.confirmed ? c.delay_s : 0;
  if (by_s != delay_s) SetDelay(by_s);
}

void Diagnosis::Work::SetDelay(double by_s) {
  delay_s = by_s;
  delayed.clear();
  for (const auto* d : logged) delayed.push_back(calibration::Delayed(*d, by_s));
  for (std::size_t k = 0; k < train.size(); ++k) train[k] = &delayed[k];
  regressor.clear();
  evidence.logs.clear();
  IndexRows();
  if (narrow) narrow->SetDelay(by_s);
}

std::vector<NoiseModel> Diagnosis::Work::WhiteNoise() const {
  std::vector<NoiseModel> noise(model.joints());
  for (int j = 0; j < model.joints(); ++j) noise[j].innovation = estimate.sigma[j];
  return noise;
}

void Diagnosis::Work::Solve(const std::vector<const Chosen*>& terms) {
  const int n = model.joints(), active = static_cast<int>(declared.active.size());
  estimate = Estimate{};
  estimate.x = declared.x;
  estimate.sigma = declared.sigma;
  Estimate out;
  for (int pass = 0; pass < kPasses; ++pass) {  // model torque and weights depend on the estimate
    Prepare(terms);
    const Metric metric(rows, WhiteNoise());
    const VectorXd v = rows.L * metric.z();
    out = Estimate{};
    out.x = prior.mean;
    for (int a = 0; a < active; ++a) out.x[declared.active[a]] = rows.mean[a] + v[a];
    int at = active;
    for (const Chosen* t : terms) {
      out.amplitude.push_back(v.segment(at, t->candidate->columns(t->eta)));
      at += t->candidate->columns(t->eta);
    }
    out.sigma.resize(n), out.innovation.resize(n);
    for (int j = 0; j < n; ++j) {
      const VectorXd e = metric.RawResidual(j);
      out.sigma[j] =
          e.size() ? std::max(1e-12, std::sqrt(e.squaredNorm() / static_cast<double>(e.size()))) : declared.sigma[j];
      out.innovation[j] = FitNoise(rows.index[j], e).innovation;
    }
    if (terms.empty()) out.x = declared.x, out.sigma = declared.sigma;  // `before` and `after` are then the same fit
    const bool settled = (out.sigma - estimate.sigma).cwiseQuotient(out.sigma).cwiseAbs().maxCoeff() < kSettled;
    estimate = out;
    if (settled) break;
  }
}

}  // namespace armcal::diagnosis

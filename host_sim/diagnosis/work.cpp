// diagnosis - fits the base model with the current terms; rebuilds what the search reads.
#include "host_sim/diagnosis/work.hpp"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "codegen/src/generator/state_path.hpp"
#include "host_sim/io/input_error.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

Quantities MakeQuantities(const codegen::Model& model, const codegen::ArmTorque& arm, const calibration::Dataset& data,
                          const VectorXd& x, const std::vector<double>& eta, bool flange) {
  Quantities out;
  out.data = &data;
  const int n = model.joints(), samples = data.samples();
  out.parts = arm.Evaluate(data.s, {x.data() + model.front(), static_cast<std::size_t>(model.rigid())});
  out.tau_model = calibration::Predict(model, data, x, eta);
  out.dt = codegen::SampleSteps(data.s.t, samples, 0, out.restart);
  out.dtau_model = MatrixXd::Zero(samples, n);
  for (int k = 1; k + 1 < samples; ++k)  // central differences: the prediction carries no noise of the torque
    if (!out.restart[k] && !out.restart[k + 1])
      out.dtau_model.row(k) = (out.tau_model.row(k + 1) - out.tau_model.row(k - 1)) / (data.s.t[k + 1] - data.s.t[k - 1]);
  if (flange) model.BodyColumns(data.s, n - 1, out.flange);
  return out;
}

MatrixXd CandidateTorque(const Candidate& candidate, const Quantities& quantities, const std::vector<double>& eta,
                         const VectorXd& amplitude) {
  const auto& s = quantities.data->s;
  MatrixXd tau = MatrixXd::Zero(s.samples(), s.q.cols());
  std::vector<std::vector<VectorXd>> value;
  candidate.Evaluate(quantities, eta, value);
  for (int c = 0; c < candidate.columns(); ++c)
    for (std::size_t r = 0; r < candidate.rows().size(); ++r)
      if (value[c][r].size()) tau.col(candidate.rows()[r]) += amplitude[c] * value[c][r];
  return tau;
}

Diagnosis::Work::Work(const codegen::Model& m, const codegen::Catalogue& catalogue,
                      std::vector<const calibration::Dataset*> logs)
    : model(m), arm(m), train(std::move(logs)), prior(calibration::MakePrior(m)), candidates(MakeCandidates(catalogue, m)) {
  if (train.empty()) throw io::InputError("diagnose: expected at least one training log");
  declared = calibration::WeightedFit(model, train);
  estimate.x = declared.x;
  estimate.sigma = declared.sigma;
  for (const auto& e : model.effects())
    for (const auto& p : model.table())
      if (p.effect == e.record->name && p.state == "standby") standby.push_back(p.effect);
  for (const auto& c : candidates) needs_flange = needs_flange || c->reads("Y");
  evidence.model = &model;
  evidence.index.resize(model.joints());
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

std::vector<NoiseModel> Diagnosis::Work::WhiteNoise() const {
  std::vector<NoiseModel> noise(model.joints());
  for (int j = 0; j < model.joints(); ++j) noise[j].innovation = estimate.sigma[j];
  return noise;
}

void Diagnosis::Work::Prepare(const std::vector<const Chosen*>& terms) {
  const int n = model.joints(), columns = model.columns();
  evidence.logs.clear();
  for (const auto* d : train)
    evidence.logs.push_back(MakeQuantities(model, arm, *d, estimate.x, declared.eta, needs_flange));
  rows = BaseRows{};
  rows.index = evidence.index;
  rows.informative = prior.informative;
  const int active = static_cast<int>(declared.active.size());
  std::vector<Columns> term_columns;
  int extra = 0;
  for (const Chosen* t : terms) {
    term_columns.push_back(GatherColumns(*t->candidate, evidence, t->eta));
    extra += term_columns.back().count();
  }
  // raw design in x coordinates: active columns, gains, then the terms
  std::vector<MatrixXd> raw(n);
  for (int j = 0; j < n; ++j) {
    raw[j] = MatrixXd::Zero(evidence.index[j].size(), active + extra);
    rows.target.emplace_back(evidence.index[j].size());
  }
  for (std::size_t log = 0; log < train.size(); ++log) {
    std::vector<MatrixXd> row;
    model.Regressor(train[log]->s, {estimate.x.data(), static_cast<std::size_t>(columns)}, declared.eta, row);
    for (int j = 0; j < n; ++j) {
      const VectorXd at_estimate = row[j] * estimate.x.head(columns), at_mean = row[j] * prior.mean.head(columns);
      const RowIndex& index = evidence.index[j];
      for (int k = 0; k < index.size(); ++k) {
        if (index.dataset[k] != static_cast<int>(log)) continue;
        const int s = index.sample[k];
        for (int a = 0; a < active; ++a) {
          const int c = declared.active[a];
          raw[j](k, a) = c < columns ? row[j](s, c) : (c == columns + j ? at_estimate[s] : 0);
        }
        rows.target[j][k] = train[log]->tau(s, j) - at_mean[s];
      }
    }
  }
  int at = active;
  for (const Columns& c : term_columns) {
    for (std::size_t r = 0; r < c.joints.size(); ++r) raw[c.joints[r]].middleCols(at, c.count()) = c.block[r];
    at += c.count();
  }
  // coordinates z in which the prior is unit and directions that nobody sees are left out
  rows.mean = prior.mean;
  const int size = active + extra;
  MatrixXd H = MatrixXd::Zero(size, size);
  for (int j = 0; j < n; ++j) H += raw[j].transpose() * raw[j] / (estimate.sigma[j] * estimate.sigma[j]);
  VectorXd scale(size);
  for (int i = 0; i < size; ++i) scale[i] = H(i, i) > 0 ? 1 / std::sqrt(H(i, i)) : 0;
  if (prior.informative) {
    MatrixXd P0(active, active);
    for (int i = 0; i < active; ++i)
      for (int k = 0; k < active; ++k) P0(i, k) = prior.covariance(declared.active[i], declared.active[k]);
    const VectorXd sd = P0.diagonal().cwiseSqrt().cwiseMax(1e-300);
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(
        MatrixXd(sd.cwiseInverse().asDiagonal() * P0 * sd.cwiseInverse().asDiagonal()));
    rows.L = MatrixXd::Zero(size, size);
    rows.L.topLeftCorner(active, active) =
        sd.asDiagonal() * eigen.eigenvectors() * eigen.eigenvalues().cwiseMax(0).cwiseSqrt().asDiagonal();
    // a term has no prior worth the name: a million times what one whitened unit of it would need
    for (int i = active; i < size; ++i)
      rows.L(i, i) = 1e3 * scale[i] * std::sqrt(static_cast<double>(evidence.index[0].size()));
  } else {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(scale.asDiagonal() * H * scale.asDiagonal()));
    const double floor = 1e-10 * eigen.eigenvalues()[size - 1];
    int keep = 0;
    for (int i = 0; i < size; ++i) keep += eigen.eigenvalues()[i] > floor;
    rows.L = scale.asDiagonal() * eigen.eigenvectors().rightCols(keep) *
             eigen.eigenvalues().tail(keep).cwiseSqrt().cwiseInverse().asDiagonal();
  }
  for (int j = 0; j < n; ++j) rows.design.push_back(raw[j] * rows.L);
}

Diagnosis::Work::Estimate Diagnosis::Work::Solve(const std::vector<const Chosen*>& terms) {
  const int n = model.joints(), active = static_cast<int>(declared.active.size());
  estimate.x = declared.x;
  estimate.sigma = declared.sigma;
  Estimate out;
  for (int pass = 0; pass < 3; ++pass) {  // model torque and weights depend on the estimate
    Prepare(terms);
    const Metric metric(rows, WhiteNoise());
    const VectorXd v = rows.L * metric.z();
    const MatrixXd P = rows.L * metric.Covariance() * rows.L.transpose();
    out = Estimate{};
    out.x = prior.mean;
    for (int a = 0; a < active; ++a) out.x[declared.active[a]] += v[a];
    int at = active;
    for (const Chosen* t : terms) {
      out.amplitude.push_back(v.segment(at, t->candidate->columns()));
      out.sd.push_back(P.diagonal().segment(at, t->candidate->columns()).cwiseMax(0).cwiseSqrt());
      at += t->candidate->columns();
    }
    out.sigma.resize(n), out.innovation.resize(n);
    for (int j = 0; j < n; ++j) {
      const VectorXd e = metric.RawResidual(j);
      out.sigma[j] =
          e.size() ? std::max(1e-12, std::sqrt(e.squaredNorm() / static_cast<double>(e.size()))) : declared.sigma[j];
      out.innovation[j] = FitNoise(rows.index[j], e).innovation;
    }
    if (terms.empty()) out.x = declared.x, out.sigma = declared.sigma;  // `before` and `after` are then the same fit
    estimate = out;
  }
  return out;
}

}  // namespace armcal::diagnosis

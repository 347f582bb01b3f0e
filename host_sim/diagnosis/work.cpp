// diagnosis - fits the base model with the current terms; rebuilds what the search reads.
#include "host_sim/diagnosis/work.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "codegen/src/generator/state_path.hpp"
#include "host_sim/calibration/delay.hpp"
#include "host_sim/io/input_error.hpp"

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

Quantities MakeQuantities(const codegen::Model& model, const codegen::ArmTorque& arm, const calibration::Dataset& data,
                          const VectorXd& x, const std::vector<double>& eta, bool flange) {
  Quantities out;
  out.data = &data;
  const int n = model.joints(), samples = data.samples();
  out.parts = arm.Evaluate(data.s, {x.data() + model.front(), static_cast<std::size_t>(model.rigid())});
  out.tau_model = calibration::Predict(model, data, x, eta);
  out.dt = codegen::SampleSteps(data.s.t, samples, 0, out.restart);
  if (flange) model.BodyColumns(data.s, n - 1, out.flange);
  return out;
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
  for (const auto& c : candidates) needs_flange = needs_flange || c->reads("Y");
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

void Diagnosis::Work::SetDelay(double delay_s) {
  delayed.clear();
  for (const auto* d : logged) delayed.push_back(calibration::Delayed(*d, delay_s));
  for (std::size_t k = 0; k < train.size(); ++k) train[k] = &delayed[k];
  regressor.clear();
  IndexRows();
  if (narrow) narrow->SetDelay(delay_s);
}

std::vector<NoiseModel> Diagnosis::Work::WhiteNoise() const {
  std::vector<NoiseModel> noise(model.joints());
  for (int j = 0; j < model.joints(); ++j) noise[j].innovation = estimate.sigma[j];
  return noise;
}

// The declared model's rows over the used samples, coordinates declared.active.
void Diagnosis::Work::FillDeclared() {
  const int n = model.joints(), columns = model.columns(), active = static_cast<int>(declared.active.size());
  const VectorXd mean = prior.mean.head(columns), x = estimate.x.head(columns);
  if (model.depends_on_estimate() || regressor.empty()) {
    regressor.resize(train.size());
    for (std::size_t log = 0; log < train.size(); ++log)
      model.Regressor(train[log]->s, {x.data(), static_cast<std::size_t>(columns)}, declared.eta, regressor[log]);
  }
  rows.mean.resize(active);
  for (int a = 0; a < active; ++a) rows.mean[a] = prior.mean[declared.active[a]];
  for (int j = 0; j < n; ++j) {
    const RowIndex& index = rows.index[j];
    std::vector<int> own;
    for (int a = 0; a < active; ++a) {
      const int c = declared.active[a];
      if (c == columns + j || (c < columns && !model.rows()[j][c].IsZero())) own.push_back(a);
    }
    MatrixXd design(index.size(), static_cast<Eigen::Index>(own.size()));
    VectorXd target(index.size());
    std::vector<VectorXd> at_estimate, at_mean;
    for (const auto& row : regressor) at_estimate.push_back(row[j] * x), at_mean.push_back(row[j] * mean);
    for (std::size_t i = 0; i < own.size(); ++i) {
      const int c = declared.active[own[i]];
      for (int k = 0; k < index.size(); ++k)
        design(k, static_cast<Eigen::Index>(i)) = c < columns ? regressor[index.dataset[k]][j](index.sample[k], c)
                                                              : at_estimate[index.dataset[k]][index.sample[k]];
    }
    for (int k = 0; k < index.size(); ++k)
      target[k] = train[index.dataset[k]]->tau(index.sample[k], j) - at_mean[index.dataset[k]][index.sample[k]];
    for (const int a : own) {
      const int c = declared.active[a];
      if (c >= columns || model.is_rigid(c) || model.column_joint(c) != j) continue;
      const auto& p = model.table()[model.table_index(c)];
      if (std::isfinite(p.lower) || std::isfinite(p.upper)) rows.bounded.push_back({j, a, p.lower, p.upper});
    }
    rows.columns.push_back(std::move(own));
    rows.design.push_back(std::move(design));
    rows.target.push_back(std::move(target));
  }
}

void Diagnosis::Work::Prepare(const std::vector<const Chosen*>& terms) {
  const int active = static_cast<int>(declared.active.size());
  evidence.logs.clear();
  for (const auto* d : train)
    evidence.logs.push_back(MakeQuantities(model, arm, *d, estimate.x, declared.eta, needs_flange));
  rows = BaseRows{};
  rows.index = evidence.index;
  rows.informative = prior.informative;
  FillDeclared();
  int size = active;
  std::vector<std::pair<int, const MatrixXd*>> curves;
  for (const Chosen* t : terms) {
    const Columns c = GatherColumns(*t->candidate, evidence, t->eta);
    for (std::size_t r = 0; r < c.joints.size(); ++r) {
      const int j = c.joints[r];
      const Eigen::Index before = rows.design[j].cols();
      rows.design[j].conservativeResize(Eigen::NoChange, before + c.count());
      rows.design[j].rightCols(c.count()) = c.block[r];
      for (int i = 0; i < c.count(); ++i) rows.columns[j].push_back(size + i);
    }
    if (t->found.precision.size()) curves.emplace_back(size, &t->found.precision);
    size += c.count();
  }
  if (!curves.empty()) rows.precision = MatrixXd::Zero(size, size);
  for (const auto& [at, precision] : curves)
    rows.precision.block(at, at, precision->rows(), precision->cols()) = *precision;
  rows.mean.conservativeResize(size);
  rows.mean.tail(size - active).setZero();
  MakeCoordinates(size);
}

// Coordinates z in which the prior is unit and directions that nobody sees are left out.
void Diagnosis::Work::MakeCoordinates(int size) {
  const int active = static_cast<int>(declared.active.size());
  MatrixXd H = MatrixXd::Zero(size, size);
  for (int j = 0; j < model.joints(); ++j) {
    const auto& columns = rows.columns[j];
    const double weight = 1 / (estimate.sigma[j] * estimate.sigma[j]);
    if (prior.informative) {
      for (std::size_t i = 0; i < columns.size(); ++i)
        H(columns[i], columns[i]) += weight * rows.design[j].col(static_cast<Eigen::Index>(i)).squaredNorm();
      continue;
    }
    const MatrixXd gram = weight * rows.design[j].transpose() * rows.design[j];
    for (std::size_t i = 0; i < columns.size(); ++i)
      for (std::size_t k = 0; k < columns.size(); ++k)
        H(columns[i], columns[k]) += gram(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k));
  }
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
    // a term has no prior worth the name: a thousand times what one whitened unit in every row of it would need
    for (int i = active; i < size; ++i)
      rows.L(i, i) = 1e3 * scale[i] * std::sqrt(static_cast<double>(evidence.index[0].size()));
    return;
  }
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(MatrixXd(scale.asDiagonal() * H * scale.asDiagonal()));
  const double floor = 1e-10 * eigen.eigenvalues()[size - 1];
  int keep = 0;
  for (int i = 0; i < size; ++i) keep += eigen.eigenvalues()[i] > floor;
  rows.L = scale.asDiagonal() * eigen.eigenvectors().rightCols(keep) *
           eigen.eigenvalues().tail(keep).cwiseSqrt().cwiseInverse().asDiagonal();
}

Diagnosis::Work::Estimate Diagnosis::Work::Solve(const std::vector<const Chosen*>& terms) {
  const int n = model.joints(), active = static_cast<int>(declared.active.size());
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
  return out;
}

}  // namespace armcal::diagnosis

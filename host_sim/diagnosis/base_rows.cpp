// diagnosis - rebuilds what the search reads at the current estimate: model torque, the base model's rows, coordinates.
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "host_sim/diagnosis/work.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

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

// What the terms' torque on joint j changes by per unit of the model torque that their columns read there, at the last
// amplitudes; empty if none reads it.
VectorXd Diagnosis::Work::SlopeOverModelTorque(const std::vector<const Chosen*>& terms, int j) {
  const double step = 1e-6 * model.robot().joint[j].torque_limit_Nm;
  VectorXd sum;
  for (std::size_t t = 0; t < terms.size() && t < estimate.amplitude.size(); ++t) {
    const Candidate& c = *terms[t]->candidate;
    const auto row = std::find(c.rows().begin(), c.rows().end(), j) - c.rows().begin();
    if (row == static_cast<long>(c.rows().size()) || c.has_memory() || !c.reads("tau_model")) continue;
    const auto torque = [&](double shift) {  // with the model torque so much larger
      std::vector<VectorXd> kept;
      for (Quantities& log : evidence.logs) {
        kept.push_back(log.tau_model.col(j));
        log.tau_model.col(j).array() += shift;
      }
      const VectorXd out =
          GatherColumns(c, evidence, terms[t]->eta).block[static_cast<std::size_t>(row)] * estimate.amplitude[t];
      for (std::size_t l = 0; l < kept.size(); ++l) evidence.logs[l].tau_model.col(j) = kept[l];
      return out;
    };
    const VectorXd slope = (torque(step) - torque(-step)) / (2 * step);
    sum = sum.size() ? VectorXd(sum + slope) : slope;
  }
  return sum;
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
  // A term that reads the model's torque changes with the parameters, too: where it cuts torque off they change
  // nothing.
  for (int j = 0; j < model.joints(); ++j) {
    const VectorXd slope = SlopeOverModelTorque(terms, j);
    for (int k = 0; k < slope.size(); ++k) {
      const int log = rows.index[j].dataset[k], sample = rows.index[j].sample[k];
      const double at_mean = train[log]->tau(sample, j) - rows.target[j][k];
      rows.target[j][k] += slope[k] * (evidence.logs[log].tau_model(sample, j) - at_mean);
      rows.design[j].row(k) *= 1 + slope[k];
    }
  }
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

}  // namespace armcal::diagnosis

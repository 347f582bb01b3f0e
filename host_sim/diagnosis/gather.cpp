// diagnosis - columns of candidates over used rows, all of them or every m-th sample.
#include <algorithm>

#include "host_sim/diagnosis/search.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

Columns Gather(const Candidate& candidate, const std::vector<Quantities>& logs, const std::vector<RowIndex>& rows,
               const std::vector<double>& eta) {
  Columns out;
  out.joints = candidate.rows();
  for (const int j : out.joints) out.block.emplace_back(MatrixXd::Zero(rows[j].size(), candidate.columns(eta)));
  std::vector<std::vector<VectorXd>> value;
  for (std::size_t log = 0; log < logs.size(); ++log) {
    candidate.Evaluate(logs[log], eta, value);
    for (std::size_t r = 0; r < out.joints.size(); ++r) {
      const RowIndex& index = rows[out.joints[r]];
      for (int c = 0; c < candidate.columns(eta); ++c) {
        const VectorXd& v = value[c][r];
        if (v.size() == 0) continue;
        for (int k = 0; k < index.size(); ++k)
          if (index.dataset[k] == static_cast<int>(log)) out.block[r](k, c) = v[index.sample[k]];
      }
    }
  }
  return out;
}

MatrixXd PickRows(const MatrixXd& m, int every) {
  return m.rows() == 0 ? m : MatrixXd(m(Eigen::seq(0, m.rows() - 1, every), Eigen::all));
}

// What columns without memory may read, at every m-th sample.
Quantities PickSamples(const Quantities& q, int every, calibration::Dataset& data) {
  data.s = {PickRows(q.data->s.t, every), PickRows(q.data->s.q, every), PickRows(q.data->s.qd, every),
            PickRows(q.data->s.qdd, every), PickRows(q.data->s.temp, every)};
  data.tau = PickRows(q.data->tau, every);
  Quantities out;
  out.data = &data;
  out.parts.rigid = PickRows(q.parts.rigid, every), out.parts.gravity = PickRows(q.parts.gravity, every);
  for (const auto& [from, to] : {std::pair{&q.parts.mass, &out.parts.mass}, std::pair{&q.parts.tilt, &out.parts.tilt}})
    for (const auto& row : *from) {
      to->emplace_back();
      for (const VectorXd& v : row) to->back().push_back(PickRows(v, every));
    }
  out.tau_model = PickRows(q.tau_model, every);
  for (const MatrixXd& m : q.flange) out.flange.push_back(PickRows(m, every));
  return out;
}

}  // namespace

Columns GatherColumns(const Candidate& candidate, const Evidence& evidence, const std::vector<double>& eta) {
  return Gather(candidate, evidence.logs, evidence.index, eta);
}

Thinned::Thinned(const Evidence& evidence, int rows) : all(evidence) {
  for (const Quantities& log : evidence.logs) every = std::max(every, log.data->samples() / rows);
  for (const Quantities& log : evidence.logs) {
    data.push_back(std::make_unique<calibration::Dataset>());
    logs.push_back(PickSamples(log, every, *data.back()));
  }
  for (const RowIndex& from : evidence.index) {
    kept.emplace_back(), index.emplace_back(), in_all.emplace_back();
    for (int k = 0; k < from.size(); ++k) {
      if (from.sample[k] % every) continue;
      kept.back().push_back(k);
      for (RowIndex* to : {&index.back(), &in_all.back()}) {
        to->dataset.push_back(from.dataset[k]);
        to->segment_begin.push_back(1);
        to->sample.push_back(to == &index.back() ? from.sample[k] / every : from.sample[k]);
      }
    }
  }
}

Columns Thinned::Gather(const Candidate& candidate, const std::vector<double>& eta) const {
  return candidate.has_memory() ? diagnosis::Gather(candidate, all.logs, in_all, eta)
                                : diagnosis::Gather(candidate, logs, index, eta);
}

BaseRows Thinned::Pick(const BaseRows& from) const {
  BaseRows out;
  out.columns = from.columns, out.informative = from.informative, out.L = from.L, out.mean = from.mean;
  out.precision = from.precision;
  out.index = index;
  for (int j = 0; j < from.joints(); ++j) {
    out.design.push_back(from.design[j](kept[j], Eigen::all));
    out.target.push_back(from.target[j](kept[j]));
  }
  return out;
}

}  // namespace armcal::diagnosis

// diagnosis - evaluates candidates over all used rows or every m-th sample, and checks their excitation.
#include "host_sim/diagnose/diagnosis/evidence.hpp"

#include <algorithm>
#include <utility>

#include "host_sim/identify/calibration/channel.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kSmooth_s = 0.02;     // over which columns are taken to be smooth
constexpr double kRounding_Nm = 1e-9;  // of a column at the width of its prior: such as gravity's about an upright axis

constexpr std::size_t kKeptValues = 30'000'000;  // 240 MB

std::size_t SizeOf(const Columns& columns) {
  std::size_t values = 0;
  for (const MatrixXd& block : columns.block) values += static_cast<std::size_t>(block.size());
  return values;
}

// The samples about row k are all used and in one piece.
bool IsWhole(const RowIndex& rows, int k, int reach) {
  return k >= reach && k + reach < rows.size() && rows.dataset[k - reach] == rows.dataset[k + reach] &&
         rows.sample[k + reach] - rows.sample[k - reach] == 2 * reach;
}

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
      for (int c = 0; c < candidate.columns(eta); ++c)
        if (const VectorXd& v = value[c][r]; v.size())
          index.Take(static_cast<int>(log), calibration::ThroughChannel(*logs[log].data, out.joints[r], v),
                     out.block[r].col(c));
    }
  }
  for (int c = 0; c < candidate.columns(eta); ++c) {
    const double width = candidate.column(c).sd;
    const auto shows = [&](const MatrixXd& block) { return (block.col(c).array().abs() * width > kRounding_Nm).any(); };
    if (width > 0 && std::none_of(out.block.begin(), out.block.end(), shows))
      for (MatrixXd& block : out.block) block.col(c).setZero();
  }
  return out;
}

MatrixXd PickRows(const MatrixXd& m, int every) {
  return m.rows() == 0 ? m : MatrixXd(m(Eigen::seq(0, m.rows() - 1, every), Eigen::all));
}

// What columns may read at every m-th sample; those with memory at every one only.
Quantities PickSamples(const Quantities& q, int every, calibration::Dataset& data) {
  data.s = {PickRows(q.data->s.t, every), PickRows(q.data->s.q, every), PickRows(q.data->s.qd, every),
            PickRows(q.data->s.qdd, every), PickRows(q.data->s.temp, every)};
  data.tau = PickRows(q.data->tau, every);
  data.channel = q.data->channel;
  Quantities out;
  out.data = &data;
  if (every == 1) out.dt = q.dt, out.restart = q.restart;
  out.parts.rigid = PickRows(q.parts.rigid, every), out.parts.gravity = PickRows(q.parts.gravity, every);
  for (const auto& [from, to] :
       {std::pair{&q.parts.mass, &out.parts.mass}, std::pair{&q.parts.tilt, &out.parts.tilt},
        std::pair{&q.parts.stiffness, &out.parts.stiffness}, std::pair{&q.parts.slope, &out.parts.slope},
        std::pair{&q.parts.speed_slope, &out.parts.speed_slope}, std::pair{&q.parts.jacobian, &out.parts.jacobian},
        std::pair{&q.parts.approach_slope, &out.parts.approach_slope}})
    for (const auto& row : *from) {
      to->emplace_back();
      for (const VectorXd& v : row) to->back().push_back(PickRows(v, every));
    }
  for (const VectorXd& v : q.parts.flange) out.parts.flange.push_back(PickRows(v, every));
  for (const VectorXd& v : q.parts.approach) out.parts.approach.push_back(PickRows(v, every));
  out.tau_model = PickRows(q.tau_model, every);
  for (const auto& [body, rows] : q.body)
    for (const MatrixXd& m : rows) out.body[body].push_back(PickRows(m, every));
  return out;
}

}  // namespace

Columns GatherColumns(const Candidate& candidate, const Evidence& evidence, const std::vector<double>& eta) {
  return Gather(candidate, evidence.logs, evidence.index, eta);
}

const Columns* KeptColumns::Find(const Candidate& candidate, const std::vector<double>& eta) {
  const auto at = kept_.find({&candidate, eta});
  if (at == kept_.end()) return nullptr;
  at->second.used = true;
  return &at->second.columns;
}

void KeptColumns::Keep(const Candidate& candidate, const std::vector<double>& eta, const Columns& columns) {
  if (values_ > kKeptValues) return;
  values_ += SizeOf(columns);
  kept_.insert_or_assign({&candidate, eta}, Entry{columns});
}

void KeptColumns::ForgetUnused() {
  for (auto at = kept_.begin(); at != kept_.end();) {
    const bool used = std::exchange(at->second.used, false);
    if (!used) values_ -= SizeOf(at->second.columns);
    at = used ? std::next(at) : kept_.erase(at);
  }
}

Thinned::Thinned(const Evidence& evidence, int rows, KeptColumns& columns) : all(evidence), kept_columns(columns) {
  const auto averaged = [](const RowIndex& each) { return each.averaged(); };
  int skip = 1;
  if (std::none_of(evidence.index.begin(), evidence.index.end(), averaged))
    for (const Quantities& log : evidence.logs) every = std::max(every, log.data->samples() / rows);
  else  // averages are few in each log, and hang together with those beside them
    for (const RowIndex& each : evidence.index)
      if (each.averaged()) skip = std::max(skip, each.size() / rows);
  every |= 1;  // odd: a sample in the middle
  double longest_s = 0;
  for (const Quantities& log : evidence.logs) longest_s = std::max(longest_s, log.dt[0]);
  reach = std::min(every / 2, static_cast<int>(0.5 * kSmooth_s / longest_s));
  for (std::size_t log = 0; log < evidence.logs.size(); log += static_cast<std::size_t>(skip)) {
    data.push_back(std::make_unique<calibration::Dataset>());
    logs.push_back(PickSamples(evidence.logs[log], every, *data.back()));
  }
  double before = 0, left = 0;
  for (const RowIndex& from : evidence.index) {
    kept.emplace_back(), index.emplace_back();
    RowIndex& to = index.back();
    for (int k = 0; k < from.size(); ++k) {
      if (from.dataset[k] % skip || (every > 1 && (from.sample[k] % every || !IsWhole(from, k, reach)))) continue;
      kept.back().push_back(k);
      to.dataset.push_back(from.dataset[k] / skip);
      to.segment_begin.push_back(every > 1 || from.segment_begin[k]);
      to.sample.push_back(from.sample[k] / every);
    }
    for (std::size_t log = 0; every == 1 && log < from.average.size(); log += static_cast<std::size_t>(skip))
      to.average.push_back(from.average[log]);
    if (from.weight.size()) to.weight = from.weight(kept.back());
    before += from.size(), left += static_cast<double>(kept.back().size());
  }
  if (skip > 1) of_logs = left / before;
}

Columns Thinned::Gather(const Candidate& candidate, const std::vector<double>& eta) const {
  if (candidate.record().depends_on_estimate) return GatherAnew(candidate, eta);
  if (const Columns* known = kept_columns.Find(candidate, eta)) return *known;
  Columns out = GatherAnew(candidate, eta);
  kept_columns.Keep(candidate, eta, out);
  return out;
}

Columns Thinned::GatherAnew(const Candidate& candidate, const std::vector<double>& eta) const {
  if (every == 1 || !candidate.has_memory()) return diagnosis::Gather(candidate, logs, index, eta);
  Columns out = GatherColumns(candidate, all, eta);
  for (std::size_t r = 0; r < out.joints.size(); ++r) out.block[r] = AverageRows(out.block[r], out.joints[r]);
  return out;
}

MatrixXd Thinned::AverageRows(const MatrixXd& m, int j) const {
  const auto size = static_cast<Eigen::Index>(kept[j].size());
  MatrixXd out = MatrixXd::Zero(size, m.cols());
  for (Eigen::Index c = 0; c < m.cols(); ++c)
    for (Eigen::Index k = 0; k < size; ++k)
      out(k, c) = m.col(c).segment(kept[j][static_cast<std::size_t>(k)] - reach, 2 * reach + 1).mean();
  return out;
}

BaseRows Thinned::Average(const BaseRows& from, const std::vector<NoiseModel>& noise,
                          std::vector<NoiseModel>& averaged) const {
  BaseRows out;
  out.columns = from.columns, out.L = from.L, out.mean = from.mean;
  out.precision = from.precision;
  out.index = index;
  averaged = noise;
  for (int j = 0; j < from.joints(); ++j) {
    NoiseModel& own = averaged[static_cast<std::size_t>(j)];
    const bool whitens = every > 1 && !IsWhite(own);  // averages do not follow each other
    const auto average = [&](const MatrixXd& m) {
      return AverageRows(
          whitens ? MatrixXd(SlowNoise(own) * WhitenColumns(noise[static_cast<std::size_t>(j)], from.index[j], m)) : m,
          j);
    };
    out.design.push_back(average(from.design[j]));
    out.target.push_back(average(from.target[j]));
    out.Multiply(j);
    if (whitens) own = NoiseModel{{}, SlowNoise(own), {}, {}};
    own.innovation *= this->noise();
  }
  return out;
}

namespace {
// Of a joint: too few for terms beside the base. Averages are independent, samples hang together.
constexpr int kFewRows = 200, kFewAverages = 100;
constexpr double kSlow = 0.1;  // of the fastest that was seen is low speed, of the joint's limit is high speed
constexpr int kFewSlowRows = 30;
constexpr double kAboveStiction = 5;  // times v_min: a log that only creeps has no low speed to compare
constexpr double kTempSpan_K = 2;
constexpr double kLoadSpan = 2;  // times the torque's noise
}  // namespace

VectorXd OwnSignal(const Candidate& candidate, const Evidence& evidence, std::string name) {
  int j = candidate.joints().empty() ? candidate.rows()[0] : candidate.joints()[0];
  const RowIndex& index = evidence.index[j];
  const bool size = name.starts_with("abs(");
  if (size) name = name.substr(4, name.size() - 5);
  if (name.ends_with("[k]")) {
    name.resize(name.size() - 3);
    j = candidate.joints().at(1);
  }
  VectorXd out(index.size());
  for (int k = 0; k < index.size(); ++k) {
    const Quantities& log = evidence.logs[index.dataset[k]];
    const auto& s = log.data->s;
    const int at = index.sample[k];
    out[k] = name == "t"      ? s.t[at]
             : name == "q"    ? s.q(at, j)
             : name == "qd"   ? s.qd(at, j)
             : name == "temp" ? (s.temp.cols() > j ? s.temp(at, j) : 0)
                              : log.parts.rigid(at, j);
  }
  return size ? out.cwiseAbs() : out;
}

bool HasEnough(const RowIndex& rows) { return rows.size() >= (rows.averaged() ? kFewAverages : kFewRows); }

bool IsExcited(const Candidate& candidate, const Evidence& evidence) {
  const auto enough = [&](int j) { return HasEnough(evidence.index[static_cast<std::size_t>(j)]); };
  // What belongs to no joint may show on any joint that it moves.
  if (candidate.joints().empty()) return std::any_of(candidate.rows().begin(), candidate.rows().end(), enough);
  const int j = candidate.joints()[0];
  const auto& joint = evidence.model->robot().joint[j];
  if (!enough(j)) return false;
  for (const std::string& need : candidate.record().needs) {
    if (need == "low_speed" || need == "high_speed") {
      const VectorXd v = OwnSignal(candidate, evidence, "qd").cwiseAbs();
      const double fastest = v.maxCoeff();
      if (need == "high_speed" && fastest < kSlow * joint.speed_limit_radps) return false;
      if (need == "low_speed" &&
          ((v.array() < kSlow * fastest).count() < kFewSlowRows || fastest < kAboveStiction * joint.v_min_radps))
        return false;
    } else if (need == "temp_span") {
      const VectorXd temp = OwnSignal(candidate, evidence, "temp");
      if (temp.maxCoeff() - temp.minCoeff() < kTempSpan_K) return false;
    } else if (need == "load_span") {
      const VectorXd load = OwnSignal(candidate, evidence, "tau_rigid").cwiseAbs();
      if (load.maxCoeff() - load.minCoeff() < kLoadSpan * joint.torque_noise_Nm) return false;
    }
  }
  return true;
}

}  // namespace armcal::diagnosis

// diagnosis - fits the base model with the current terms, and computes its rows at the estimate.
#include "host_sim/diagnose/diagnosis/work.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "codegen/src/generator/state_path.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/diagnose/diagnosis/noise.hpp"
#include "host_sim/diagnose/diagnosis/row_trust.hpp"
#include "host_sim/identify/calibration/band.hpp"
#include "host_sim/identify/calibration/channel.hpp"
#include "host_sim/identify/calibration/dataset.hpp"

namespace armcal::diagnosis {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {
// Of the ratio of mean squares in sliding to those near turns and at rest. Once the terms that are about these rows are
// known, what is left of them is noise, and each row weighs as its noise asks for. Before, it is mostly what is looked
// for, and would hardly be fitted. Without any weight, what is not known of rest would bend the parameters of sliding.
constexpr double kKnownTurns = 0.5, kUnknownTurns = 0.25;
constexpr int kPasses = 3;
constexpr std::size_t kKept = 64;   // columns of terms
constexpr double kTakesOver = 0.9;  // share of a named column that a curve can give
constexpr double kHeld = 1e6;       // weight of a curve's part along a named column, over that of the rows
constexpr double kSettled = 1e-3;   // relative change of the residuals' spread after which nothing else moves
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
Eigen::LDLT<MatrixXd> Ridged(MatrixXd gram) {
  gram.diagonal() *= 1 + 1e-9;
  gram.diagonal().array() += 1e-300;
  return Eigen::LDLT<MatrixXd>(gram);
}
// Products of `some` of a joint's columns with each other, less what the declared ones explain. coordinate: of each
// column; the first `active` are declared.
MatrixXd Left(const MatrixXd& gram, int active, const std::vector<int>& coordinate,
              const std::vector<Eigen::Index>& some) {
  std::vector<Eigen::Index> known;
  for (std::size_t i = 0; i < coordinate.size(); ++i)
    if (coordinate[i] < active) known.push_back(static_cast<Eigen::Index>(i));
  const MatrixXd across = gram(known, some);
  return gram(some, some) - across.transpose() * Ridged(gram(known, known)).solve(across);
}
// The sample with the largest weight in one row of averages.
int MiddleSample(const RowIndex::Average& average, int row) {
  int middle = 0;
  double most = 0;
  for (RowIndex::Average::InnerIterator entry(average, row); entry; ++entry)
    if (entry.value() > most) most = entry.value(), middle = static_cast<int>(entry.col());
  return middle;
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
    quantities.tau_model = calibration::ModelTorque(model, data, x, eta);
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
  return calibration::ThroughChannel(*quantities.data, calibration::AsSaved(*quantities.data, std::move(tau)));
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
  // A channel that is known has a delay of its own. What another one would still gain is the filter's form.
  if (!train[0]->channel.empty()) std::erase_if(candidates, [](const auto& c) { return c->delay() >= 0; });
  declared = calibration::WeightedFit(model, train);
  estimate.x = declared.x;
  estimate.sigma = declared.sigma;
  for (const auto& e : model.effects())
    for (const auto& p : model.table())
      if (p.effect == e.record->name && p.state == "standby") standby.push_back(p.effect);
  for (const auto& c : candidates) all_reads.merge(c->inputs());
  evidence.model = &model;
  turns.assign(static_cast<std::size_t>(model.joints()), 0);
  turn_weight.setOnes(model.joints());
  for (const auto* log : logged) known_start.push_back(Eigen::MatrixXi::Ones(log->samples(), model.joints()));
  IndexRows();
}

Diagnosis::Work::Work(const Work& other, std::vector<const calibration::Dataset*> logs)
    : Work(other.model, codegen::Catalogue{}, std::move(logs)) {
  all_reads = other.all_reads;
  if (turns == other.turns) return;
  turns = other.turns, turn_weight = other.turn_weight;
  IndexRows();
}

void Diagnosis::Work::PrepareAsIn(const Work& other, const std::vector<const Chosen*>& terms,
                                  const Candidate& further) {
  estimate = other.estimate;
  FollowEstimate(other.Reads(terms, &further));
  Prepare(terms);
}

RowIndex UsedRows(const std::vector<const calibration::Dataset*>& logs, int joint) {
  RowIndex index;
  for (std::size_t log = 0; log < logs.size(); ++log) {
    const calibration::Dataset& data = *logs[log];
    index.average.push_back(data.averaged(joint) ? &data.average[static_cast<std::size_t>(joint)] : nullptr);
    int previous = -2;
    const auto add = [&](int sample, bool follows) {
      index.dataset.push_back(static_cast<int>(log));
      index.sample.push_back(sample);
      index.segment_begin.push_back(!follows);
      previous = sample;
    };
    if (const RowIndex::Average* average = index.average.back()) {
      const double apart_s = 0.5 / data.band_Hz[joint];
      for (int row = 0; row < average->rows(); ++row) {
        const int middle = MiddleSample(*average, row);
        add(middle, previous >= 0 && data.s.t[middle] - data.s.t[previous] < 1.5 * apart_s);
      }
    } else {
      for (int k = 0; k < data.samples(); ++k)
        if (data.used(k, joint)) add(k, k == previous + 1);
    }
  }
  return index;
}

void Diagnosis::Work::WeighKnocks(bool weigh) {
  knocks = weigh;
  if (narrow) narrow->WeighKnocks(weigh);
  regressor.clear();
  IndexRows();
}

void Diagnosis::Work::IndexRows() {
  evidence.index.clear(), evidence.steady.clear();
  gathered.clear();
  kept_columns.Clear();
  std::vector<MatrixXd> left;
  for (const auto* log : train)
    if (knocks) left.push_back(log->tau - calibration::Predict(model, *log, declared.x, declared.eta));
  for (int j = 0; j < model.joints(); ++j) {
    evidence.index.push_back(UsedRows(train, j));
    VectorXd steady(evidence.index.back().size());
    for (std::size_t log = 0; log < train.size(); ++log)
      evidence.index.back().Take(static_cast<int>(log), SteadyFriction(model, *train[log], j), steady);
    evidence.steady.push_back((steady.array() > 0.5).cast<double>());
    // What is left of averages, near turns and at rest is the model's error.
    if (!knocks || evidence.index.back().averaged() || turns[static_cast<std::size_t>(j)]) continue;
    VectorXd e(evidence.index.back().size());
    for (std::size_t log = 0; log < left.size(); ++log)
      evidence.index.back().Take(static_cast<int>(log), left[log].col(j), e);
    evidence.index.back().weight = KnockWeights(evidence.index.back(), e);
  }
  WeighRows();
}

// Weighs the rows of the joints that are fitted near turns and at rest, too.
void Diagnosis::Work::WeighRows() {
  sliding.assign(turns.size(), {});
  for (int j = 0; j < model.joints(); ++j) {
    const auto at = static_cast<std::size_t>(j);
    RowIndex& index = evidence.index[at];
    if (!turns[at]) continue;
    sliding[at].resize(index.size());
    for (std::size_t log = 0; log < train.size(); ++log)
      index.Take(static_cast<int>(log), train[log]->slides.col(j).cast<double>(), sliding[at]);
    index.weight = sliding[at].array() + (1 - sliding[at].array()) * turn_weight[j];
  }
}

void Diagnosis::Work::WeighTurns(const std::vector<const Chosen*>& terms) {
  Solve(terms);
  const Metric metric(rows, WhiteNoise());
  for (int j = 0; j < model.joints(); ++j) {
    const auto at = static_cast<std::size_t>(j);
    if (!turns[at]) continue;
    const VectorXd e = metric.RawResidual(j).cwiseQuotient(evidence.index[at].weight);
    double square[2] = {}, count[2] = {};
    for (Eigen::Index k = 0; k < e.size(); ++k) {
      const int slides = sliding[at][k] > 0.5;
      square[slides] += e[k] * e[k], count[slides] += 1;
    }
    if (count[0] > 0 && count[1] > 0 && square[0] > 0)
      turn_weight[j] = std::clamp(
          std::pow(square[1] / count[1] / (square[0] / count[0]), terms.empty() ? kUnknownTurns : kKnownTurns), 1e-3,
          1.0);
  }
  MakeTrain();
  if (narrow) narrow->turn_weight = turn_weight, narrow->MakeTrain();
}

void Diagnosis::Work::AlignLogs() {
  double by_s = 0;
  for (const Chosen& c : chosen) by_s += c.confirmed ? c.delay_s : 0;
  if (by_s != delay_s) SetDelay(by_s);
}

void Diagnosis::Work::SetDelay(double by_s) {
  delay_s = by_s;
  MakeTrain();
  if (narrow) narrow->SetDelay(by_s);
}

void Diagnosis::Work::LeaveOutUnsettled(const Chosen& term) {
  if (term.candidate->instance().settled.empty()) return;
  FollowEstimate(Reads({}, term.candidate));
  std::vector<Eigen::MatrixXi> keeps = known_start;
  for (std::size_t log = 0; log < train.size(); ++log) {
    const Eigen::ArrayXi knows = (term.candidate->Settled(evidence.logs[log], term.eta).array() > 0.5).cast<int>();
    if (2 * knows.count() < knows.size()) continue;  // too little of the log would be left
    for (const int j : term.candidate->rows())
      if (!train[log]->averaged(j)) keeps[log].col(j).array() *= knows;
  }
  if (keeps == known_start) return;
  known_start = std::move(keeps);
  MakeTrain();
  if (narrow) narrow->known_start = known_start, narrow->MakeTrain();
}

void Diagnosis::Work::ShowTurns(const std::vector<char>& joints) {
  if (joints == turns) return;
  turns = joints;
  turn_weight.setOnes();
  MakeTrain();
  if (narrow) narrow->ShowTurns(joints);
}

// The logs as delay, turns and terms with memory ask for them.
void Diagnosis::Work::MakeTrain() {
  changed.clear();
  for (std::size_t log = 0; log < logged.size(); ++log) {
    changed.push_back(delay_s != 0 ? calibration::Delayed(*logged[log], delay_s) : *logged[log]);
    for (Eigen::MatrixXi* rows_in : {&changed.back().used, &changed.back().sound})
      if (rows_in->size() > 0) rows_in->array() *= known_start[log].array();
    for (int j = 0; j < model.joints(); ++j)
      if (turns[static_cast<std::size_t>(j)]) calibration::UseTurns(changed.back(), j);
  }
  for (std::size_t k = 0; k < train.size(); ++k) train[k] = &changed[k];
  regressor.clear();
  evidence.logs.clear();
  IndexRows();
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
    out.sigma.resize(n);
    for (int j = 0; j < n; ++j) {
      const VectorXd e = metric.RawResidual(j);
      out.sigma[j] =
          e.size() ? std::max(1e-12, std::sqrt(e.squaredNorm() / static_cast<double>(e.size()))) : declared.sigma[j];
    }
    if (terms.empty()) {  // `before` and `after` are then the same fit
      out.x = declared.x;
      for (int j = 0; j < n; ++j)
        if (turns[static_cast<std::size_t>(j)] || rows.index[j].weight.size() == 0) out.sigma[j] = declared.sigma[j];
    }
    const bool settled = (out.sigma - estimate.sigma).cwiseQuotient(out.sigma).cwiseAbs().maxCoeff() < kSettled;
    estimate = out;
    if (settled) break;
  }
}

std::set<codegen::InputId> Diagnosis::Work::Reads(const std::vector<const Chosen*>& terms,
                                                  const Candidate* further) const {
  std::set<codegen::InputId> out;
  for (const Chosen* t : terms) out.merge(t->candidate->inputs());
  if (further) out.merge(further->inputs());
  return out;
}

// Candidates read the model's torque as the estimate has it.
void Diagnosis::Work::FollowEstimate(const std::set<codegen::InputId>& reads) {
  if (evidence.logs.empty()) {
    for (const auto* d : train) evidence.logs.push_back(MakeQuantities(model, *d, all_reads));
    followed.resize(0);
  }
  if (followed.size() != estimate.x.size() || followed != estimate.x) followed_reads.clear();
  std::set<codegen::InputId> stale;
  std::set_difference(reads.begin(), reads.end(), followed_reads.begin(), followed_reads.end(),
                      std::inserter(stale, stale.end()));
  if (stale.empty()) return;
  for (Quantities& log : evidence.logs) Follow(model, arm, estimate.x, declared.eta, stale, log);
  followed = estimate.x;
  followed_reads.merge(stale);
}

// What of the declared model's rows no estimate changes; coordinates declared.active.
void Diagnosis::Work::StartRows() {
  const int n = model.joints(), columns = model.columns(), active = static_cast<int>(declared.active.size());
  rows = BaseRows{};
  rows.index = evidence.index;
  rows.columns.resize(n), rows.design.resize(n), rows.target.resize(n);
  bent.assign(n, 1);
  const VectorXd x = estimate.x.head(columns);
  regressor.resize(train.size());
  for (std::size_t log = 0; log < train.size(); ++log) {
    model.Regressor(train[log]->s, {x.data(), static_cast<std::size_t>(columns)}, declared.eta, regressor[log]);
    calibration::PassThroughChannel(*train[log], regressor[log]);
  }
  for (int j = 0; j < n; ++j)
    for (int a = 0; a < active; ++a) {
      const int c = declared.active[a];
      if (c != columns + j && (c >= columns || model.rows()[j][c].IsZero())) continue;
      rows.columns[j].push_back(a);
      if (c >= columns || model.is_rigid(c) || model.column_joint(c) != j) continue;
      const auto& p = model.table()[model.table_index(c)];
      if (std::isfinite(p.lower) || std::isfinite(p.upper)) rows.bounded.push_back({j, a, p.lower, p.upper});
    }
}

// The declared model's rows of one joint over the used samples.
void Diagnosis::Work::FillDeclared(int j) {
  const int columns = model.columns();
  const RowIndex& index = rows.index[j];
  const VectorXd mean = prior.mean.head(columns);
  rows.design[j].resize(index.size(), static_cast<Eigen::Index>(rows.columns[j].size()));
  rows.target[j].resize(index.size());
  for (std::size_t log = 0; log < train.size(); ++log) {
    const MatrixXd& row = regressor[log][j];
    for (std::size_t i = 0; i < rows.columns[j].size(); ++i)
      if (const int c = declared.active[rows.columns[j][i]]; c < columns)
        index.Take(static_cast<int>(log), row.col(c), rows.design[j].col(static_cast<Eigen::Index>(i)));
    index.Take(static_cast<int>(log), train[log]->tau.col(j) - row * mean, rows.target[j]);
  }
}

// The measured torque in the rows of joint j.
VectorXd Diagnosis::Work::Measured(int j) const {
  VectorXd out(rows.index[j].size());
  for (std::size_t log = 0; log < train.size(); ++log)
    rows.index[j].Take(static_cast<int>(log), train[log]->tau.col(j), out);
  return out;
}

// The column of the joint's torque gain, its last one: the model's torque at the estimate. False if there is none.
bool Diagnosis::Work::FillGain(int j) {
  const auto& own = rows.columns[j];
  const Eigen::Index last = static_cast<Eigen::Index>(own.size()) - 1;
  if (last < 0 || declared.active[own.back()] < model.columns()) return false;
  VectorXd off(last);  // from the prior mean
  for (Eigen::Index i = 0; i < last; ++i) {
    const int c = declared.active[own[static_cast<std::size_t>(i)]];
    off[i] = estimate.x[c] - prior.mean[c];
  }
  rows.design[j].col(last) = rows.design[j].leftCols(last) * off - rows.target[j] + Measured(j);
  return true;
}

// What the terms' torque on joint j changes by per unit of the model torque that their columns read there, at the last
// amplitudes; empty if none reads it.
VectorXd Diagnosis::Work::SlopeOverModelTorque(const std::vector<const Chosen*>& terms, int j) {
  const double step = 1e-6 * model.robot().joint[j].torque_limit_Nm;
  VectorXd sum;
  for (std::size_t t = 0; t < terms.size() && t < estimate.amplitude.size(); ++t) {
    const Candidate& c = *terms[t]->candidate;
    const auto row = std::find(c.rows().begin(), c.rows().end(), j) - c.rows().begin();
    if (row == static_cast<long>(c.rows().size()) || c.has_memory() || !c.reads(codegen::Quantity::kModelTorque))
      continue;
    const auto torque = [&](double shift) {  // with the model torque so much larger
      std::vector<VectorXd> kept;
      for (Quantities& log : evidence.logs) {
        kept.push_back(log.tau_model.col(j));
        log.tau_model.col(j).array() += shift;
      }
      VectorXd out =
          GatherColumns(c, evidence, terms[t]->eta).block[static_cast<std::size_t>(row)] * estimate.amplitude[t];
      for (std::size_t l = 0; l < kept.size(); ++l) evidence.logs[l].tau_model.col(j) = kept[l];
      return out;
    };
    VectorXd slope = (torque(step) - torque(-step)) / (2 * step);
    if (const VectorXd& weight = evidence.index[static_cast<std::size_t>(j)].weight; weight.size())
      slope = slope.cwiseQuotient(weight);
    sum = sum.size() ? VectorXd(sum + slope) : slope;
  }
  return sum;
}

const Columns& Diagnosis::Work::ColumnsOf(const Chosen& term) {
  const auto [at, fresh] = gathered.try_emplace({term.candidate, term.eta});
  if (fresh || term.candidate->record().depends_on_estimate)
    at->second = GatherColumns(*term.candidate, evidence, term.eta);
  return at->second;
}

void Diagnosis::Work::Prepare(const std::vector<const Chosen*>& terms) {
  const int active = static_cast<int>(declared.active.size());
  const auto follows = [](const Chosen* t) { return t->candidate->record().depends_on_estimate; };
  if (evidence.logs.empty() || std::any_of(terms.begin(), terms.end(), follows)) FollowEstimate(Reads(terms));
  if (model.depends_on_estimate() || regressor.empty()) StartRows();
  rows.mean.resize(active);
  for (int a = 0; a < active; ++a) rows.mean[a] = prior.mean[declared.active[a]];
  if (gathered.size() > kKept) gathered.clear();
  std::vector<const Columns*> added;
  for (const Chosen* t : terms) added.push_back(&ColumnsOf(*t));
  for (int j = 0; j < model.joints(); ++j) {
    std::erase_if(rows.columns[j], [&](int c) { return c >= active; });
    const auto declared_columns = static_cast<Eigen::Index>(rows.columns[j].size());
    if (bent[j]) FillDeclared(j);
    else rows.design[j].conservativeResize(Eigen::NoChange, declared_columns);
    Eigen::Index same = bent[j] ? 0 : declared_columns;
    if (FillGain(j)) same = std::min(same, declared_columns - 1);
    bent[j] = 0;
    if (const VectorXd slope = SlopeOverModelTorque(terms, j); slope.size()) Bend(j, slope), same = 0;
    int at = active;
    for (const Columns* c : added) {
      if (const auto r = std::find(c->joints.begin(), c->joints.end(), j); r != c->joints.end()) {
        rows.design[j].conservativeResize(Eigen::NoChange, rows.design[j].cols() + c->count());
        rows.design[j].rightCols(c->count()) = c->block[static_cast<std::size_t>(r - c->joints.begin())];
        for (int i = 0; i < c->count(); ++i) rows.columns[j].push_back(at + i);
      }
      at += c->count();
    }
    rows.Multiply(j, same);
  }
  int size = active;
  std::vector<std::pair<int, const MatrixXd*>> curves;
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (terms[t]->found.precision.size()) curves.emplace_back(size, &terms[t]->found.precision);
    size += added[t]->count();
  }
  rows.precision = curves.empty() ? MatrixXd() : MatrixXd::Zero(size, size);
  for (const auto& [at, precision] : curves)
    rows.precision.block(at, at, precision->rows(), precision->cols()) = *precision;
  KeepCausesApart(terms);
  rows.mean.conservativeResize(size);
  rows.mean.tail(size - active).setZero();
  MakeCoordinates(size);
}

// A curve over the signals of a named term could take its place, and the term's parameters would say nothing. So it
// says only what the term leaves: its coefficients are held where its trace is orthogonal to the term's columns, both
// less what the declared columns explain. The term's parameters then are the same with and without the curve.
void Diagnosis::Work::KeepCausesApart(const std::vector<const Chosen*>& terms) {
  const int active = static_cast<int>(declared.active.size());
  int at = active;
  std::vector<int> begin;
  for (const Chosen* t : terms) begin.push_back(at), at += t->candidate->columns(t->eta);
  for (std::size_t t = 0; t < terms.size(); ++t) {
    const Candidate& curve = *terms[t]->candidate;
    if (!curve.is_curve() || terms[t]->found.precision.size() == 0) continue;
    const int j = curve.rows()[0], count = curve.columns(terms[t]->eta);
    const auto& own = rows.columns[j];
    const auto place = [&](int coordinate) { return std::find(own.begin(), own.end(), coordinate) - own.begin(); };
    const Eigen::Index first = place(begin[t]);
    for (std::size_t u = 0; u < terms.size(); ++u) {
      const Candidate& cause = *terms[u]->candidate;
      if (cause.is_curve() || cause.record().signals != curve.record().signals || cause.joints() != curve.joints())
        continue;
      for (int c = 0; c < cause.columns(terms[u]->eta); ++c) {
        const Eigen::Index named = place(begin[u] + c);
        if (named == static_cast<Eigen::Index>(own.size())) continue;
        std::vector<Eigen::Index> both{named};
        for (int i = 0; i < count; ++i) both.push_back(first + i);
        const MatrixXd left = Left(rows.gram[j], active, own, both);
        const VectorXd shared = left.col(0).tail(count);
        const double self = left(0, 0);
        if (self <= 0 || shared.dot(Ridged(left.bottomRightCorner(count, count)).solve(shared)) < kTakesOver * self)
          continue;
        rows.precision.block(begin[t], begin[t], count, count) +=
            kHeld / (self * estimate.sigma[j] * estimate.sigma[j]) * shared * shared.transpose();
      }
    }
  }
}

// A term that reads the model's torque changes with the parameters, too: where it cuts torque off they change nothing.
void Diagnosis::Work::Bend(int j, const VectorXd& slope) {
  const VectorXd at_mean = Measured(j) - rows.target[j];
  VectorXd torque(slope.size());
  for (std::size_t log = 0; log < train.size(); ++log)
    rows.index[j].Take(static_cast<int>(log), evidence.logs[log].tau_model.col(j), torque);
  rows.target[j] += slope.cwiseProduct(torque - at_mean);
  rows.design[j].array().colwise() *= 1 + slope.array();
  bent[j] = 1;
}

// Coordinates z in which the prior is unit.
void Diagnosis::Work::MakeCoordinates(int size) {
  const int active = static_cast<int>(declared.active.size());
  rows.L = MatrixXd::Zero(size, size);
  rows.L.topLeftCorner(active, active) =
      calibration::CovarianceRoot(prior.covariance(declared.active, declared.active));
  // A term has no prior worth the name: a thousand times what one whitened unit in every row of it would need.
  VectorXd seen = VectorXd::Zero(size), own = VectorXd::Zero(size);
  for (int j = 0; j < model.joints(); ++j) {
    seen(rows.columns[j]) += rows.gram[j].diagonal() / (estimate.sigma[j] * estimate.sigma[j]);
    own(rows.columns[j]).array() += static_cast<double>(rows.index[j].size());
  }
  for (int i = active; i < size; ++i)
    if (seen[i] > 0) rows.L(i, i) = 1e3 * std::sqrt(own[i] / seen[i]);
}

}  // namespace armcal::diagnosis

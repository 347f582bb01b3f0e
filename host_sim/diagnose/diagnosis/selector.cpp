// diagnosis - ranks the candidates, accepts the next term, and checks whether a chosen one still earns its place.
#include "host_sim/diagnose/diagnosis/selector.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "codegen/src/io/watch.hpp"
#include "host_sim/diagnose/diagnosis/determined.hpp"
#include "host_sim/diagnose/diagnosis/run_state.hpp"
#include "host_sim/identify/calibration/channel.hpp"
#include "host_sim/identify/methods/exogeneity.hpp"

namespace armcal::diagnosis {

using Eigen::VectorXd;

namespace {

constexpr int kThinnedRows = 2500;  // of a log: a coarse grid needs to see where the gain is, not how large
constexpr double kClearly = 0.9;    // of a joint's noise: below this a found effect was most of what looked like noise
constexpr int kRescored = 14;       // candidates whose likelihood is computed with their own noise model
constexpr int kCurvesOfAJoint = 3;  // among these
constexpr std::size_t kCausesOfAJoint = 3;  // and these of every joint besides
constexpr double kKeepsOutOfFold = 0.35;    // of its gain
constexpr double kKeepsWithoutBest = 0.15;  // the same without the fold that gains most
constexpr int kBlocks = 20, kFolds = 5;
constexpr double kOnce = 0.8;              // of a trace in one fold: the others cannot tell of it
constexpr double kIndistinguishable = 25;  // chi^2 left at most when one kind imitates another
constexpr double kImitated = 0.1;          // and of the trace's own
constexpr double kNear = 0.05;             // of a score: the logs do not tell which of two it is
constexpr double kOddsOf20 = 6;            // of a score: twice the logarithm
constexpr double kSameTorque = 0.5;        // of a term's trace: what explains less is another effect
constexpr double kStays = 0.5;             // of the gain, at a lower bandwidth
constexpr double kLogSurely = -11.5;       // of a chance, for what imitates much else or loses more than that
constexpr double kAsLarge = 0.5;           // of what it would gain there if it was as large as it seemed
constexpr double kMoreLag = 0.02, kMoreDelay_s = 5e-4;  // of a channel's lag; so little that the torque follows it
constexpr int kSharpenings = 3;
constexpr double kNothing = 6;            // a gain that chance often has
constexpr double kCauseExplains = 0.9;    // of what a curve explains: forms differ a little from any record
constexpr double kSimplerExplains = 0.5;  // of what a surface explains
constexpr double kMemoryGains = 16;       // chi^2 of one parameter that chance has once in 10^4
constexpr int kFewTurns = 100;            // rows
constexpr double kTurnShare = 0.03;       // of a joint's rows
constexpr std::size_t kOtherNames = 2;    // a verdict with more than three names says nothing

// The first ones of all, and the first causes of each joint: a joint whose noise has a colour may take all places.
std::vector<Found> FirstOf(const std::vector<Found>& ranked, int joints) {
  std::vector<std::size_t> causes(static_cast<std::size_t>(joints), 0);
  std::vector<Found> out;
  for (const Found& f : ranked) {
    bool is_first = out.size() < kRescored;
    if (!f.candidate->is_curve())
      for (const int j : f.candidate->rows()) is_first |= causes[static_cast<std::size_t>(j)]++ < kCausesOfAJoint;
    if (is_first) out.push_back(f);
  }
  return out;
}

std::size_t LengthOfLaw(const codegen::EffectRecord& record) {
  std::size_t length = 0;
  for (const codegen::LinearParameter& p : record.linear)
    for (const auto& [row, law] : p.rows) length += law.size();
  return length;
}

// The torque passed a filter, of which only the rough form is known.
bool IsFiltered(const calibration::Dataset& log) {
  return !log.channel.empty() || (log.saved_Hz.size() && log.saved_Hz.array().isFinite().any());
}

// Neither noise nor one term too many explains the gain.
bool IsRare(const Found& f, const calibration::Dataset& log) {
  return f.log_chance < LogLimit(f.candidate->record(), log) && f.score > 0;
}

// Of these rows alone: where one is left out a segment ends.
RowIndex Segments(const RowIndex& all, const std::vector<int>& kept) {
  RowIndex out;
  for (std::size_t i = 0; i < kept.size(); ++i) {
    const auto k = static_cast<std::size_t>(kept[i]);
    out.dataset.push_back(all.dataset[k]), out.sample.push_back(all.sample[k]);
    out.segment_begin.push_back(all.segment_begin[k] || i == 0 || kept[i - 1] + 1 != kept[i]);
  }
  return out;
}

}  // namespace

// A fault of a sensor imitates a little of many causes, and so does what is not known of a filter.
double LogLimit(const codegen::EffectRecord& record, const calibration::Dataset& log) {
  return record.effect_class == codegen::EffectClass::kSensor || IsFiltered(log) ? kLogSurely : kLogRare;
}

bool SharesJoint(const Candidate& a, const Candidate& b) {
  return std::any_of(a.rows().begin(), a.rows().end(),
                     [&](int j) { return std::find(b.rows().begin(), b.rows().end(), j) != b.rows().end(); });
}

// What the candidates of one pass are tried on: the base with the terms so far, whole and thinned.
class Grounds {
 public:
  // Fits the base with the given terms and takes its residuals' spread as white noise. coloured: takes the noise of a
  // joint as autoregressive where slow effects show better so. only: the one candidate that is tried on it; null: any.
  Grounds(Diagnosis::Work& work, const std::vector<const Chosen*>& terms, bool coloured = false,
          const Candidate* only = nullptr);

  bool coloured() const { return coloured_; }  // the noise of at least one joint is

  Ground ground() const { return {work_.evidence, *thinned_, *metric_, *thin_metric_}; }
  const Metric& metric() const { return *metric_; }
  // The rows whitened by what they leave; null where that has no colour.
  std::unique_ptr<Metric> Whitened() const;
  // Deviance of these joints with no further column.
  double DevianceWithout(const std::vector<int>& joints) const;
  // Takes as noise what the fit with these columns leaves; true if it is clearly less.
  bool Sharpen(const Columns& with);

 private:
  void MakeMetrics(const std::vector<NoiseModel>& noise);
  // The noise of a joint's residual, as this pass takes it.
  NoiseModel NoiseOf(int j, const VectorXd& e, bool coloured) const;

  Diagnosis::Work& work_;
  bool coloured_ = false;
  std::unique_ptr<Thinned> thinned_;
  BaseRows thin_rows_;
  std::unique_ptr<Metric> metric_, thin_metric_;
  mutable std::map<std::vector<int>, double> without_;
};

Grounds::Grounds(Diagnosis::Work& work, const std::vector<const Chosen*>& terms, bool coloured, const Candidate* only)
    : work_(work) {
  work_.Solve(terms);
  work_.FollowEstimate(only ? work_.Reads(terms, only) : work_.all_reads);
  work_.Prepare(terms);
  std::vector<NoiseModel> noise = work_.WhiteNoise();
  if (coloured) {
    const Metric white(work_.rows, noise);
    for (int j = 0; j < work_.rows.joints(); ++j) {
      noise[j] = NoiseOf(j, white.RawResidual(j), true);
      coloured_ |= !IsWhite(noise[j]);
    }
    if (!coloured_) return;
  }
  thinned_ = std::make_unique<Thinned>(work_.evidence, kThinnedRows, work_.kept_columns);
  MakeMetrics(noise);
}

NoiseModel Grounds::NoiseOf(int j, const VectorXd& e, bool coloured) const {
  NoiseModel white;
  white.innovation =
      e.size() ? std::max(1e-12, std::sqrt(e.squaredNorm() / static_cast<double>(e.size()))) : work_.estimate.sigma[j];
  if (!coloured) return white;
  const NoiseModel own = FitNoise(work_.rows.index[j], e);
  return SlowNoise(own) < kClearly * white.innovation ? own : white;
}

void Grounds::MakeMetrics(const std::vector<NoiseModel>& noise) {
  metric_ = std::make_unique<Metric>(work_.rows, noise);
  std::vector<NoiseModel> averaged;
  thin_rows_ = thinned_->Average(work_.rows, noise, averaged);
  thin_metric_ = std::make_unique<Metric>(thin_rows_, averaged);
  without_.clear();
}

std::unique_ptr<Metric> Grounds::Whitened() const {
  std::vector<NoiseModel> noise = metric_->noise();
  bool clearly = false;
  for (int j = 0; j < work_.rows.joints(); ++j) {
    if (!IsWhite(noise[j]) || work_.rows.index[j].size() == 0) continue;
    const NoiseModel own = FitNoise(work_.rows.index[j], metric_->RawResidual(j));
    if (own.innovation > kClearly * noise[j].innovation) continue;
    noise[j] = own;
    clearly = true;
  }
  return clearly ? std::make_unique<Metric>(work_.rows, noise) : nullptr;
}

double Grounds::DevianceWithout(const std::vector<int>& joints) const {
  const auto [at, fresh] = without_.try_emplace(joints, 0);
  if (!fresh) return at->second;
  Columns none;
  none.joints = joints;
  for (const int j : joints) none.block.emplace_back(work_.rows.index[j].size(), 0);
  return at->second = metric_->RefittedDeviance(none);
}

bool Grounds::Sharpen(const Columns& with) {
  std::vector<NoiseModel> noise = metric_->noise();
  bool clearly = false;
  for (int j = 0; j < work_.rows.joints(); ++j) {
    const Eigen::VectorXd e = metric_->ResidualWith(with, j);
    if (e.size() == 0) continue;
    const NoiseModel left = NoiseOf(j, e, !IsWhite(noise[j]));
    if (left.innovation > kClearly * noise[j].innovation) continue;
    noise[j] = left;
    clearly = true;
  }
  if (clearly) MakeMetrics(noise);
  return clearly;
}

bool Selector::Next(const std::vector<const Chosen*>& terms, Chosen& out) {
  w_.kept_columns.ForgetUnused();
  Grounds grounds(w_, terms);
  std::vector<Candidate*> causes, events;
  for (const auto& c : w_.candidates)
    if (!c->record().search.at_turns && !AlreadyIn(*c, terms) && !IsOutOfReach(*c, terms) && IsExcited(*c, w_.evidence))
      (c->is_event() ? events : causes).push_back(c.get());
  bursts_.clear();
  for (const Candidate* c : causes) gain_.erase(c);
  if (Best(causes, terms, grounds, out)) return true;
  // Noise that rings hides what is slow, until it is whitened. At first it is not: what is missing would count as
  // noise.
  if (Grounds whitened(w_, terms, true); whitened.coloured() && Best(causes, terms, whitened, out)) return true;
  // Whatever comes and goes with the motion looks like an event, so events are tried last. A cause that showed in one
  // fold only is tried among them.
  events.insert(events.end(), bursts_.begin(), bursts_.end());
  return Best(events, terms, grounds, out);
}

// So many of the joint's rows are near turns or at rest that they are worth a look.
bool Selector::StandsOrTurns(int j, bool averaged_only) const {
  int slides = 0, sound = 0;
  for (const auto* log : w_.logged) {
    if (log->sound.size() == 0 || (averaged_only && !log->averaged(j))) return false;
    slides += log->used.col(j).sum(), sound += log->sound.col(j).sum();
  }
  return sound - slides > std::max(kFewTurns, static_cast<int>(kTurnShare * sound));
}

std::vector<Chosen> Selector::FirstAtTurns(bool averaged_only) {
  std::vector<Candidate*> candidates;
  std::vector<char> shown(static_cast<std::size_t>(w_.model.joints()), 0);
  for (const auto& c : w_.candidates) {
    if (!c->record().search.at_turns || !StandsOrTurns(c->rows()[0], averaged_only)) continue;
    candidates.push_back(c.get());
    shown[static_cast<std::size_t>(c->rows()[0])] = 1;
  }
  std::vector<Chosen> out;
  if (candidates.empty()) return out;
  w_.ShowTurns(shown);
  w_.WeighTurns({});
  Grounds grounds(w_, {});
  shown.assign(shown.size(), 0);
  for (Candidate* c : candidates) {
    char& known = shown[static_cast<std::size_t>(c->rows()[0])];
    Chosen next;
    if (known || !IsExcited(*c, w_.evidence) || !Best({c}, {}, grounds, next)) continue;
    out.push_back(next);
    known = 1;
  }
  w_.ShowTurns(shown);
  if (!out.empty()) w_.WeighTurns(Confirmed(out));
  return out;
}

bool Selector::Best(std::vector<Candidate*> reach, const std::vector<const Chosen*>& terms, Grounds& grounds,
                    Chosen& out) {
  std::vector<Found> ranked = Rank(reach, grounds);
  // At first a strong effect counts as noise, and under so much noise other candidates look as good. Once it is fitted
  // the noise is smaller, and the candidates in question are searched again.
  for (int round = 0; round < kSharpenings && !ranked.empty(); ++round) {
    if (!grounds.Sharpen(GatherColumns(*ranked[0].candidate, w_.evidence, ranked[0].eta))) break;
    reach.clear();
    for (const Found& f : ranked) reach.push_back(f.candidate);
    ranked = Rank(reach, grounds);
  }
  for (Found& f : ranked) Rescore(grounds, f);
  refused_.clear();
  Sort(ranked);
  for (std::size_t k = 0; k < ranked.size(); ++k)
    if (IsRare(ranked[k], *w_.train[0]) && Accept(grounds, terms, ranked, k, out)) return true;
  return false;
}

bool Selector::StillEarns(Chosen& term, const std::vector<const Chosen*>& others) {
  // What was found in whitened rows may leave noise without a colour beside other terms.
  auto own = std::make_unique<Grounds>(w_, others, term.coloured, term.candidate);
  if (term.coloured && !own->coloured()) own = std::make_unique<Grounds>(w_, others, false, term.candidate);
  const Grounds& grounds = *own;
  Found f = Finish(SearchCandidate(*term.candidate, grounds.ground()), grounds.ground());
  if (f.gain.gain <= 0) return false;
  Rescore(grounds, f);
  term.eta = f.eta;
  term.found = f;
  return IsRare(f, *w_.train[0]);
}

std::vector<Found> Selector::Rank(const std::vector<Candidate*>& candidates, const Grounds& grounds) {
  std::vector<Found> ranked;
  // Noise with a colour gives what it resembles a large gain, and what is there may not be among the best. So those
  // that are best in whitened rows are scored again, too. Not where the torque passed a filter: only its rough form is
  // known, and whitening would weigh what is left of it.
  const std::unique_ptr<Metric> whitened = IsFiltered(*w_.train[0]) ? nullptr : grounds.Whitened();
  std::vector<std::pair<double, Found>> screened;  // by that score
  std::map<std::pair<std::string, std::vector<int>>, Found> something;
  double tried = 0;
  for (Candidate* c : candidates) {
    io::SetDone(tried++ / static_cast<double>(candidates.size()));
    const std::string& simpler = c->record().search.after;
    const auto before = something.find({simpler, c->joints()});
    if (!simpler.empty() && before == something.end()) continue;
    const Found f = SearchCandidate(*c, grounds.ground(), simpler.empty() ? nullptr : &before->second);
    gain_[c] = std::max(gain_[c], f.gain.gain);
    if (whitened && f.gain.gain > kNothing && !c->is_event()) {
      const double gain = whitened->Try(GatherColumns(*c, w_.evidence, f.eta)).gain;
      if (LogChance(f, gain) < kLogLikely) screened.emplace_back(Score(f, gain), f);
    }
    if (f.log_chance > kLogLikely) continue;
    ranked.push_back(f);
    something.insert({{c->record().name, c->joints()}, f});
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const Found& a, const Found& b) { return a.score > b.score; });
  // Many curves fit the same torque about as well: the best ones of a joint stand for the others.
  std::map<std::vector<int>, int> curves;
  std::erase_if(ranked, [&](const Found& f) {
    return f.candidate->is_curve() && ++curves[f.candidate->rows()] > kCurvesOfAJoint;
  });
  ranked = FirstOf(ranked, w_.model.joints());
  std::stable_sort(screened.begin(), screened.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  if (screened.size() > kRescored) screened.resize(kRescored);
  for (const auto& [score, f] : screened)
    if (std::none_of(ranked.begin(), ranked.end(), [&](const Found& r) { return r.candidate == f.candidate; }))
      ranked.push_back(f);
  for (Found& f : ranked) f = Finish(f, grounds.ground());
  std::erase_if(ranked, [](const Found& f) { return f.gain.gain <= 0; });  // out of bounds on all rows
  std::stable_sort(ranked.begin(), ranked.end(), [](const Found& a, const Found& b) { return a.score > b.score; });
  return ranked;
}

void Selector::Rescore(const Grounds& grounds, Found& f) const {
  const Columns c = GatherColumns(*f.candidate, w_.evidence, f.eta);
  const double with = grounds.metric().RefittedDeviance(c);
  Rate(f, grounds.DevianceWithout(c.joints) - with);
}

// The latest term touches none of its joints, and there was nothing on them before.
bool Selector::IsOutOfReach(const Candidate& c, const std::vector<const Chosen*>& terms) const {
  const auto known = gain_.find(&c);
  return known != gain_.end() && !terms.empty() && known->second < kNothing &&
         !SharesJoint(c, *terms.back()->candidate);
}

// By score. Among equals what is compiled in already wins, then the shortest law.
void Selector::Sort(std::vector<Found>& ranked) {
  const auto standing = [this](const Found& f) {
    const auto& names = w_.standby;
    const codegen::EffectRecord& record = f.candidate->record();
    return f.score + (std::find(names.begin(), names.end(), record.name) != names.end() ? 1e-3 : 0) -
           1e-6 * static_cast<double>(LengthOfLaw(record));
  };
  std::stable_sort(ranked.begin(), ranked.end(),
                   [&](const Found& a, const Found& b) { return standing(a) > standing(b); });
  if (ranked.empty() || !ranked[0].candidate->is_curve()) return;
  const Found& curve = ranked[0];
  // A surface has so many coefficients that it fits a part of what one of its signals does. What reads another signal
  // is another explanation.
  const bool is_surface = curve.candidate->is_surface();
  const auto enough = [&](const Found& f) {
    return is_surface && curve.candidate->ReadsAllOf(*f.candidate) ? kSimplerExplains : kCauseExplains;
  };
  const auto explains = [&](const Found& f) { return f.gain.gain > enough(f) * curve.gain.gain; };
  const auto simpler = std::find_if(ranked.begin(), ranked.end(), [&](const Found& f) {
    const bool is_simpler = is_surface ? !f.candidate->is_surface() : !f.candidate->is_curve();
    return is_simpler && f.candidate->rows() == curve.candidate->rows() && f.log_chance < kLogRare &&
           (explains(f) || f.score > curve.score - kOddsOf20);
  });
  if (simpler == ranked.end()) return;
  const char* what = simpler->candidate->is_curve() ? "curve" : "cause";
  refused_[curve.candidate] =
      explains(*simpler) ? fmt::format("it names no cause, and a {} explains over {:.0f} % of what it explains", what,
                                       100 * enough(*simpler))
                         : fmt::format("it names no cause, and the logs do not tell it from a {}", what);
  std::rotate(ranked.begin(), simpler, simpler + 1);
}

// A chosen term, or one that looks like a chosen one on the same joints. The two together would only fit noise, and
// would fail on another log.
bool Selector::AlreadyIn(const Candidate& c, const std::vector<const Chosen*>& terms) const {
  return std::any_of(terms.begin(), terms.end(), [&](const Chosen* t) {
    const auto& like = t->candidate->record().confusable_with;
    const bool confusable = std::find(like.begin(), like.end(), c.record().name) != like.end();
    return (t->candidate == &c && !c.record().repeats()) || (confusable && t->candidate->joints() == c.joints());
  });
}

// The derivation of speed and acceleration leaves errors that look like delay, elasticity or backlash. A real term
// gains about as much when they are derived with a lower bandwidth. A term of high frequencies loses more: it must then
// be acceptable there, too, and as large as before. Says why it is not accepted; empty: it is.
std::string Selector::WhyNotAtLowerBandwidth(const Found& f, const std::vector<const Chosen*>& terms,
                                             const Columns& columns, const Gain& gain, const Metric& wide) {
  if (!w_.narrow) return "";
  Diagnosis::Work& narrow = *w_.narrow;
  narrow.PrepareAsIn(w_, terms, *f.candidate);
  const Metric metric(narrow.rows, wide.noise());
  const Columns c = GatherColumns(*f.candidate, narrow.evidence, f.eta);
  const double left = metric.Try(c).gain;
  if (left > kStays * gain.gain) return "";
  if (LogChance(f, left) > kLogSurely || left < kAsLarge * metric.Imitates(c, c, gain.amplitude).second)
    return "it does not keep its gain where speed and acceleration are derived with a lower bandwidth";
  return WhyNotOfTheMotion(f, terms, columns, gain.amplitude, wide);
}

// The training logs minus the torque of the terms so far and of one more.
std::vector<calibration::Dataset> Selector::Without(const std::vector<const Chosen*>& terms, const Found& f,
                                                    const VectorXd& amplitude) const {
  std::vector<calibration::Dataset> out;
  for (std::size_t log = 0; log < w_.train.size(); ++log) {
    const Quantities& q = w_.evidence.logs[log];
    out.push_back(*w_.train[log]);
    MatrixXd& tau = out.back().tau;
    for (std::size_t k = 0; k < terms.size(); ++k)
      tau -= CandidateTorque(*terms[k]->candidate, q, terms[k]->eta, w_.estimate.amplitude[k]);
    tau -= CandidateTorque(*f.candidate, q, f.eta, amplitude);
  }
  return out;
}

// The noise of the derivation is in the logs at every bandwidth, and what smooths it looks like elasticity. Far below
// the bandwidth hardly any of it is left: a term must show along that motion, too. And where the noise biases the rows
// of a joint, a term cannot be told from it: the term must show on the other joints. What the term itself and the other
// terms explain is not held against it. Says why it is not accepted.
std::string Selector::WhyNotOfTheMotion(const Found& f, const std::vector<const Chosen*>& terms, const Columns& columns,
                                        const VectorXd& amplitude, const Metric& wide) const {
  const std::vector<calibration::Dataset> smooth = calibration::SmoothedInstruments(w_.train);
  Evidence along{&w_.model, {}, w_.evidence.index};
  const std::set<codegen::InputId> reads = w_.Reads({}, f.candidate);
  for (const calibration::Dataset& log : smooth) {
    along.logs.push_back(MakeQuantities(w_.model, log, reads));
    Follow(w_.model, w_.arm, w_.estimate.x, w_.declared.eta, reads, along.logs.back());
  }
  if (LogChance(f, wide.Try(GatherColumns(*f.candidate, along, f.eta)).gain) > kLogSurely)
    return "along the slow part of the motion it does not show";
  VectorXd z(w_.model.columns() + w_.model.nonlinear());
  z << w_.estimate.x.head(w_.model.columns()), VectorXd::Map(w_.declared.eta.data(), w_.model.nonlinear());
  const std::vector<calibration::Dataset> left = Without(terms, f, amplitude);
  std::vector<const calibration::Dataset*> logs;
  for (const calibration::Dataset& log : left) logs.push_back(&log);
  const calibration::Exogeneity e = calibration::TestExogeneity(w_.model, logs, smooth, z);
  Columns unbiased;
  for (std::size_t r = 0; r < columns.joints.size(); ++r) {
    if (!e.joint[static_cast<std::size_t>(columns.joints[r])].exogenous) continue;
    unbiased.joints.push_back(columns.joints[r]);
    unbiased.block.push_back(columns.block[r]);
  }
  if (!unbiased.joints.empty() && LogChance(f, wide.Try(unbiased).gain) < kLogSurely) return "";
  return "the noise of the derived motion is in the same rows, and the logs do not tell the two apart";
}

// Lag and delay of a torque channel are estimates. Where they are a little wrong, every step of the torque leaves an
// error, and that looks like friction at turns. So a term must show beside what a little more of each changes.
bool Selector::ShowsBesideChannel(const Found& f, const Columns& columns, const Metric& metric) const {
  if (w_.train[0]->channel.empty()) return true;
  const auto joints = static_cast<Eigen::Index>(columns.joints.size());
  Columns all{columns.joints, {}};
  for (const int j : columns.joints)
    all.block.emplace_back(MatrixXd::Zero(w_.evidence.index[static_cast<std::size_t>(j)].size(), 2 * joints));
  for (std::size_t log = 0; log < w_.train.size(); ++log) {
    const calibration::Dataset& d = *w_.train[log];
    const MatrixXd made = calibration::ModelTorque(w_.model, d, w_.estimate.x, w_.declared.eta);
    for (Eigen::Index r = 0; r < joints; ++r) {
      const int j = columns.joints[static_cast<std::size_t>(r)];
      const calibration::JointChannel& told = d.channel[static_cast<std::size_t>(j)];
      if (told.empty()) continue;
      const auto seen = [&](double more_lag, double more_delay_s) {
        return calibration::ThroughChannel(d.s.t, made.col(j),
                                           {told.lag_s * (1 + more_lag), told.late_s + more_delay_s, told.lags});
      };
      const VectorXd as_told = seen(0, 0);
      const RowIndex& index = w_.evidence.index[static_cast<std::size_t>(j)];
      MatrixXd& block = all.block[static_cast<std::size_t>(r)];
      index.Take(static_cast<int>(log), (seen(kMoreLag, 0) - as_told) / kMoreLag, block.col(2 * r));
      index.Take(static_cast<int>(log), (seen(0, kMoreDelay_s) - as_told) / kMoreDelay_s, block.col(2 * r + 1));
    }
  }
  const double alone = metric.Try(all).gain;
  for (std::size_t r = 0; r < all.block.size(); ++r) {
    all.block[r].conservativeResize(Eigen::NoChange, 2 * joints + columns.count());
    all.block[r].rightCols(columns.count()) = columns.block[r];
  }
  return LogChance(f, metric.Try(all).gain - alone) < kLogSurely;
}

// Near turns and at rest least is known of friction, and much that is not there fits what is left of it. So what is not
// about these rows must show in the others.
bool Selector::ShowsInSliding(const Found& f, const Columns& columns, const std::vector<NoiseModel>& noise) const {
  const auto turns = [this](int j) { return w_.turns[static_cast<std::size_t>(j)] != 0; };
  if (f.candidate->record().search.at_turns || std::none_of(columns.joints.begin(), columns.joints.end(), turns))
    return true;
  Columns c = columns;
  BaseRows rows = w_.rows;
  std::vector<NoiseModel> white(noise.size());
  const auto slides = [this](int j) -> Eigen::ArrayXd {
    return (w_.sliding[static_cast<std::size_t>(j)].array() > 0.5).cast<double>();
  };
  for (int j = 0; j < rows.joints(); ++j) {
    const auto at = static_cast<std::size_t>(j);
    white[at].innovation = SlowNoise(noise[at]);
    if (!turns(j)) continue;
    rows.design[at].array().colwise() *= slides(j);
    rows.target[at].array() *= slides(j);
    rows.Multiply(j);
  }
  for (std::size_t r = 0; r < c.joints.size(); ++r)
    if (turns(c.joints[r])) c.block[r].array().colwise() *= slides(c.joints[r]);
  return LogChance(f, Metric(rows, white).Try(c).gain) < kLogRare;
}

// Where friction changes its sign, an error of the derived speed is a large error of torque. An event has few rows, and
// one such error may be all that it fits. If the torque passed a filter, the error is in all turns alike. Presliding
// and play are about these rows.
bool Selector::ShowsWhereSignIsSteady(const Found& f, const Columns& columns,
                                      const std::vector<NoiseModel>& noise) const {
  const bool filtered =
      IsFiltered(*w_.train[0]) && !f.candidate->has_memory() && !f.candidate->record().search.at_turns;
  if (!f.candidate->is_event() && !filtered) return true;
  Columns c = columns;
  BaseRows rows = w_.rows;
  for (std::size_t r = 0; r < c.joints.size(); ++r) {
    const auto j = static_cast<std::size_t>(c.joints[r]);
    std::vector<int> kept;
    for (int k = 0; k < rows.index[j].size(); ++k)
      if (w_.evidence.steady[j][k] > 0) kept.push_back(k);
    rows.index[j] = Segments(rows.index[j], kept);
    rows.design[j] = MatrixXd(rows.design[j](kept, Eigen::all));
    rows.target[j] = VectorXd(rows.target[j](kept));
    rows.Multiply(c.joints[r]);
    c.block[r] = MatrixXd(c.block[r](kept, Eigen::all));
  }
  return LogChance(f, Metric(rows, noise).Try(c).gain) < kLogRare;
}

// Without its memory such a record takes a little off the sign of friction, or adds to it: that is another form of the
// declared law. The first unknown of a record with memory is the memory's length. A hysteresis has many lengths.
bool Selector::ShowsMemory(const Found& f, const Gain& gain, const Metric& metric) const {
  const codegen::EffectRecord& record = f.candidate->record();
  if (record.state.empty() || record.search.at_turns || f.eta.empty()) return true;
  std::vector<double> shortest = f.eta;
  shortest[0] = f.candidate->unknowns()[0].lower;
  return gain.gain - metric.Try(GatherColumns(*f.candidate, w_.evidence, shortest)).gain > kMemoryGains;
}

bool Selector::Accept(const Grounds& grounds, const std::vector<const Chosen*>& terms, const std::vector<Found>& ranked,
                      std::size_t k, Chosen& out) {
  const Found& f = ranked[k];
  const Columns c = GatherColumns(*f.candidate, w_.evidence, f.eta);
  std::vector<NoiseModel> noise;
  (void)grounds.metric().RefittedDeviance(c, &noise);
  const Metric metric(w_.rows, noise);
  const Gain gain = metric.Try(c);
  // A curve beside a cause is held to what the cause leaves. The same curve once more would only undo that.
  for (const Chosen* t : terms) {
    if (t->candidate != f.candidate) continue;
    const auto [taken, own] = metric.Imitates(GatherColumns(*t->candidate, w_.evidence, t->eta), c, gain.amplitude);
    if (own - taken > kImitated * own) continue;
    refused_[f.candidate] = "it is in the model already";
    return false;
  }
  const VectorXd folds = metric.FoldGains(c, kBlocks, kFolds, f.precision);
  // What a curve's freedom gains by chance is not kept. A surface has so much freedom that it must keep all the same.
  const double gained = f.curve && !f.candidate->is_surface() ? f.curve->Evidence(gain.gain) : gain.gain;
  const double kept = folds.sum() / gained, without_best = kept - folds.maxCoeff() / gained;
  const bool holds = kept > kKeepsOutOfFold && without_best > kKeepsWithoutBest;
  const bool once = std::find(bursts_.begin(), bursts_.end(), f.candidate) != bursts_.end();
  if (!holds && !f.candidate->is_event() && !once) {
    if (!f.candidate->is_curve() && metric.LargestFold(c, gain.amplitude, kBlocks, kFolds) > kOnce)
      bursts_.push_back(f.candidate);
    refused_[f.candidate] = fmt::format(
        "out of fold it keeps {:.0f} % of its gain (accepted above {:.0f} %), and {:.0f} % without the fold that gains "
        "most (accepted above {:.0f} %)",
        100 * kept, 100 * kKeepsOutOfFold, 100 * without_best, 100 * kKeepsWithoutBest);
    return false;
  }
  if (const std::string why = WhyNoState(*f.candidate, gain.amplitude); !why.empty()) {
    refused_[f.candidate] = why;
    return false;
  }
  if (const std::string why = WhyNotAtLowerBandwidth(f, terms, c, gain, metric); !why.empty()) {
    refused_[f.candidate] = why;
    return false;
  }
  if (!ShowsInSliding(f, c, noise)) {
    refused_[f.candidate] = "it shows near turns and at rest only";
    return false;
  }
  if (!ShowsWhereSignIsSteady(f, c, noise)) {
    refused_[f.candidate] = "it shows only where friction changes its sign";
    return false;
  }
  if (!ShowsBesideChannel(f, c, metric)) {
    refused_[f.candidate] = "a torque channel that is a little later or earlier explains it";
    return false;
  }
  if (!ShowsMemory(f, gain, metric)) {
    refused_[f.candidate] = "with hardly any memory it gains as much";
    return false;
  }
  bool on_bound = false;
  for (std::size_t u = 0; u < f.eta.size() && !f.candidate->is_curve() && !f.candidate->is_event(); ++u)
    on_bound |= IsAtEdge(f.candidate->unknowns()[u % f.candidate->unknowns().size()], f.eta[u]);
  out = Chosen{};
  out.candidate = f.candidate;
  out.eta = f.eta;
  out.found = f;
  out.folds = folds;
  out.coloured = grounds.coloured();
  for (std::size_t other = 0; other < ranked.size(); ++other) {
    if (other == k) continue;
    const Candidate& o = *ranked[other].candidate;
    const std::string& kind = o.record().kind;
    const auto refused = refused_.find(&o);
    const Rival rival{&o.record(), o.joints(), ranked[other].score, refused == refused_.end() ? "" : refused->second,
                      f.score};
    const bool runner_up = out.rivals.empty();
    if (runner_up) out.rivals.push_back(rival);
    const bool said = std::find(out.also_fits.begin(), out.also_fits.end(), kind) != out.also_fits.end();
    if (!SharesJoint(o, *f.candidate) || kind == f.candidate->record().kind || kind != o.record().name || said)
      continue;
    const Columns of_other = GatherColumns(o, w_.evidence, ranked[other].eta);
    if (o.record().effect_class == codegen::EffectClass::kRunState &&
        !WhyNoState(o, metric.Try(of_other).amplitude).empty())
      continue;
    const auto [taken, own] = metric.Imitates(of_other, c, gain.amplitude);
    const double left = own - taken;
    const bool same = left < kIndistinguishable && left < kImitated * own;
    // At its bound a term becomes another one: a limit below all torques is a wrong gain.
    if (same && on_bound && o.unknowns().empty() && !o.is_curve() && ranked[other].log_chance < kLogRare) {
      refused_[f.candidate] = fmt::format("ends on a bound, and there {} is the same", kind);
      return false;
    }
    const bool near = std::abs(ranked[other].score - f.score) < std::max(kNear * f.score, kOddsOf20) &&
                      (f.candidate->is_curve() || taken > kSameTorque * own);  // a curve's own trace holds noise
    if ((!same && !near) || out.also_fits.size() >= kOtherNames) continue;
    out.also_fits.push_back(kind);
    if (!runner_up) out.rivals.push_back(rival);
  }
  return true;
}

}  // namespace armcal::diagnosis

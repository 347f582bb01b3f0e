// diagnosis - metrics are made when a candidate first asks for them.
#include "host_sim/diagnosis/grounds.hpp"

namespace armcal::diagnosis {

namespace {
constexpr int kThinnedRows = 2500;  // of a log: a coarse grid needs to see where the gain is, not how large
}

Grounds::Grounds(Diagnosis::Work& work, const std::vector<const Chosen*>& terms) : work_(work) {
  work_.estimate = work_.Solve(terms);
  work_.Prepare(terms);
  thinned_ = std::make_unique<Thinned>(work_.evidence, kThinnedRows);
  auto base = std::make_unique<Place>();
  base->all = &work_.rows;
  base->metric = std::make_unique<Metric>(work_.rows, work_.WhiteNoise());
  base->thin_rows = thinned_->Pick(work_.rows);
  base->thin_metric = std::make_unique<Metric>(base->thin_rows, work_.WhiteNoise());
  place_[{"", -1}] = std::move(base);
}

const Grounds::Place& Grounds::At(const Candidate& candidate) const {
  const std::string& law = candidate.record().replaces;
  const int j = candidate.joints().empty() ? -1 : candidate.joints()[0];
  const Place& base = *place_.at({"", -1});
  if (law.empty() || work_.LawOf(law, j).empty()) return base;
  auto& place = place_[{law, j}];
  if (place) return *place;
  place = std::make_unique<Place>();
  place->own = work_.WithoutLaw(work_.rows, law, j);
  place->all = &place->own;
  place->metric = std::make_unique<Metric>(*base.metric, place->own, j);
  place->thin_rows = thinned_->Pick(place->own);
  place->thin_metric = std::make_unique<Metric>(*base.thin_metric, place->thin_rows, j);
  place->cost = place->metric->Cost() - base.metric->Cost();
  return *place;
}

Ground Grounds::Of(const Candidate& candidate) const {
  const Place& p = At(candidate);
  return {work_.evidence, *thinned_, *p.metric, *p.thin_metric, p.cost};
}

double Grounds::DevianceWithout(const std::vector<int>& joints) const {
  const auto [at, fresh] = without_.try_emplace(joints, 0);
  if (!fresh) return at->second;
  Columns none;
  none.joints = joints;
  for (const int j : joints) none.block.emplace_back(work_.rows.index[j].size(), 0);
  return at->second = place_.at({"", -1})->metric->RefittedDeviance(none);
}

}  // namespace armcal::diagnosis

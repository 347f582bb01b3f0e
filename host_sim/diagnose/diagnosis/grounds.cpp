// diagnosis - base rows and metrics of a pass.
#include "host_sim/diagnose/diagnosis/grounds.hpp"

#include <algorithm>
#include <cmath>

namespace armcal::diagnosis {

namespace {
constexpr int kThinnedRows = 2500;  // of a log: a coarse grid needs to see where the gain is, not how large
constexpr double kClearly = 0.9;    // of a joint's noise: below this a found effect was most of what looked like noise
}  // namespace

Grounds::Grounds(Diagnosis::Work& work, const std::vector<const Chosen*>& terms, const Candidate* only) : work_(work) {
  work_.Solve(terms);
  work_.FollowEstimate(only ? work_.Reads(terms, only) : work_.all_reads);
  work_.Prepare(terms);
  thinned_ = std::make_unique<Thinned>(work_.evidence, kThinnedRows);
  thin_rows_ = thinned_->Average(work_.rows);
  MakeMetrics(work_.WhiteNoise());
}

void Grounds::MakeMetrics(const std::vector<NoiseModel>& noise) {
  metric_ = std::make_unique<Metric>(work_.rows, noise);
  std::vector<NoiseModel> averaged = noise;
  for (NoiseModel& joint : averaged) joint.innovation *= thinned_->noise();
  thin_metric_ = std::make_unique<Metric>(thin_rows_, averaged);
  without_.clear();
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
    const double spread = std::sqrt(e.squaredNorm() / static_cast<double>(e.size()));
    if (spread > kClearly * noise[j].innovation) continue;
    noise[j].innovation = std::max(spread, 1e-12);
    clearly = true;
  }
  if (clearly) MakeMetrics(noise);
  return clearly;
}

}  // namespace armcal::diagnosis

// judged set - computes, without the diagnosis, how clearly a log shows an effect.
#include "tests/judged/detection.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <complex>

namespace armcal::judged {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kOrder = 30;       // of the noise's autoregression
constexpr double kGrid_Hz = 25;  // where the links' columns are computed; in between by cubics
constexpr int kEvery = 10;       // of the samples that tell a size
constexpr double kRank = 1e-11;

// Levinson and Durbin: [1, -a1, -a2 ...] over the standard deviation of what is left.
VectorXd WhiteningOf(const VectorXd& noise) {
  const VectorXd x = noise.array() - noise.mean();
  VectorXd r(kOrder + 1), a = VectorXd::Zero(kOrder + 1);
  for (int lag = 0; lag <= kOrder; ++lag) r[lag] = x.head(x.size() - lag).dot(x.tail(x.size() - lag)) / x.size();
  a[0] = 1;
  double left = r[0];
  for (int p = 1; p <= kOrder; ++p) {
    double sum = 0;
    for (int i = 0; i < p; ++i) sum += a[i] * r[p - i];
    const double k = -sum / left;
    const VectorXd before = a;
    for (int i = 1; i <= p; ++i) a[i] = before[i] + k * before[p - i];
    left *= 1 - k * k;
  }
  return a / std::sqrt(left);
}

double BandNoise(const VectorXd& filter, double rate_Hz) {
  const double edge = std::min(kBand_Hz, 0.5 * rate_Hz);
  constexpr int kSteps = 200;
  double sum = 0;
  for (int i = 0; i < kSteps; ++i) {
    const double w = 2 * kPi * (i + 0.5) / kSteps * edge / rate_Hz;
    std::complex<double> a = 0;
    for (Index p = 0; p < filter.size(); ++p) a += filter[p] * std::polar(1.0, -w * static_cast<double>(p));
    sum += 2 / rate_Hz / std::norm(a) * edge / kSteps;
  }
  return std::sqrt(sum);
}

// Rows at other times, by the cubic through four neighbours.
MatrixXd At(const MatrixXd& rows, double from, double step, const VectorXd& t) {
  MatrixXd out(t.size(), rows.cols());
  for (Index k = 0; k < t.size(); ++k) {
    const double x = (t[k] - from) / step;
    const Index i = std::clamp<Index>(static_cast<Index>(x), 1, rows.rows() - 3);
    const double u = x - static_cast<double>(i);
    out.row(k) = rows.row(i - 1) * (-u * (u - 1) * (u - 2) / 6) + rows.row(i) * ((u + 1) * (u - 1) * (u - 2) / 2) +
                 rows.row(i + 1) * (-(u + 1) * u * (u - 2) / 2) + rows.row(i + 2) * ((u + 1) * u * (u - 1) / 6);
  }
  return out;
}

}  // namespace

Detector::Detector(const Arm& arm, const Motion& fine, const Motion& m, const Channel& channel, const MatrixXd& noise,
                   plant::Random& random) {
  const double step = m.t[1] - m.t[0];
  const Motion grid = Every(fine, static_cast<int>(std::lround(1 / kGrid_Hz / (fine.t[1] - fine.t[0]))));
  const auto links = DeclaredRows(arm, grid, random);
  const int n = arm.joints(), bodies = 10 * n;
  band_noise_Nm_.resize(n);
  for (int j = 0; j < n; ++j) {
    MatrixXd rows(m.samples(), bodies + 3);  // other joints' rotors and friction are none of this joint's
    rows.leftCols(bodies) = At(links[static_cast<std::size_t>(j)].leftCols(bodies), grid.t[0], 1 / kGrid_Hz, m.t);
    rows.col(bodies) = m.qdd.col(j), rows.col(bodies + 1) = Sign(m.qd.col(j)), rows.col(bodies + 2) = m.qd.col(j);
    filter_.push_back(WhiteningOf(noise.col(j)));
    band_noise_Nm_[j] = BandNoise(filter_.back(), 1 / step);
    MatrixXd all = MatrixXd::Zero(m.samples(), bodies + 3 * n);
    for (Index c = 0; c < rows.cols(); ++c) {
      const Index to = c < bodies ? c : bodies + 3 * j + (c - bodies);
      all.col(to) = Passed(channel, j, rows.col(c), step);
    }
    thin_.push_back(all(Eigen::seq(0, m.samples() - 1, kEvery), Eigen::all));
    white_.emplace_back(m.samples(), all.cols());
    for (Index c = 0; c < all.cols(); ++c)
      if (c < bodies || (c - bodies) / 3 == j) white_.back().col(c) = Whitened(j, all.col(c));
      else white_.back().col(c).setZero();
  }
  MatrixXd normal = MatrixXd::Zero(bodies + 3 * n, bodies + 3 * n);
  for (const MatrixXd& w : white_) normal += w.transpose() * w;
  scale_ = normal.diagonal().cwiseSqrt().cwiseMax(1e-12).cwiseInverse();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(scale_.asDiagonal() * normal * scale_.asDiagonal());
  const VectorXd& l = eigen.eigenvalues();
  const VectorXd kept = (l.array() > kRank * l.maxCoeff()).select(l.cwiseInverse(), 0.0);
  inverse_ = scale_.asDiagonal() * eigen.eigenvectors() * kept.asDiagonal() * eigen.eigenvectors().transpose() *
             scale_.asDiagonal();
}

VectorXd Detector::Whitened(int joint, const VectorXd& x) const {
  const VectorXd& f = filter_[static_cast<std::size_t>(joint)];
  VectorXd y = VectorXd::Zero(x.size());
  for (Index p = 0; p < f.size(); ++p) y.tail(x.size() - kOrder) += f[p] * x.segment(kOrder - p, x.size() - kOrder);
  return y;
}

Seen Detector::Look(const MatrixXd& term) const {
  VectorXd right = VectorXd::Zero(inverse_.rows());
  std::vector<VectorXd> white;
  for (std::size_t j = 0; j < white_.size(); ++j) {
    white.push_back(Whitened(static_cast<int>(j), term.col(static_cast<Index>(j))));
    right += white_[j].transpose() * white[j];
  }
  const VectorXd taken = inverse_ * right;
  Seen seen;
  seen.size.resize(term.cols());
  for (std::size_t j = 0; j < white_.size(); ++j) {
    const auto at = static_cast<Index>(j);
    seen.score += (white[j] - white_[j] * taken).squaredNorm();
    const VectorXd rest = VectorXd(term.col(at)(Eigen::seq(0, term.rows() - 1, kEvery))) - thin_[j] * taken;
    seen.size[at] = std::sqrt(rest.squaredNorm() / static_cast<double>(rest.size())) / band_noise_Nm_[at];
  }
  return seen;
}

}  // namespace armcal::judged

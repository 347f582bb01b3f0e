// tests - rounds the values of a line, and leaves out the points that nobody would see.
#include "tests/docs/drawn.hpp"

#include <algorithm>
#include <cmath>

#include "host_sim/data/report/style.hpp"

namespace armcal::tests {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

constexpr double kUnseen = 2e-4;  // of the picture's size

VectorXd Rounded(const VectorXd& v) {
  const double largest = v.cwiseAbs().maxCoeff(),
               step = largest > 0 ? std::pow(10, std::floor(std::log10(largest)) - 6) : 1;
  return (v / step).array().round() * step;
}

double Span(const VectorXd& v) { return std::max(v.maxCoeff() - v.minCoeff(), 1e-300); }

// Douglas and Peucker: marks the points between `first` and `last` that the line must pass.
void Keep(const Eigen::Matrix2Xd& p, Index first, Index last, std::vector<char>& keep) {
  keep[static_cast<std::size_t>(first)] = keep[static_cast<std::size_t>(last)] = 1;
  const Eigen::Vector2d along = p.col(last) - p.col(first);
  double most = kUnseen;
  Index farthest = -1;
  for (Index k = first + 1; k < last; ++k) {
    const Eigen::Vector2d from = p.col(k) - p.col(first);
    const double share = along.squaredNorm() > 0 ? std::clamp(from.dot(along) / along.squaredNorm(), 0.0, 1.0) : 0;
    const double distance = (from - share * along).norm();
    if (distance > most) most = distance, farthest = k;
  }
  if (farthest < 0) return;
  Keep(p, first, farthest, keep);
  Keep(p, farthest, last, keep);
}

}  // namespace

report::Series Curve(const std::string& name, const VectorXd& x, const VectorXd& y, bool logarithmic_x) {
  const VectorXd all_x = Rounded(x), all_y = Rounded(y), wide = logarithmic_x ? VectorXd(all_x.array().log()) : all_x;
  Eigen::Matrix2Xd places(2, x.size());
  places << wide.transpose() / Span(wide), all_y.transpose() / Span(all_y);
  std::vector<char> keep(static_cast<std::size_t>(x.size()));
  Keep(places, 0, x.size() - 1, keep);
  report::Series series{.name = name};
  for (Index k = 0; k < x.size(); ++k)
    if (keep[static_cast<std::size_t>(k)]) series.x.push_back(all_x[k]), series.y.push_back(all_y[k]);
  return series;
}

std::string File(report::Plot plot) {
  constexpr int kWidth_px = 560, kHeight_px = 270, kBeside_px = 88, kLetter_px = 8;
  plot.text.width_px = std::max(kWidth_px, kBeside_px + kLetter_px * static_cast<int>(plot.text.title.size()));
  plot.text.height_px = kHeight_px;
  if (plot.series.size() == 1) plot.series[0].name.clear();
  return report::SvgFile(report::Svg(plot));
}

}  // namespace armcal::tests

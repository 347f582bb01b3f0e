// judged set - writes logs and truths, and derives what a log's positions can tell.
#include "tests/judged/log.hpp"

#include <fmt/core.h>
#include <zlib.h>

#include <Eigen/Cholesky>
#include <cmath>
#include <fstream>
#include <stdexcept>
#include <utility>

namespace armcal::judged {

using Eigen::MatrixXd;

Motion Derived(const Motion& m, const MatrixXd& q, int half) {
  const int n = 2 * half + 1;
  const double h = m.t[1] - m.t[0];
  MatrixXd powers(n, 4);
  for (int i = 0; i < n; ++i)
    for (int p = 0; p < 4; ++p) powers(i, p) = std::pow((i - half) * h, p);
  const MatrixXd fit = (powers.transpose() * powers).ldlt().solve(powers.transpose());
  Motion out = m;
  for (int k = half; k + half < m.samples(); ++k) {
    const MatrixXd c = fit * q.middleRows(k - half, n);
    out.q.row(k) = c.row(0), out.qd.row(k) = c.row(1), out.qdd.row(k) = 2 * c.row(2);
  }
  return out;
}

MatrixXd Rest(const Motion& m, const MatrixXd& q, const MatrixXd& tau, int edge,
              const std::function<MatrixXd(const Motion& derived)>& predicted) {
  MatrixXd best;
  const auto inner = [&](const MatrixXd& rest, Eigen::Index j) {
    return rest.col(j).segment(edge, rest.rows() - 2 * edge).squaredNorm();
  };
  for (const int half : {2, 4, 7, 11, 16, 22, 30}) {
    const MatrixXd rest = tau - predicted(Derived(m, q, half));
    if (best.size() == 0) best = rest;
    for (Eigen::Index j = 0; j < rest.cols(); ++j)
      if (inner(rest, j) < inner(best, j)) best.col(j) = rest.col(j);
  }
  return best;
}

double Unseen(const Motion& train, const Motion& test) {
  double sum = 0;
  for (const auto& [seen, now] : {std::pair{&train.q, &test.q}, std::pair{&train.qd, &test.qd}})
    for (Eigen::Index j = 0; j < now->cols(); ++j) {
      const double low = seen->col(j).minCoeff(), high = seen->col(j).maxCoeff();
      sum += ((now->col(j).array() < low) || (now->col(j).array() > high)).cast<double>().mean();
    }
  return sum;
}

void WriteLog(const std::filesystem::path& path, const Motion& m, const MatrixXd& q, const MatrixXd& tau,
              bool temperature, int hold, const Eigen::VectorXd& stamps) {
  const auto n = q.cols();
  const double step = (m.t[1] - m.t[0]) / hold;
  std::string text = "t";
  const auto header = [&](const char* name) {
    for (Eigen::Index j = 1; j <= n; ++j) text += fmt::format(",{}{}", name, j);
  };
  header("q"), header("tau");
  if (temperature) header("temp");
  text += "\n";
  for (int row = 0; row < m.samples() * hold; ++row) {
    const int k = row / hold;
    text += fmt::format("{:.6f}", stamps.size() ? stamps[row] : m.t[k] + step * (row % hold));
    for (Eigen::Index j = 0; j < n; ++j) text += fmt::format(",{:.9f}", q(k, j));
    for (Eigen::Index j = 0; j < n; ++j) text += fmt::format(",{:.6g}", tau(k, j));
    for (Eigen::Index j = 0; temperature && j < n; ++j) text += fmt::format(",{:.3f}", m.temp(k, j));
    text += "\n";
  }
  gzFile file = gzopen(path.c_str(), "wb1");
  if (!file || gzwrite(file, text.data(), static_cast<unsigned>(text.size())) == 0 || gzclose(file) != Z_OK)
    throw std::runtime_error(path.string() + ": cannot be written");
}

void WriteJson(const std::filesystem::path& path, const nlohmann::json& content) {
  std::ofstream(path) << content.dump(1) << "\n";
}

}  // namespace armcal::judged

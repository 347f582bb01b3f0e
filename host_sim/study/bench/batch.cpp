// bench - solves least squares over a log in three ways, with the generated model compiled in.
#include "host_sim/study/bench/bench.hpp"

#include <Eigen/Cholesky>
#include <Eigen/QR>
#include <cmath>
#include <random>
#include <vector>

#include "host_sim/identify/calibration/gram_kernel.hpp"

namespace armcal::bench {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

using P = math::Pack<double, 8>;
constexpr int kPanel = 128;
using RowSum = calibration::GramSum<P, 4, 4, kPanel>;

struct Column {
  int place;  // filter coordinate
  bool front;
  int index;  // in front or dense
};

// Row i's columns that are not structurally zero: those that differ from zero somewhere among random states.
std::vector<std::vector<Column>> Pattern() {
  std::vector<std::vector<Column>> pattern(n);
  Rows<P> rows;
  std::vector<char> present(n * Model::kDense, 0);
  for (const Input<P>& x : RandomInputs<P>(4, 7)) {
    Regressor(x, rows);
    for (int k = 0; k < n * Model::kDense; ++k)
      for (int lane = 0; lane < 8; ++lane) present[k] |= rows.dense[k][lane] != 0;
  }
  for (int i = 0; i < n; ++i) {
    for (int c = Model::kFrontBegin[i]; c < Model::kFrontBegin[i + 1]; ++c) pattern[i].push_back({c, true, c});
    for (int d = Model::kRowBegin[i]; d < Model::kDense; ++d)
      if (present[i * Model::kDense + d]) pattern[i].push_back({Model::kFront + d, false, i * Model::kDense + d});
  }
  return pattern;
}

const std::vector<std::vector<Column>>& RowPattern() {
  static const std::vector<std::vector<Column>> pattern = Pattern();
  return pattern;
}

// Eight samples of one column from `begin`; those past the end read the last one.
P Load(const MatrixXd& m, int j, int begin) {
  P p;
  const auto last = static_cast<int>(m.rows()) - 1;
  const double* column = m.col(j).data();
  for (int lane = 0; lane < 8; ++lane) p.Set(lane, column[std::min(begin + lane, last)]);
  return p;
}

// gram x = right with columns scaled to unit diagonal: LDL' and one step of refinement. A column of zeros gets x = 0.
VectorXd SolveNormal(const MatrixXd& gram, const VectorXd& right) {
  const auto size = gram.rows();
  VectorXd scale(size);
  for (Eigen::Index i = 0; i < size; ++i) scale[i] = gram(i, i) > 0 ? 1 / std::sqrt(gram(i, i)) : 0;
  MatrixXd scaled = scale.asDiagonal() * gram * scale.asDiagonal();
  for (Eigen::Index i = 0; i < size; ++i)
    if (scale[i] == 0) scaled(i, i) = 1;
  const VectorXd target = scale.cwiseProduct(right);
  const Eigen::LDLT<MatrixXd> factor(scaled);
  VectorXd z = factor.solve(target);
  z += factor.solve(target - scaled * z);
  return scale.cwiseProduct(z);
}

}  // namespace

Log RandomLog(int samples, unsigned seed) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> any(-3, 3);
  Log log;
  for (MatrixXd* m : {&log.q, &log.qd, &log.qdd, &log.tau}) {
    m->resize(samples, n);
    for (double& v : m->reshaped()) v = any(random);
  }
  return log;
}

int Columns() { return Model::kColumns; }

VectorXd FusedGram(const Log& log) {
  const auto& pattern = RowPattern();
  const int samples = static_cast<int>(log.q.rows());
  std::vector<RowSum> sums;
  for (const auto& columns : pattern) sums.emplace_back(static_cast<int>(columns.size()) + 1);
  Rows<P> rows;
  Input<P> x = {};
  for (int begin = 0; begin < samples; begin += kPanel) {
    const int packs = (std::min(kPanel, samples - begin) + 7) / 8;
    for (int p = 0; p < packs; ++p) {
      const int at = begin + 8 * p;
      for (int j = 0; j < n; ++j)
        x.q[j] = Load(log.q, j, at), x.qd[j] = Load(log.qd, j, at), x.qdd[j] = Load(log.qdd, j, at);
      Regressor(x, rows);
      P counts(1);  // zero where a sample lies past the end
      for (int lane = samples - at; lane < 8; ++lane) counts.Set(lane, 0);
      for (int i = 0; i < n; ++i) {
        int k = 0;
        for (const Column& c : pattern[i])
          sums[i].column(k++)[p] = counts * (c.front ? rows.front[c.index] : rows.dense[c.index]);
        sums[i].column(k)[p] = counts * Load(log.tau, i, at);
      }
    }
    for (RowSum& s : sums) s.AddPanel(packs);
  }
  MatrixXd gram = MatrixXd::Zero(Model::kColumns, Model::kColumns);
  VectorXd right = VectorXd::Zero(Model::kColumns);
  for (int i = 0; i < n; ++i) {
    const int width = sums[i].columns(), tau = width - 1;
    MatrixXd total = MatrixXd::Zero(width, width);
    sums[i].AddTo(total.data());
    for (int a = 0; a < tau; ++a) {
      for (int b = 0; b < tau; ++b) gram(pattern[i][a].place, pattern[i][b].place) += total(a, b);
      right[pattern[i][a].place] += total(a, tau);
    }
  }
  return SolveNormal(gram, right);
}

void MakeStored(const Log& log, MatrixXd& stored, VectorXd& right) {
  const int samples = static_cast<int>(log.q.rows());
  stored.setZero(static_cast<Eigen::Index>(n) * samples, Model::kColumns);
  right.resize(static_cast<Eigen::Index>(n) * samples);
  Rows<double> rows;
  Input<double> x = {};
  for (int k = 0; k < samples; ++k) {
    for (int j = 0; j < n; ++j) x.q[j] = log.q(k, j), x.qd[j] = log.qd(k, j), x.qdd[j] = log.qdd(k, j);
    Regressor(x, rows);
    for (int i = 0; i < n; ++i) {
      const Eigen::Index r = static_cast<Eigen::Index>(n) * k + i;
      for (int c = Model::kFrontBegin[i]; c < Model::kFrontBegin[i + 1]; ++c) stored(r, c) = rows.front[c];
      for (int d = Model::kRowBegin[i]; d < Model::kDense; ++d)
        stored(r, Model::kFront + d) = rows.dense[i * Model::kDense + d];
      right[r] = log.tau(k, i);
    }
  }
}

VectorXd StoredNormal(const MatrixXd& stored, const VectorXd& right) {
  MatrixXd gram = MatrixXd::Zero(stored.cols(), stored.cols());
  gram.selfadjointView<Eigen::Lower>().rankUpdate(stored.transpose());
  const VectorXd target = stored.transpose() * right;
  return gram.selfadjointView<Eigen::Lower>().ldlt().solve(target);
}

VectorXd StoredHouseholder(MatrixXd& stored, const VectorXd& right) {
  return Eigen::HouseholderQR<Eigen::Ref<MatrixXd>>(stored).solve(right);
}

}  // namespace armcal::bench

// calibration - evaluates the model over blocks of samples and sums one Gram matrix for each joint.
#include "host_sim/identify/calibration/information.hpp"

#include <algorithm>

#include "host_sim/identify/calibration/band.hpp"
#include "host_sim/identify/calibration/channel.hpp"
#include "host_sim/identify/calibration/gram_kernel.hpp"

namespace armcal::calibration {
namespace {

// Two doubles a pack suit the plain x86-64 and NEON registers that this library is compiled for.
constexpr int kPanel = 256;
using RowSum = GramSum<math::Pack<double, 2>, 2, 4, kPanel>;

// One joint's sums: its columns that are not structurally zero, the gain's column and the torque.
class JointSum {
 public:
  JointSum(const codegen::Model& model, int joint, const Eigen::VectorXd& p)
      : p_(p), column_(Present(model, joint)), sum_(static_cast<int>(column_.size()) + 2) {}

  // root: the columns' values in one block of samples; used, tau: this joint's. Returns how many are used.
  int Add(int count, std::span<const double* const> root, const int* used, const double* tau) {
    int index[codegen::Tape::kBlock], rows = 0;
    for (int k = 0; k < count; ++k)
      if (used[k]) index[rows++] = k;
    if (filled_ + rows > kPanel) Flush();
    const int columns = static_cast<int>(column_.size());
    double* gain = panel(columns);  // d tau / d kappa
    std::fill_n(gain, rows, 0.0);
    for (int c = 0; c < columns; ++c) {
      const double* value = root[column_[c]];
      double* target = panel(c);
      for (int r = 0; r < rows; ++r) target[r] = value[index[r]];
      for (int r = 0; r < rows; ++r) gain[r] += p_[column_[c]] * target[r];
    }
    double* target = panel(columns + 1);
    for (int r = 0; r < rows; ++r) target[r] = tau[index[r]];
    filled_ += rows;
    return rows;
  }

  // Writes the sums to their places: gain_place is the gain's coordinate.
  void Finish(int gain_place, Eigen::MatrixXd& gram, Eigen::VectorXd& right, double& square) {
    Flush();
    const int width = sum_.columns(), tau = width - 1;
    Eigen::MatrixXd total = Eigen::MatrixXd::Zero(width, width);
    sum_.AddTo(total.data());
    std::vector<int> place = column_;
    place.push_back(gain_place);
    for (int i = 0; i < tau; ++i) {
      for (int k = 0; k < tau; ++k) gram(place[i], place[k]) = total(i, k);
      right[place[i]] = total(i, tau);
    }
    square = total(tau, tau);
  }

 private:
  static std::vector<int> Present(const codegen::Model& model, int joint) {
    std::vector<int> present;
    for (int c = 0; c < model.columns(); ++c)
      if (!model.rows()[joint][c].IsZero()) present.push_back(c);
    return present;
  }
  double* panel(int k) { return reinterpret_cast<double*>(sum_.column(k)) + filled_; }
  void Flush() {
    for (int c = 0; c < sum_.columns(); ++c) std::fill_n(panel(c), kPanel - filled_, 0.0);
    sum_.AddPanel();
    filled_ = 0;
  }

  const Eigen::VectorXd& p_;
  std::vector<int> column_;
  RowSum sum_;
  int filled_ = 0;  // samples in the panel
};

// A joint whose rows are averages of samples, or whose columns pass a torque channel.
bool IsFiltered(const Dataset& data, int j) {
  return data.averaged(j) || (!data.channel.empty() && !data.channel[static_cast<std::size_t>(j)].empty());
}

// What the rows of joint j take of a signal.
Eigen::MatrixXd RowsOf(const Dataset& data, int j, const Eigen::MatrixXd& signal) {
  if (data.averaged(j)) return data.average[static_cast<std::size_t>(j)] * signal;
  std::vector<Eigen::Index> used;
  for (int k = 0; k < data.samples(); ++k)
    if (data.used(k, j)) used.push_back(k);
  return signal(used, Eigen::all);
}

void SumFiltered(const codegen::Model& model, const Dataset& data, const Eigen::VectorXd& p,
                 std::span<const double> eta, Information& info) {
  const int columns = model.columns();
  std::vector<Eigen::MatrixXd> regressor;
  model.Regressor(data.s, {p.data(), static_cast<std::size_t>(columns)}, eta, regressor);
  for (int j = 0; j < model.joints(); ++j) {
    if (!IsFiltered(data, j)) continue;
    const Eigen::MatrixXd tau = RowsOf(data, j, data.tau.col(j));
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(tau.rows(), columns + model.joints());
    const ChannelAt samples(data.s.t, ChannelOf(data, j));
    for (int c = 0; c < columns; ++c)
      if (!model.rows()[j][c].IsZero())
        A.col(c) = RowsOf(data, j, samples.Through(regressor[static_cast<std::size_t>(j)].col(c)));
    A.col(columns + j) = A.leftCols(columns) * p;
    info.gram[j] = A.transpose() * A;
    info.right[j] = A.transpose() * tau.col(0);
    info.square[j] = tau.squaredNorm();
    info.rows[j] = static_cast<int>(tau.rows());
  }
}

}  // namespace

Information::Information(int joints, int coordinates)
    : gram(joints, Eigen::MatrixXd::Zero(coordinates, coordinates)),
      right(joints, Eigen::VectorXd::Zero(coordinates)),
      square(Eigen::VectorXd::Zero(joints)),
      rows(Eigen::VectorXi::Zero(joints)) {}

Information& Information::operator+=(const Information& other) {
  for (std::size_t j = 0; j < gram.size(); ++j) gram[j] += other.gram[j], right[j] += other.right[j];
  square += other.square;
  rows += other.rows;
  return *this;
}

double Information::Residual(int j, const Eigen::VectorXd& x) const {
  return std::max(0.0, square[j] - 2 * right[j].dot(x) + x.dot(gram[j] * x));
}

Information Accumulate(const codegen::Model& model, const Dataset& data, const Eigen::VectorXd& p,
                       std::span<const double> eta) {
  const int n = model.joints(), columns = model.columns();
  Information info(n, columns + n);
  std::vector<JointSum> sums;
  for (int j = 0; j < n; ++j) sums.emplace_back(model, j, p);
  const auto add = [&](int begin, int count, std::span<const double* const> root) {
    for (int j = 0; j < n; ++j)
      if (!IsFiltered(data, j))
        info.rows[j] += sums[j].Add(count, root.subspan(static_cast<std::size_t>(j) * columns, columns),
                                    data.used.col(j).data() + begin, data.tau.col(j).data() + begin);
  };
  model.ForEachBlock(data.s, {p.data(), static_cast<std::size_t>(columns)}, eta, add);
  for (int j = 0; j < n; ++j) sums[j].Finish(columns + j, info.gram[j], info.right[j], info.square[j]);
  bool filtered = false;
  for (int j = 0; j < n; ++j) filtered |= IsFiltered(data, j);
  if (filtered) SumFiltered(model, data, p, eta, info);
  return info;
}

Eigen::MatrixXd ModelTorque(const codegen::Model& model, const Dataset& data, const Eigen::VectorXd& x,
                            std::span<const double> eta) {
  const int n = model.joints(), columns = model.columns();
  Eigen::MatrixXd tau = Eigen::MatrixXd::Zero(data.samples(), n);
  const auto add = [&](int begin, int count, std::span<const double* const> root) {
    for (int j = 0; j < n; ++j) {
      auto part = tau.col(j).segment(begin, count);
      for (int c = 0; c < columns; ++c)
        if (!model.rows()[j][c].IsZero())
          part += x[c] * Eigen::Map<const Eigen::VectorXd>(root[static_cast<std::size_t>(j) * columns + c], count);
      part *= 1 + x[columns + j];
    }
  };
  model.ForEachBlock(data.s, {x.data(), static_cast<std::size_t>(columns)}, eta, add);
  return AsSaved(data, std::move(tau));
}

Eigen::MatrixXd Predict(const codegen::Model& model, const Dataset& data, const Eigen::VectorXd& x,
                        std::span<const double> eta) {
  return ThroughChannel(data, ModelTorque(model, data, x, eta));
}

}  // namespace armcal::calibration

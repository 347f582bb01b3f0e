// choice - fits every law to four fifths of the logs at a time, compares the errors on the last fifth, and judges the
// choice on the tests.
#include "host_sim/identify/choice/choose.hpp"

#include <algorithm>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/information.hpp"
#include "host_sim/identify/choice/block_errors.hpp"
#include "host_sim/identify/choice/fit_model.hpp"

namespace armcal::choice {

using calibration::Dataset;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kFolds = 5;

MatrixXd Residual(const codegen::Model& model, const Dataset& log, const VectorXd& z) {
  VectorXd x = VectorXd::Zero(model.columns() + model.joints());  // the torques' gains stay as they are
  x.head(model.columns()) = z.head(model.columns());
  const std::vector<double> eta(z.data() + model.columns(), z.data() + z.size());
  return log.tau - calibration::Predict(model, log, x, eta);
}

// Squares of one law's errors on one joint, stretch by stretch, over all training logs; `why`: it was not fitted.
struct OutOfFold {
  VectorXd squares;
  std::string why;
};

// The law on joint j, the first one on the others.
std::vector<FrictionLaw> OnJoint(const codegen::Robot& robot, const std::vector<FrictionLaw>& laws, int j,
                                 std::size_t law) {
  std::vector<FrictionLaw> out(static_cast<std::size_t>(robot.joints()), laws[0]);
  out[static_cast<std::size_t>(j)] = laws[law];
  return out;
}

// The rows of one joint alone. So what another joint's law lacks does not bend the bodies that this joint sees.
Dataset OfJoint(Dataset log, int j) {
  const Eigen::VectorXi own = log.used.col(j);
  log.used.setZero();
  log.used.col(j) = own;
  return log;
}

OutOfFold JudgeLaw(const codegen::Model& model, int j, const std::vector<Dataset>& train,
                   const std::vector<std::vector<Dataset>>& folds, const std::atomic<bool>* stop) {
  OutOfFold out;
  std::vector<VectorXd> each(train.size());
  for (int fold = 0; fold < kFolds; ++fold) {
    const ModelFit fit = FitModel(model, calibration::Pointers(folds[static_cast<std::size_t>(fold)]), stop);
    if (fit.z.size() == 0) return out.why = fit.why, out;
    for (std::size_t l = 0; l < train.size(); ++l) {
      const VectorXd squares = SquaresByStretch(train[l], Residual(model, train[l], fit.z)).col(j);
      if (fold == 0) each[l] = VectorXd::Zero(squares.size());
      for (Eigen::Index s = fold; s < squares.size(); s += kFolds) each[l][s] = squares[s];
    }
  }
  for (std::size_t l = 0; l < train.size(); ++l) {
    const Eigen::Index before = out.squares.size();
    out.squares.conservativeResize(before + each[l].size());
    out.squares.tail(each[l].size()) = each[l];
  }
  return out;
}

// [joints] how many rows of a log its errors are taken over.
VectorXd CountRows(const Dataset& log) {
  return SquaresByStretch(log, MatrixXd::Ones(log.samples(), log.joints())).colwise().sum();
}

// rows: of this joint, in all training logs.
JointChoice Compared(const std::vector<OutOfFold>& judged, double rows) {
  JointChoice out;
  if (std::none_of(judged.begin(), judged.end(), [](const OutOfFold& one) { return one.why.empty(); }))
    out.failed = judged[0].why;
  double least = INFINITY;
  for (std::size_t l = 0; l < judged.size(); ++l) {
    LawError error;
    error.failed = judged[l].why;
    if (error.failed.empty()) {
      const double sum = judged[l].squares.sum();
      error.rms_Nm = std::sqrt(sum / std::max(1.0, rows));
      if (sum < least) least = sum, out.best = l;
    }
    out.law.push_back(error);
  }
  bool found = false;
  for (std::size_t l = 0; l < judged.size(); ++l) {
    LawError& error = out.law[l];
    if (!error.failed.empty()) continue;
    error.over_best = Compare(judged[l].squares, judged[out.best].squares);
    error.beaten = l != out.best && error.over_best.low > 0;
    out.differ = out.differ || error.beaten;
    if (!error.beaten && !found) out.chosen = l, found = true;
  }
  return out;
}

}  // namespace

Choice Choose(const codegen::Robot& robot, const codegen::Catalogue& records, const std::vector<Dataset>& train,
              const ChooseSettings& settings) {
  Choice out;
  out.laws = FrictionLaws(records);
  VectorXd rows = VectorXd::Zero(robot.joints());
  for (const Dataset& log : train) rows += CountRows(log);
  for (int j = 0; j < robot.joints(); ++j) {
    std::vector<std::vector<Dataset>> folds(kFolds);
    for (int fold = 0; fold < kFolds; ++fold)
      for (const Dataset& log : train)
        folds[static_cast<std::size_t>(fold)].push_back(OfJoint(Without(log, fold, kFolds), j));
    std::vector<OutOfFold> judged;
    for (std::size_t law = 0; law < out.laws.size(); ++law) {
      const codegen::Model model(WithLaws(robot, OnJoint(robot, out.laws, j, law)), records);
      judged.push_back(JudgeLaw(model, j, train, folds, settings.stop));
      if (settings.progress)
        settings.progress((j + static_cast<double>(law + 1) / static_cast<double>(out.laws.size())) / robot.joints());
    }
    out.joint.push_back(Compared(judged, rows[j]));
  }
  if (std::none_of(out.joint.begin(), out.joint.end(), [](const JointChoice& one) { return one.failed.empty(); }))
    throw io::InputError(train[0].source + ": no law can be fitted: " + out.joint[0].failed);
  return out;
}

std::vector<VectorXd> TestLaws(const std::vector<FrictionLaw>& laws, const codegen::Robot& robot,
                               const codegen::Catalogue& records, const std::vector<Dataset>& train,
                               const Dataset& test, int joint, const std::atomic<bool>* stop) {
  std::vector<Dataset> own;
  for (const Dataset& log : train) own.push_back(OfJoint(log, joint));
  std::vector<VectorXd> out;
  for (std::size_t law = 0; law < laws.size(); ++law) {
    const codegen::Model model(WithLaws(robot, OnJoint(robot, laws, joint, law)), records);
    const ModelFit fit = FitModel(model, calibration::Pointers(own), stop);
    out.push_back(fit.z.size() ? SquaresByStretch(test, Residual(model, test, fit.z)).col(joint) : VectorXd());
  }
  return out;
}

std::vector<std::vector<HeldOut>> Judge(const Choice& choice, const codegen::Robot& robot,
                                        const codegen::Catalogue& records, const std::vector<Dataset>& train,
                                        const std::vector<Dataset>& tests) {
  std::vector<FrictionLaw> chosen;
  for (const JointChoice& joint : choice.joint) chosen.push_back(choice.laws[joint.chosen]);
  const codegen::Model with(WithLaws(robot, chosen), records),
      plain(WithLaws(robot, std::vector<FrictionLaw>(chosen.size(), choice.laws[0])), records);
  const auto fit = [&](const codegen::Model& model) {
    const ModelFit fitted = FitModel(model, calibration::Pointers(train));
    if (fitted.z.size() == 0)
      throw io::InputError(robot.path + ": the chosen laws cannot be fitted together: " + fitted.why);
    return fitted.z;
  };
  const VectorXd z = fit(with), plain_z = fit(plain);
  std::vector<std::vector<HeldOut>> out;
  for (const Dataset& test : tests) {
    const MatrixXd a = SquaresByStretch(test, Residual(with, test, z)),
                   b = SquaresByStretch(test, Residual(plain, test, plain_z)),
                   torque = SquaresByStretch(test, test.tau);
    const VectorXd rows = CountRows(test);
    out.emplace_back();
    for (int j = 0; j < robot.joints(); ++j) {
      const auto rms = [&](const MatrixXd& squares) {
        return rows[j] > 0 ? std::sqrt(squares.col(j).sum() / rows[j]) : std::nan("");
      };
      out.back().push_back({rms(b), rms(a), rms(torque), Compare(a.col(j), b.col(j))});
    }
  }
  return out;
}

}  // namespace armcal::choice

// survey - model (9): what its load column adds to the rigid columns, with the arm's own load and with a declared one.
#include <Eigen/QR>
#include <algorithm>

#include "host_sim/study/survey/platform.hpp"
#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Share of each column of B that no combination of A's columns explains.
VectorXd Unexplained(const MatrixXd& A, const MatrixXd& B) {
  const MatrixXd rest = B - A * A.colPivHouseholderQr().solve(B);
  return rest.colwise().norm().cwiseQuotient(B.colwise().norm());
}

// [samples x joints], one column a joint, stacked: f1 of each joint has rows of its own.
MatrixXd PerJoint(const MatrixXd& load) {
  const Eigen::Index samples = load.rows();
  MatrixXd out = MatrixXd::Zero(samples * load.cols(), load.cols());
  for (Eigen::Index j = 0; j < load.cols(); ++j) out.col(j).segment(j * samples, samples) = load.col(j);
  return out;
}

}  // namespace

void ShowLoad(const Settings& settings, const Motions& motions, Findings& out) {
  if (!settings.Wants("12")) return;
  const int n = settings.robot.joints();
  const codegen::Model model(Variant(settings.robot, Law::kLoad, Bodies::kBase, SetStribeck(n)), settings.records);
  const codegen::Signals s = Sampled(motions.linear.series);
  const VectorXd z = SetParameters(model);
  std::vector<MatrixXd> row;
  const auto columns = static_cast<std::size_t>(model.columns());
  model.Regressor(s, {z.data(), columns}, {z.data() + columns, static_cast<std::size_t>(model.nonlinear())}, row);

  const Eigen::Index samples = s.samples();
  MatrixXd K(samples * n, model.rigid()), own(samples, n), declared(samples, n);
  for (int j = 0; j < n; ++j) {
    const double sigma = settings.robot.joint[j].torque_noise_Nm;
    K.middleRows(j * samples, samples) = row[j].middleCols(model.front(), model.rigid()) / sigma;
    own.col(j) = row[j].middleCols(model.front(), model.rigid()) * z.segment(model.front(), model.rigid()) / sigma;
    declared.col(j) = row[j].col(PlaceOf(model, "load_linear.f1" + std::to_string(j + 1))) / sigma;
  }
  Sheet sheet{"(9)",
              "f1 tau_load: share of the column that the arm's own " + std::to_string(model.rigid()) +
                  " rigid columns do not explain",
              {"load", "f1", "smallest share", "largest share"},
              {},
              {"A share of 0 means that no data can tell f1 from the arm's own parameters: with one f1 for the arm the "
               "load column is a sum of rigid ones, whatever load it is, the arm's own or a declared payload's.",
               "With one f1 a joint it is no sum any more, because a body's parameters act on all joints before it at "
               "once. Then the arm's own load would do, if it were known: it is what is being estimated. A declared "
               "payload is known, so armcal's record asks for one."}};
  const auto add = [&](const char* load, const MatrixXd& torque) {
    const VectorXd one = Unexplained(K, torque.reshaped()), each = Unexplained(K, PerJoint(torque));
    sheet.rows.push_back({load, "one for the arm", one[0], one[0]});
    sheet.rows.push_back({load, "one a joint", each.minCoeff(), each.maxCoeff()});
  };
  add("the arm's own rigid torque", own);
  add("a payload of 10 kg at the flange", declared);
  out.sheets.push_back(sheet);
}

}  // namespace armcal::survey

// survey - Tables 5 and 6: what each method says about joint 3, without noise.
#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {
namespace {

constexpr int kJoint = 2;  // joint 3

std::vector<double> BodyOf(const Eigen::VectorXd& bodies) {
  Eigen::VectorXd body = bodies.segment(11 * kJoint, 10);
  if (std::abs(body[0]) > 1e-9) body = calibration::ToCentre(body);
  return {body.begin(), body.end()};
}

std::vector<double> Column(const Truth& truth, const Eigen::VectorXd& z, const Eigen::VectorXd& bodies) {
  std::vector<double> column = BodyOf(bodies);
  const Eigen::VectorXd friction = Friction(truth.model, z).row(kJoint);
  column.insert(column.end(), friction.begin(), friction.end());
  return column;
}

Sheet ParameterSheet(const std::string& number, const Truth& truth, const std::vector<Outcome>& outcomes,
                     const Printed& printed) {
  Sheet sheet{number, "calibration result of joint 3 without noise", {"parameter", "set"}, {}, {}};
  const std::string table = "table" + number;
  std::vector<std::vector<double>> columns{Column(truth, truth.z, truth.bodies)};
  std::vector<const Outcome*> shown;
  for (const Outcome& o : outcomes) {
    if (o.first.z.size() == 0) continue;
    columns.push_back(Column(truth, o.first.z, o.first.bodies));
    const Eigen::VectorXd error = (truth.tau - Torque(truth.model, truth.train, o.first.z)).col(kJoint);
    columns.back().push_back(error.mean());
    columns.back().push_back(std::sqrt((error.array() - error.mean()).square().mean()));
    sheet.columns.push_back(o.title);
    if (!std::isnan(printed.At(table, o.name, 0))) sheet.columns.push_back(o.title + " printed");
    shown.push_back(&o);
  }
  sheet.columns.emplace_back("set printed");
  for (std::size_t r = 0; r < columns.back().size(); ++r) {
    std::vector<Cell> row{printed.WordAt(table, "parameter", r),
                          r < columns[0].size() ? Cell(columns[0][r]) : Cell("-")};
    for (std::size_t c = 0; c < shown.size(); ++c) {
      row.emplace_back(columns[c + 1][r]);
      if (!std::isnan(printed.At(table, shown[c]->name, 0))) row.emplace_back(printed.At(table, shown[c]->name, r));
    }
    row.emplace_back(printed.At(table, "set", r));
    sheet.rows.push_back(row);
  }
  sheet.notes = {
      "SI units; centre in the link frame, inertia about the centre. mean and std: torque error of joint 3 / N m.",
      "The printed inertia of link 3 belongs to no body: its eigenvalues are -0.016, 0.186 and 0.586. The robot file "
      "holds the printed mass and centre and a fifth of the products of inertia, so that an answer that keeps bodies "
      "physical can be right at all.",
      "The first draw; methods that start from CAD values start within 20 % of the set ones."};
  return sheet;
}

}  // namespace

void ShowParameters(const Settings& settings, const Motions& motions, const Evidence& evidence, Findings& out) {
  const Stribeck set = SetStribeck(settings.robot.joints());
  if (settings.Wants("5") && !evidence.linear.empty())
    out.sheets.push_back(ParameterSheet("5", *MakeTruth(settings, motions, Law::kCoulombViscous, set), evidence.linear,
                                        settings.printed));
  if (settings.Wants("6") && !evidence.nonlinear.empty())
    out.sheets.push_back(
        ParameterSheet("6", *MakeTruth(settings, motions, Law::kStribeck, set), evidence.nonlinear, settings.printed));
}

}  // namespace armcal::survey

// survey - makes the robot variants in memory, mostly by effect records.
#include "host_sim/study/survey/arm.hpp"

namespace armcal::survey {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kStribeckFrom_radps = 0.01;  // the law shows near standstill
const char* const kGradientRecord = "stribeck_gradient";
const char* const kGaussian = "exp(-(qd/vs)^2)";  // an even function of vs: a filter may carry it below zero

codegen::EffectUse Use(const std::string& effect, int joint) {
  codegen::EffectUse use;
  use.effect = effect;
  use.joints = {joint};
  use.state = "estimated";
  return use;
}

codegen::EffectUse LawOf(Law law, int joint, double fc, double beta, const Stribeck& stribeck) {
  switch (law) {
    case Law::kStribeck: {
      codegen::EffectUse use = Use("stribeck", joint);
      use.mean["dFs"] = (stribeck.fs_over_fc[joint] - 1) * fc;
      use.nonlinear["vs"] = stribeck.qs_radps[joint];
      return use;
    }
    case Law::kExponential:
      return Use("friction_exponential", joint);
    case Law::kSechTanh:
      return Use("friction_sech_tanh", joint);
    case Law::kCubeRoot:
      return Use("viscous_cuberoot", joint);
    case Law::kLoad:
      return Use("load_linear", joint);
    default: {
      codegen::EffectUse use = Use(kGradientRecord, joint);
      use.mean = {{"Fc", fc}, {"Fs", stribeck.fs_over_fc[joint] * fc}, {"qs", 0}, {"beta", beta}};
      return use;
    }
  }
}

codegen::EffectRecord Gradient(const codegen::EffectRecord& stribeck) {
  codegen::EffectRecord record = stribeck;
  record.name = kGradientRecord;
  record.title = "derivatives of the Stribeck law by its parameters";
  record.source = "survey, equation (14) for model (4), at qs = 0.1 rad/s";
  record.replaces = "coulomb_viscous";
  record.nonlinear.clear();
  const std::string e = "exp(-(qd/0.1)^2)";
  const auto add = [&](const char* name, const std::string& expression) {
    codegen::LinearParameter p = stribeck.linear[0];
    p.name = name;
    p.rows = {{"j", expression}};
    record.linear.push_back(p);
  };
  record.linear.clear();
  add("Fc", "sgn(qd)*(1-" + e + ")");
  add("Fs", "sgn(qd)*" + e);
  add("qs", "sgn(qd)*qd^2*" + e);  // times 2 (Fs - Fc) / qs^3: a constant, and columns are scaled to unit norm
  add("beta", "qd");
  return record;
}

}  // namespace

std::string LawName(Law law) {
  constexpr const char* kName[] = {"(7)", "(4)", "(5)", "(6)", "(8)", "(9)", "(14) for (4)"};
  return kName[static_cast<int>(law)];
}

Stribeck SetStribeck(int joints) { return {VectorXd::Constant(joints, 1.2), VectorXd::Constant(joints, 0.1)}; }

codegen::Robot Variant(const codegen::Robot& file, Law law, Bodies bodies, const Stribeck& stribeck) {
  codegen::Robot robot = file;
  robot.effect.clear();
  robot.parameters = {bodies == Bodies::kStandard, {}, {}};
  for (int j = 0; j < robot.joints(); ++j) {
    robot.joint[j].motor.rotor_inertia_kgm2 = 0;
    robot.joint[j].motor.torque_constant_tolerance = 0;
    robot.parameters.omit.push_back(codegen::kBodyBlock * j + 10);
    if (law == Law::kStribeck) robot.joint[j].v_min_radps = kStribeckFrom_radps;
    if (law != Law::kCoulombViscous)
      robot.effect.push_back(LawOf(law, j, robot.joint[j].nominal["Fc"], robot.joint[j].nominal["Fv"], stribeck));
  }
  return robot;
}

codegen::Robot StribeckArm(const codegen::Robot& file, const Stribeck& stribeck) {
  codegen::Robot robot = Variant(file, Law::kStribeck, Bodies::kBase, stribeck);
  robot.name = "stribeck_arm";
  return robot;
}

codegen::Catalogue Records(codegen::Catalogue records, const Payload& payload) {
  codegen::EffectRecord& stribeck = records.at("stribeck");
  stribeck.linear[0].rows["j"] = std::string(kGaussian) + "*sgn(qd)";
  std::erase_if(stribeck.nonlinear, [](const codegen::NonlinearParameter& p) { return p.name == "delta"; });
  const auto number = [](double v) { return "(" + std::to_string(v) + ")"; };
  codegen::EffectRecord& load = records.at("load_linear");
  load.nonlinear.clear();
  load.let = {"load = " + number(payload.mass_kg) + "*(Y[flange, m] + " + number(payload.center_m[0]) +
              "*Y[flange, mx] + " + number(payload.center_m[1]) + "*Y[flange, my] + " + number(payload.center_m[2]) +
              "*Y[flange, mz])"};
  records[kGradientRecord] = Gradient(stribeck);
  return records;
}

VectorXd SetParameters(const codegen::Model& model) {
  const int columns = model.columns(), unknowns = model.nonlinear();
  VectorXd bodies(model.body_parameters()), z(columns + unknowns);
  for (int p = 0; p < bodies.size(); ++p) bodies[p] = model.table()[p].mean;
  for (int c = 0; c < columns; ++c)
    if (!model.is_rigid(c)) z[c] = model.table()[model.table_index(c)].mean;
  z.segment(model.front(), model.rigid()) = model.base_map() * bodies;
  for (int k = 0; k < unknowns; ++k) z[columns + k] = model.table()[model.parameters() - unknowns + k].mean;
  return z;
}

MatrixXd Torque(const codegen::Model& model, const codegen::Signals& s, const VectorXd& z) {
  std::vector<MatrixXd> row;
  const auto columns = static_cast<std::size_t>(model.columns());
  model.Regressor(s, {z.data(), columns}, {z.data() + columns, static_cast<std::size_t>(model.nonlinear())}, row);
  MatrixXd tau(s.samples(), model.joints());
  for (int j = 0; j < model.joints(); ++j) tau.col(j) = row[j] * z.head(model.columns());
  return tau;
}

int PlaceOf(const codegen::Model& model, const std::string& name) {
  for (int c = 0; c < model.columns(); ++c)
    if (!model.is_rigid(c) && model.column_name(c) == name) return c;
  for (int k = 0; k < model.nonlinear(); ++k)
    if (model.unknowns()[k].name == name) return model.columns() + k;
  return -1;
}

MatrixXd Friction(const codegen::Model& model, const VectorXd& z) {
  const int n = model.joints();
  const bool stribeck = PlaceOf(model, "stribeck.dFs1") >= 0;
  MatrixXd phi(n, stribeck ? 4 : 2);
  for (int j = 0; j < n; ++j) {
    const std::string number = std::to_string(j + 1);
    const double fc = z[PlaceOf(model, "Fc" + number)], beta = z[PlaceOf(model, "Fv" + number)];
    if (stribeck)
      phi.row(j) << fc, fc + z[PlaceOf(model, "stribeck.dFs" + number)], z[PlaceOf(model, "stribeck.vs" + number)],
          beta;
    else phi.row(j) << fc, beta;
  }
  return phi;
}

}  // namespace armcal::survey

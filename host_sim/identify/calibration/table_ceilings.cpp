// calibration - the firmware's check of a table, run on the PC against the model of the robot file.
#include "host_sim/identify/calibration/table_ceilings.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "armcal/model/friction_grid.hpp"
#include "codegen/src/generator/ceilings.hpp"

namespace armcal::calibration {
namespace {

using codegen::Ceilings;

// The ceilings as the firmware has them.
struct Compiled {
  explicit Compiled(const Ceilings& c) {
    const auto f = [](double v) { return static_cast<float>(v); };
    table = {static_cast<std::uint32_t>(c.least_fade_ms), static_cast<std::uint32_t>(c.longest_fade_ms),
             f(c.least_forgetting), f(c.coldest_degC), f(c.warmest_degC)};
    for (const Ceilings::OfJoint& j : c.joint)
      joint.push_back({f(j.torque_Nm), f(j.friction_Nm), f(j.feed_Nm), f(j.scale_low), f(j.scale_high),
                       f(j.sigma_low_Nm), f(j.sigma_high_Nm), f(j.v_min_low_radps), f(j.v_min_high_radps),
                       f(j.speed_radps), f(j.position_low_rad), f(j.position_high_rad)});
    for (const Ceilings::OfParameter& p : c.parameter)
      parameter.push_back({f(p.low), f(p.high), f(p.sd), f(p.process_noise)});
  }
  model::CeilingView View() const {
    return {static_cast<int>(joint.size()), static_cast<int>(parameter.size()), &table, joint.data(), parameter.data()};
  }
  model::TableCeiling table{};
  std::vector<model::JointCeiling> joint;
  std::vector<model::ParameterCeiling> parameter;
};

std::string InWords(const TableFile& t, const core::Refusal& r) {
  const std::string name = WordName(t, r.word);
  switch (r.status) {
    case core::Status::kNotFinite:
      return fmt::format("{} is not finite", name);
    case core::Status::kFeedsEnergy:
      return fmt::format(
          "{}: the joint's friction would push by {:.6g} N m (N) where it has to brake, expected at most {:.6g}", name,
          -r.value, -r.bound);
    default:
      return fmt::format("{} is {:.9g}, expected {} {:.9g}", name, r.value, r.value > r.bound ? "at most" : "at least",
                         r.bound);
  }
}

// The friction of one joint at one point of the firmware's grid.
struct GridFriction {
  int joint = 0;
  double speed_radps = 0, degC = 0;
  Eigen::VectorXd braking;  // [columns] against the motion, per unit of each column that counts
  double sum_Nm = 0;
  int column = 0;  // the one with the largest torque

  core::Status Judge(const model::CeilingView& view) const {
    return model::JudgeFriction(view.joint[joint], static_cast<float>(sum_Nm));
  }
};

double Amplitude(const TableRow& row) { return row.state == "standby" ? 0.0 : row.mean; }

// In the firmware's order.
std::vector<GridFriction> FrictionOnGrid(const codegen::Model& m, const Ceilings& c, const model::CeilingView& view,
                                         const TableFile& t) {
  const bool history = (c.friction_reads & model::kReadsHistory) != 0;
  const int n = m.joints(), points = model::GridPoints(c.friction_reads, m.nonlinear()), each = history ? 2 : 1;
  std::vector<double> eta;
  for (int k = m.parameters() - m.nonlinear(); k < m.parameters(); ++k) eta.push_back(t.row[k].mean);
  codegen::Signals s;
  s.q = s.qd = s.temp = Eigen::MatrixXd(points * each, n);
  s.qdd = Eigen::MatrixXd::Zero(points * each, n);
  s.t = Eigen::VectorXd::LinSpaced(points * each, 0, double{model::kGridStep_s} * (points * each - 1));
  for (int p = 0; p < points; ++p) {
    Eigen::VectorXd q(n), qd(n), temp(n);
    model::GridState(view, c.friction_reads, p, eta.data(), q.data(), qd.data(), temp.data());
    for (int k = 0; k < each; ++k) {
      const int row = p * each + k;
      s.q.row(row) = q - (k + 1 < each ? double{model::kGridStep_s} : 0.0) * qd;
      s.qd.row(row) = qd;
      s.temp.row(row) = temp;
    }
  }
  Eigen::VectorXd bodies(m.body_parameters());
  for (int k = 0; k < bodies.size(); ++k) bodies[k] = Amplitude(t.row[k]);
  const Eigen::VectorXd base = m.base_map() * bodies;
  std::vector<double> committed(m.columns());
  for (int k = 0; k < m.columns(); ++k)
    committed[k] = m.is_rigid(k) ? base[k - m.front()] : Amplitude(t.row[m.table_index(k)]);
  std::vector<Eigen::MatrixXd> rows;
  m.Regressor(s, committed, eta, rows);
  std::vector<GridFriction> out;
  for (int p = 0; p < points; ++p)
    for (int i = 0; i < n; ++i) {
      const int row = p * each + each - 1;
      GridFriction at{i, s.qd(row, i), s.temp(row, i), Eigen::VectorXd::Zero(m.columns()), 0, m.front_begin(i)};
      double greatest = -1;
      for (int k = m.front_begin(i); k < m.front_begin(i + 1); ++k) {
        if (!c.friction[k] || t.row[m.table_index(k)].state == "standby") continue;
        at.braking[k] = at.speed_radps < 0 ? -rows[i](row, k) : rows[i](row, k);
        const double part = committed[k] * at.braking[k];
        at.sum_Nm += part;
        if (std::abs(part) > greatest) greatest = std::abs(part), at.column = k;
      }
      out.push_back(std::move(at));
    }
  return out;
}

core::Refusal JudgeGrid(const codegen::Model& m, const Ceilings& c, const model::CeilingView& view,
                        const TableFile& t) {
  for (const GridFriction& at : FrictionOnGrid(m, c, view, t)) {
    const core::Status judged = at.Judge(view);
    if (core::IsOk(judged)) continue;
    const model::JointCeiling& ceiling = view.joint[at.joint];
    return {judged, model::WordOfParameter(m.joints(), m.table_index(at.column)), static_cast<float>(at.sum_Nm),
            judged == core::Status::kFeedsEnergy ? -ceiling.feed_Nm : ceiling.friction_Nm};
  }
  return {};
}

// A limit lies inside its ceiling by this share of the way to the model's own value. Floats then round to the right
// side.
constexpr double kInside = 1e-3;

Limit NoLimit(const codegen::Model& m) {
  return {0, Eigen::VectorXd::Zero(m.body_parameters()), Eigen::VectorXd::Zero(m.columns() + m.joints())};
}

void AddMeans(const codegen::Model& m, const Ceilings& c, const TableFile& t, Ceiled& out) {
  const auto add = [&](int k, Eigen::VectorXd Limit::*part, int place) {
    const TableRow& row = t.row[k];
    const auto& [low, high, sd, process_noise] = c.parameter[k];
    if (row.state != "estimated" || (row.mean >= low && row.mean <= high)) return;
    const double ceiling = row.mean < low ? low : high;
    Limit limit = NoLimit(m);
    const double towards = row.mean < low ? 1 : -1;  // the sum grows away from the ceiling
    (limit.*part)[place] = towards;
    limit.base = -towards * (ceiling + kInside * (m.table()[k].mean - ceiling));
    out.limits.push_back(std::move(limit));
    out.said.push_back(fmt::format("{}: the fit gives {:.6g}; a drive takes {} {:.6g}, so it was held there", row.name,
                                   row.mean, row.mean < low ? "at least" : "at most", ceiling));
  };
  for (int k = 0; k < m.body_parameters(); ++k) add(k, &Limit::bodies, k);
  for (int k = 0; k < m.columns(); ++k)
    if (!m.is_rigid(k)) add(m.table_index(k), &Limit::x, k);
}

void AddFriction(const codegen::Model& m, const Ceilings& c, const model::CeilingView& view, const TableFile& t,
                 Ceiled& out) {
  const std::vector<GridFriction> grid = FrictionOnGrid(m, c, view, t);
  Eigen::VectorXd own = Eigen::VectorXd::Zero(m.columns());
  for (int k = 0; k < m.columns(); ++k)
    if (!m.is_rigid(k)) own[k] = m.table()[m.table_index(k)].mean;
  for (int j = 0; j < m.joints(); ++j) {
    const Ceilings::OfJoint& ceiling = c.joint[j];
    const GridFriction* worst = nullptr;
    const auto excess = [&](const GridFriction& at) {
      return std::max(-at.sum_Nm / ceiling.feed_Nm, at.sum_Nm / ceiling.friction_Nm);
    };
    for (const GridFriction& at : grid)
      if (at.joint == j && !core::IsOk(at.Judge(view)) && (!worst || excess(at) > excess(*worst))) worst = &at;
    if (!worst) continue;
    out.joints.push_back(j);
    const bool pushes = worst->sum_Nm < 0, by_temperature = (c.friction_reads & model::kReadsTemperature) != 0;
    out.said.push_back(fmt::format(
        "joint {}: at {:.3g} rad/s (m/s){} the fitted friction would {} by {:.4g} N m (N); a drive takes at most "
        "{:.4g}, so it was held there",
        j + 1, worst->speed_radps, by_temperature ? fmt::format(" and {:g} deg C", worst->degC) : "",
        pushes ? "push" : "brake", std::abs(worst->sum_Nm), pushes ? ceiling.feed_Nm : ceiling.friction_Nm));
    for (const GridFriction& at : grid) {
      if (at.joint != j) continue;
      const double before = at.braking.dot(own);
      Limit brakes = NoLimit(m), bounded = NoLimit(m);
      brakes.x.head(m.columns()) = at.braking, bounded.x.head(m.columns()) = -at.braking;
      brakes.base = ceiling.feed_Nm - kInside * (ceiling.feed_Nm + before);
      bounded.base = ceiling.friction_Nm - kInside * (ceiling.friction_Nm - before);
      out.limits.push_back(std::move(brakes));
      out.limits.push_back(std::move(bounded));
    }
  }
}

}  // namespace

std::string WordName(const TableFile& t, int word) {
  const int joints = static_cast<int>(t.joint.size()), parameters = static_cast<int>(t.row.size());
  if (word >= model::WordOfGate(joints, parameters, joints)) return fmt::format("word {}", word);
  if (word >= model::WordOfGate(joints, parameters, 0))
    return fmt::format("joint {}: gate_sigma",
                       (word - model::WordOfGate(joints, parameters, 0)) / model::kGateWords + 1);
  if (word >= model::WordOfParameter(joints, 0)) {
    const int k = word - model::WordOfParameter(joints, 0);
    const char* const part[] = {"mean", "mean", "sd", "sd", "process_noise", "process_noise", "state and group", "end"};
    return fmt::format("{}: {}", t.row[k / model::kParameterWords].name, part[k % model::kParameterWords]);
  }
  if (word >= model::WordOfJoint(0)) {
    const int k = word - model::WordOfJoint(0);
    const char* const part[] = {"sigma_Nm", "v_min_radps", "torque_limit_Nm", "torque_scale"};
    return fmt::format("joint {}: {}", k / model::kJointWords + 1, part[k % model::kJointWords / 2]);
  }
  return word == 5 ? "flags (bumpless)" : word < 8 ? "blend_ms" : fmt::format("forgetting of group {}", (word - 8) / 2);
}

Ceiled BeyondCeilings(const codegen::Model& m, const TableFile& t) {
  const Ceilings ceilings = codegen::MakeCeilings(m);
  const Compiled compiled(ceilings);
  Ceiled out;
  AddMeans(m, ceilings, t, out);
  AddFriction(m, ceilings, compiled.View(), t, out);
  return out;
}

std::string BeyondCeiling(const codegen::Model& m, const TableFile& t) {
  const Ceilings ceilings = codegen::MakeCeilings(m);
  const Compiled compiled(ceilings);
  const std::vector<std::uint16_t> words = EncodeTable(t);
  // Only the board knows whether it allows a bumpless table, so the drive is left to say it.
  const core::Refusal refusal = model::CheckWords(compiled.View(), true, words.data());
  if (!core::IsOk(refusal.status)) return InWords(t, refusal);
  const core::Refusal friction = JudgeGrid(m, ceilings, compiled.View(), t);
  if (friction.status == core::Status::kBeyondCeiling)
    return fmt::format("{}: the joint's friction would reach {:.6g} N m (N), expected at most {:.6g}",
                       WordName(t, friction.word), friction.value, friction.bound);
  return core::IsOk(friction.status) ? "" : InWords(t, friction);
}

}  // namespace armcal::calibration

// generator - derives ceilings: wide enough for what a fit may find, and far below what a hostile table would ask for.
#include "codegen/src/generator/ceilings.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include "codegen/src/io/input_error.hpp"

namespace armcal::codegen {
namespace {

constexpr double kPriorSpreads = 20;     // a body's mass, centre and inertia may lie so many standard deviations away
constexpr double kColumnSpreads = 10;    // a column: ten times its scale, which is a share of the joint's torque limit
constexpr double kWiderSd = 10;          // a prior may be so many times wider than the default
constexpr double kSmallestShare = 1e-6;  // of the torque ceiling: the least torque noise
constexpr double kFrictionToTorque = 3;  // a law that fits warm oil is extrapolated to cold oil at full speed
constexpr double kWiderStandstill = 10;  // friction is not fed forward below v_min
constexpr double kLoadDistance_m = 0.3;  // of a load's centre from the last link's frame, along each axis
constexpr double kGravity_mps2 = 9.81;
constexpr unsigned kReadsPose = 1, kReadsTemperature = 2, kReadsHistory = 4;

double Own(const std::vector<double>& given, int joint, double otherwise) {
  return given.empty() ? otherwise : given[joint];
}

Ceilings::OfJoint OfJoint(const Robot& r, int i) {
  const Joint& j = r.joint[i];
  const CeilingSettings& s = r.ceilings;
  const double torque = Own(s.torque_Nm, i, j.torque_limit_Nm);
  return {torque,
          Own(s.friction_Nm, i, kFrictionToTorque * torque),
          s.feed_share * torque,
          s.torque_scale[0],
          s.torque_scale[1],
          kSmallestShare * torque,
          Own(s.noise_Nm, i, torque),
          0.01 * j.v_min_radps,
          std::min(kWiderStandstill * j.v_min_radps, j.speed_limit_radps),
          j.speed_limit_radps,
          j.position_limit_rad[0],
          j.position_limit_rad[1]};
}

// The heaviest load beyond the last link that every joint holds on a stretched arm that weighs nothing. A log of a
// laden arm shows the load as a part of the last link, whose own mass says nothing of it.
double LargestLoad_kg(const Robot& r) {
  double load_kg = INFINITY, reach_m = kLoadDistance_m;
  for (int i = r.joints() - 1; i >= 0; --i) {
    const Joint& j = r.joint[i];
    const bool slides = j.kinematics.type == JointType::kPrismatic;
    const double held_N = Own(r.ceilings.torque_Nm, i, j.torque_limit_Nm) / (slides ? 1 : reach_m);
    load_kg = std::min(load_kg, held_N / kGravity_mps2);
    reach_m += std::hypot(j.kinematics.a_m, j.kinematics.d_m);
    if (slides) reach_m += std::max(std::abs(j.position_limit_rad[0]), std::abs(j.position_limit_rad[1]));
  }
  return load_kg;
}

// The ten parameters of a link whose mass, centre and inertia about the centre all lie kPriorSpreads away at once, and
// of the last link with the largest load.
void BoundLink(const Model& m, int link, std::vector<Ceilings::OfParameter>& out) {
  const TableParameter* p = &m.table()[kBodyBlock * link];
  double low[10], high[10];
  if (m.robot().has_prior) {
    const Link& l = m.robot().joint[link].link;
    const double mass = l.mass_kg + kPriorSpreads * p[0].sd;
    double centre[3], inertia = 0;
    for (int k = 0; k < 3; ++k) centre[k] = std::abs(l.center_m[k]) + kPriorSpreads * p[1 + k].sd;
    for (int k = 0; k < 6; ++k) inertia = std::max(inertia, std::abs(l.inertia_kgm2[k]) + kPriorSpreads * p[4 + k].sd);
    const double about_origin =
        inertia + mass * (centre[0] * centre[0] + centre[1] * centre[1] + centre[2] * centre[2]);
    high[0] = mass;
    for (int k = 0; k < 3; ++k) high[1 + k] = mass * centre[k];
    for (int k = 0; k < 6; ++k) high[4 + k] = about_origin;
    if (link == m.joints() - 1) {
      const double load_kg = LargestLoad_kg(m.robot());
      high[0] += load_kg;
      for (int k = 0; k < 3; ++k) high[1 + k] += load_kg * kLoadDistance_m;
      for (int k = 0; k < 6; ++k) high[4 + k] += 3 * load_kg * kLoadDistance_m * kLoadDistance_m;
    }
  } else {
    for (int k = 0; k < 10; ++k) high[k] = std::abs(p[k].mean) + kPriorSpreads * p[k].sd;
  }
  for (int k = 0; k < 10; ++k) {
    const bool positive = k == 0 || k == 4 || k == 7 || k == 9;  // mass and the diagonal of the inertia
    low[k] = positive ? 0 : -high[k];
    out.push_back({low[k], high[k], kWiderSd * p[k].sd, 0});
  }
}

void BoundRotor(const Model& m, int link, std::vector<Ceilings::OfParameter>& out) {
  const TableParameter& p = m.table()[kBodyBlock * link + kBodyBlock - 1];
  const Joint& j = m.robot().joint[link];
  const double by_torque = 0.2 * j.torque_limit_Nm / j.acceleration_limit_radps2;
  const double scale = std::max({p.mean, p.sd, by_torque});
  out.push_back({0, kColumnSpreads * scale, kWiderSd * std::max(p.sd, scale), 0});
}

const EffectRecord& RecordOf(const Model& m, const std::string& name) {
  return *std::find_if(m.effects().begin(), m.effects().end(), [&](const auto& e) {
            return e.record->name == name;
          })->record;
}

// The scale of an effect's column by its record.
double RecordScale(const Model& m, const std::string& column) {
  for (const EffectInstance& e : m.effects())
    for (const EffectColumn& c : e.columns)
      if (c.name == column) return c.sd;
  return 0;
}

Ceilings::OfParameter OfColumn(const Model& m, const TableParameter& p) {
  double scale = std::max({RecordScale(m, p.name), p.sd, std::abs(p.mean)});
  if (!(scale > 0)) scale = 1;
  const double sd = kWiderSd * scale;
  const double sample_s = m.robot().sample_ticks / m.robot().tick_rate_Hz;
  return {-kColumnSpreads * scale, kColumnSpreads * scale, sd, std::max(sd * sd * sample_s, 10 * p.process_noise)};
}

Ceilings::OfParameter OfUnknown(const TableParameter& p) {
  const double range = p.upper - p.lower;
  return {std::min(p.lower, p.mean), std::max(p.upper, p.mean), range, range * range};
}

// Random states of the arm, each a moment of its own.
Signals RandomStates(const Robot& r) {
  constexpr int kStates = 24;
  const int n = r.joints();
  Signals s;
  s.q = s.qd = s.temp = Eigen::MatrixXd(kStates, n);
  s.qdd = Eigen::MatrixXd::Zero(kStates, n);
  s.t = Eigen::VectorXd::LinSpaced(kStates, 0, kStates - 1);
  std::mt19937 random(1);
  const auto share = [&] { return static_cast<double>(random()) / 4294967296.0; };
  for (int k = 0; k < kStates; ++k)
    for (int i = 0; i < n; ++i) {
      const Joint& j = r.joint[i];
      s.q(k, i) = j.position_limit_rad[0] + share() * (j.position_limit_rad[1] - j.position_limit_rad[0]);
      s.qd(k, i) = (share() < 0.5 ? -1 : 1) * (0.1 + 0.8 * share()) * j.speed_limit_radps;
      s.temp(k, i) = 20 + 30 * share();
    }
  return s;
}

// The front columns, each in its own joint's row, with the bodies of the model's own table.
Eigen::MatrixXd FrontColumns(const Model& m, const Signals& s) {
  Eigen::VectorXd bodies(m.body_parameters());
  for (int k = 0; k < bodies.size(); ++k) bodies[k] = m.table()[k].mean;
  const Eigen::VectorXd base = m.base_map() * bodies;
  std::vector<double> committed(m.columns(), 0.0);
  for (int d = 0; d < m.rigid(); ++d) committed[m.front() + d] = base[d];
  std::vector<Eigen::MatrixXd> rows;
  m.Regressor(s, committed, {}, rows);
  Eigen::MatrixXd out(s.samples(), m.front());
  for (int c = 0; c < m.front(); ++c) out.col(c) = rows[m.column_joint(c)].col(c);
  return out;
}

// A friction column is the friction law's, or it is zero while its joint stands, whatever the others do, and not zero
// while its joint alone moves. So the product of two joints' speeds is none, and an offset is none.
void FindFriction(const Model& m, Ceilings& c) {
  const Signals moving = RandomStates(m.robot());
  Signals warmer = moving, elsewhere = moving;
  warmer.temp.array() += 10;
  elsewhere.q.array() += 0.7;
  const Eigen::MatrixXd value = FrontColumns(m, moving);
  const Eigen::MatrixXd by_temperature = FrontColumns(m, warmer) - value, by_pose = FrontColumns(m, elsewhere) - value;
  c.friction.assign(m.front(), false);
  for (int j = 0; j < m.joints(); ++j) {
    Signals stands = moving, alone = moving;
    stands.qd.col(j).setZero();
    alone.qd.setZero();
    alone.qd.col(j) = moving.qd.col(j);
    const Eigen::MatrixXd standing = FrontColumns(m, stands), alone_moving = FrontColumns(m, alone);
    for (int k = m.front_begin(j); k < m.front_begin(j + 1); ++k) {
      const EffectRecord& record = RecordOf(m, m.table()[m.table_index(k)].effect);
      const bool law = record.friction_law || !record.replaces.empty();
      const bool memory = record.effect_class == EffectClass::kStateful;
      c.friction[k] = law || (!memory && standing.col(k).isZero(0) && !alone_moving.col(k).isZero(0));
      if (!c.friction[k]) continue;
      if (memory) c.friction_reads |= kReadsHistory;
      if (!by_temperature.col(k).isZero(0)) c.friction_reads |= kReadsTemperature;
      if (!memory && !by_pose.col(k).isZero(0)) c.friction_reads |= kReadsPose;
    }
  }
}

// What the robot file says of single parameters.
void ApplyOwnBounds(const Model& m, Ceilings& c) {
  for (const auto& [name, range] : m.robot().ceilings.parameter) {
    const auto at = std::find_if(m.table().begin(), m.table().end(), [&](const auto& p) { return p.name == name; });
    if (at == m.table().end())
      throw io::InputError(m.robot().path + ": ceilings.parameter." + name + ": expected the name of a parameter");
    Ceilings::OfParameter& bound = c.parameter[at - m.table().begin()];
    bound.low = range[0], bound.high = range[1];
  }
}

// The file's own limits and noise must be allowed by its [ceilings].
void CheckJoints(const Robot& r) {
  const CeilingSettings& s = r.ceilings;
  const auto require = [&r](bool fits, const char* key, int joint, const std::string& what) {
    if (!fits)
      throw io::InputError(r.path + ": ceilings." + key + ": joint " + std::to_string(joint + 1) + ": " + what +
                           " of the file lies outside");
  };
  require(s.torque_scale[0] <= 1 && 1 <= s.torque_scale[1], "torque_scale", 0, "the scale 1");
  for (int j = 0; j < r.joints(); ++j) {
    const Joint& joint = r.joint[static_cast<std::size_t>(j)];
    require(joint.torque_limit_Nm <= Own(s.torque_Nm, j, joint.torque_limit_Nm), "torque_Nm", j, "the torque limit");
    require(joint.torque_noise_Nm <= Own(s.noise_Nm, j, INFINITY), "noise_Nm", j, "the torque noise");
  }
}

}  // namespace

Ceilings MakeCeilings(const Model& m) {
  const CeilingSettings& s = m.robot().ceilings;
  Ceilings c{
      s.least_fade_ms, s.longest_fade_ms, s.least_forgetting, s.temperature_degC[0], s.temperature_degC[1], {}, {}, {}};
  for (int j = 0; j < m.joints(); ++j) {
    c.joint.push_back(OfJoint(m.robot(), j));
    BoundLink(m, j, c.parameter);
    BoundRotor(m, j, c.parameter);
  }
  for (int k = m.body_parameters(); k < m.parameters(); ++k)
    c.parameter.push_back(k < m.parameters() - m.nonlinear() ? OfColumn(m, m.table()[k]) : OfUnknown(m.table()[k]));
  ApplyOwnBounds(m, c);
  CheckJoints(m.robot());
  FindFriction(m, c);
  for (int k = 0; k < m.parameters(); ++k)
    if (const TableParameter& p = m.table()[k]; p.mean < c.parameter[k].low || p.mean > c.parameter[k].high)
      throw io::InputError(m.robot().path + ": " + p.name + ": the model's own value lies outside its ceiling");
  return c;
}

}  // namespace armcal::codegen

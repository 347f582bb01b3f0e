// generator - carries accelerations and screws outward along the arm, and reads a vector in other axes.
#include "codegen/src/generator/arm_vectors.hpp"

#include <cmath>
#include <numbers>

namespace armcal::codegen {
namespace {

Vec operator+(const Vec& a, const Vec& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }

// sin and cos of a fixed angle; exact at multiples of 90 degrees.
void ExactSinCos(double angle, double& s, double& c) {
  const double quarter = angle / (std::numbers::pi / 2);
  if (std::abs(quarter - std::round(quarter)) < 1e-12) {
    const int k = ((static_cast<int>(std::lround(quarter)) % 4) + 4) % 4;
    s = k == 1 ? 1 : (k == 3 ? -1 : 0);
    c = k == 0 ? 1 : (k == 2 ? -1 : 0);
  } else {
    s = std::sin(angle);
    c = std::cos(angle);
  }
}

bool IsRevolute(const Robot& robot, int j) { return robot.joint[j].kinematics.type == JointType::kRevolute; }

Expr Dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec Cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
}  // namespace

ArmVectors::ArmVectors(Graph& graph, const Robot& robot, bool motion, const FrameChoice& choice)
    : graph_(graph), robot_(robot), motion_(motion) {
  MakeSteps(choice);
  for (int j = 0; j < robot.joints(); ++j) AddLink(j, choice);
}

void ArmVectors::MakeSteps(const FrameChoice& choice) {
  double slide_before = 0;
  for (int j = 0; j < robot_.joints(); ++j) {
    const JointKinematics& k = robot_.joint[j].kinematics;
    const Expr q = graph_.Input({Quantity::kPosition, j});
    Step fixed, moving;
    ExactSinCos(k.alpha_rad, fixed.sa, fixed.ca);
    double so, co;
    ExactSinCos(k.theta_rad, so, co);
    moving.joint = true;
    moving.s = graph_.Constant(so), moving.c = graph_.Constant(co);
    if (IsRevolute(robot_, j)) {
      const Expr s = graph_.Unary(Op::kSin, q), c = graph_.Unary(Op::kCos, q);
      moving.s = co * s + so * c;
      moving.c = co * c - so * s;
    }
    Expr d = graph_.Constant(k.d_m + choice.slide_m[j]);
    if (!IsRevolute(robot_, j)) d = d + q;
    p_.push_back({graph_.Constant(k.a_m), -(fixed.sa * d), fixed.ca * d - graph_.Constant(slide_before)});
    slide_before = choice.slide_m[j];
    step_.push_back(fixed), step_.push_back(moving);
  }
}

Vec ArmVectors::Outward(int half, const Vec& v) const {
  const Step& m = step_[half];
  if (m.joint) return {m.c * v[0] + m.s * v[1], m.c * v[1] - m.s * v[0], v[2]};
  return {v[0], m.ca * v[1] + m.sa * v[2], m.ca * v[2] - m.sa * v[1]};
}

Vec ArmVectors::Inward(int half, const Vec& v) const {
  const Step& m = step_[half];
  if (m.joint) return {m.c * v[0] - m.s * v[1], m.c * v[1] + m.s * v[0], v[2]};
  return {v[0], m.ca * v[1] - m.sa * v[2], m.ca * v[2] + m.sa * v[1]};
}

Vec ArmVectors::PointOnFlange(double along_m) const {
  const Expr none = graph_.Constant(0);
  Vec at{none, none, graph_.Constant(along_m)};
  for (int j = robot_.joints() - 1; j >= 0; --j) at = p_[j] + Inward(2 * j, Inward(2 * j + 1, at));
  return at;
}

ArmVectors::Vector* ArmVectors::Make(const std::string& name, int half, const Vec& components) {
  Vector* v = Make(name);
  v->in[half] = components;
  NameComponents(*v, half);
  return v;
}

Expr ArmVectors::Rate(Quantity quantity, int joint) const {
  return motion_ ? graph_.Input({quantity, joint}) : graph_.Constant(0);
}

void ArmVectors::NameComponents(const Vector& v, int half) {
  const std::string axes = half < 0 ? "0" : std::to_string(half / 2 + 1) + (half % 2 ? "" : "i");
  const Vec& c = v.in.at(half);
  for (int k = 0; k < 3; ++k) graph_.Name(c[k], v.name + "_" + axes + "xyz"[k]);
}

const Vec& ArmVectors::In(Vector* v, int half) {
  if (const auto it = v->in.find(half); it != v->in.end()) return it->second;
  // from the nearest axes in which it is known; of two as near, from inside
  const auto above = v->in.lower_bound(half);
  bool outward = above != v->in.begin();
  if (outward && above != v->in.end()) outward = half - std::prev(above)->first <= above->first - half;
  const Vec components = outward ? Outward(half, In(v, half - 1)) : Inward(half + 1, In(v, half + 1));
  v->in[half] = components;
  NameComponents(*v, half);
  return v->in[half];
}

void ArmVectors::AddLink(int j, const FrameChoice& choice) {
  AddRates(j, choice.lumped[j]);
  const bool same_origin = p_[j][0].IsZero() && p_[j][1].IsZero() && p_[j][2].IsZero();
  AddOrigin(j, same_origin);
  AddScrews(j, same_origin);
  AddBodyVectors(j);
}

// The acceleration of the new origin: first as a point of the link before, then with the slide's own motion.
void ArmVectors::AddOrigin(int j, bool same_origin) {
  const std::string link = std::to_string(j + 1);
  Vector* a = j ? a_[j - 1] : Make("a0");
  if (j == 0)  // the base accelerates upward instead of gravity pulling down
    for (int k = 0; k < 3; ++k) {
      double value = 0;
      for (int m = 0; m < 3; ++m) value -= robot_.base_rotation[3 * m + k] * robot_.gravity_mps2[m];
      a->in[-1][k] = graph_.Constant(value);
    }
  if (j > 0 && !same_origin) {
    Vec at = In(a, 2 * j - 1);
    for (int m = 0; m < 3; ++m) {  // U p; the zeros fold away
      const Vec& u = force_[j - 1][m]->in.at(2 * j - 1);
      for (int k = 0; k < 3; ++k) at[k] = at[k] + u[k] * p_[j][m];
    }
    a = Make("a" + link, 2 * j - 1, at);
  }
  if (!IsRevolute(robot_, j)) {
    const Vec at = In(a, 2 * j), w = In(omega_[j], 2 * j);
    const Expr qd = Rate(Quantity::kSpeed, j);
    a = Make("a" + link, 2 * j, at + Vec{2.0 * (w[1] * qd), -(2.0 * (w[0] * qd)), Rate(Quantity::kAcceleration, j)});
  }
  a_.push_back(a);
}

void ArmVectors::AddScrews(int j, bool same_origin) {
  const std::string link = std::to_string(j + 1);
  lever_.emplace_back(robot_.joints(), nullptr);
  for (int i = 0; i < j; ++i) {
    lever_[i][j] = lever_[i][j - 1];
    if (same_origin || !IsRevolute(robot_, i)) continue;
    const Vec v = In(lever_[i][j - 1], 2 * j - 1) + Cross(In(z_[i], 2 * j - 1), p_[j]);
    lever_[i][j] = Make("v" + std::to_string(i + 1) + link, 2 * j - 1, v);
  }
  const Expr zero = graph_.Constant(0), one = graph_.Constant(1);
  const Vec none{zero, zero, zero}, along{zero, zero, one};
  z_.push_back(Make("z" + link));
  lever_[j][j] = Make("v" + link);
  for (const int half : {2 * j, 2 * j + 1}) {
    z_[j]->in[half] = IsRevolute(robot_, j) ? along : none;
    lever_[j][j]->in[half] = IsRevolute(robot_, j) ? none : along;
  }
}

void ArmVectors::AddRates(int j, bool lumped) {
  const std::string link = std::to_string(j + 1);
  const Expr zero = graph_.Constant(0);
  const Vec none{zero, zero, zero};
  const bool revolute = IsRevolute(robot_, j);
  // Links on parallel axes turn as one about that axis: from `first` on, the angle and its rates are sums.
  int first = j;
  while (lumped && first > 0 && IsRevolute(robot_, first - 1) && step_[2 * first].ca == 1) --first;
  Expr qd = Rate(Quantity::kSpeed, first), s = step_[2 * first + 1].s, c = step_[2 * first + 1].c;
  for (int k = first + 1; k <= j && revolute; ++k) {
    qd = qd + Rate(Quantity::kSpeed, k);
    const Expr sk = step_[2 * k + 1].s, ck = step_[2 * k + 1].c, sum = ck * s + sk * c;
    c = ck * c - sk * s;
    s = sum;
  }
  const auto turn = [&](const Vec& v) { return Vec{c * v[0] + s * v[1], c * v[1] - s * v[0], v[2]}; };
  const auto seen = [&](const std::vector<Vector*>& v, int k) { return k ? In(v[k - 1], 2 * k) : none; };
  Vector* w = Make("w" + link);
  Vector* dw = Make("dw" + link);
  if (!revolute && j) {
    w = omega_[j - 1], dw = alpha_[j - 1];
  } else if (!revolute) {
    w->in[0] = dw->in[0] = none;
  } else {
    const Vec w_in = seen(omega_, j);
    w->in[2 * j] = {w_in[0], w_in[1], w_in[2] + Rate(Quantity::kSpeed, j)};
    const Vec turned = turn(seen(omega_, first)), d = turn(seen(alpha_, first));
    w->in[2 * j + 1] = {turned[0], turned[1], w->in[2 * j][2]};
    dw->in[2 * j + 1] = {d[0] + turned[1] * qd, d[1] - turned[0] * qd,
                         seen(alpha_, j)[2] + Rate(Quantity::kAcceleration, j)};
    NameComponents(*w, 2 * j + 1);
    NameComponents(*dw, 2 * j + 1);
  }
  omega_.push_back(w);
  alpha_.push_back(dw);
}

void ArmVectors::AddBodyVectors(int j) {
  const std::string link = std::to_string(j + 1);
  const Vec &w = In(omega_[j], 2 * j + 1), &dw = In(alpha_[j], 2 * j + 1);
  const Expr xx = w[0] * w[0], yy = w[1] * w[1], zz = w[2] * w[2], xy = w[0] * w[1], xz = w[0] * w[2], yz = w[1] * w[2];
  const Vec column[] = {
      {-(yy + zz), xy + dw[2], xz - dw[1]}, {xy - dw[2], -(xx + zz), yz + dw[0]}, {xz + dw[1], yz - dw[0], -(xx + yy)}};
  force_.emplace_back();
  for (int k = 0; k < 3; ++k) {
    force_[j].push_back(Make(std::string("f") + "xyz"[k] + link, 2 * j + 1, column[k]));
  }
  const auto &X = column[0], &Y = column[1], &Z = column[2];
  const Vec of_inertia[] = {{dw[0], xz, -xy}, {-X[2], Y[2], xx - yy}, {X[1], zz - xx, -Z[1]},
                            {-yz, dw[1], xy}, {yy - zz, -Y[0], Z[0]}, {yz, -xz, dw[2]}};
  const char* const name[] = {"nxx", "nxy", "nxz", "nyy", "nyz", "nzz"};
  moment_.emplace_back();
  for (int k = 0; k < 6; ++k) {
    moment_[j].push_back(Make(name[k] + link, 2 * j + 1, of_inertia[k]));
  }
  // A turn about z does not change Izz: in the axes before the joint's rotation its moment has the same form.
  if (!IsRevolute(robot_, j)) return;
  const Vec& before = In(omega_[j], 2 * j);
  moment_[j][5]->in[2 * j] = {before[1] * before[2], -(before[0] * before[2]), dw[2]};
}

Expr ArmVectors::Torque(int i, int j, int parameter, const std::array<int, FrameChoice::kParts>& axes) {
  const auto dot = [this](Vector* a, Vector* b, int half) { return Dot(In(a, half), In(b, half)); };
  if (parameter == 0) return dot(lever_[i][j], a_[j], axes[FrameChoice::kForce]);
  if (parameter <= 3)
    return dot(lever_[i][j], force_[j][parameter - 1], axes[FrameChoice::kForce]) +
           In(AccelerationTimesAxis(i, j, axes[FrameChoice::kMoment]), 2 * j + 1)[parameter - 1];
  if (parameter <= 9)
    return dot(z_[i], moment_[j][parameter - 4], axes[parameter == 9 ? FrameChoice::kSpin : FrameChoice::kInertia]);
  return i == j && motion_ ? graph_.Input({Quantity::kAcceleration, j}) : graph_.Constant(0);
}

ArmVectors::Vector* ArmVectors::AccelerationTimesAxis(int i, int j, int half) {
  Vector*& h = cross_[{i, a_[j], half}];
  if (!h) h = Make("h" + std::to_string(i + 1) + std::to_string(j + 1), half, Cross(In(a_[j], half), In(z_[i], half)));
  return h;
}

}  // namespace armcal::codegen

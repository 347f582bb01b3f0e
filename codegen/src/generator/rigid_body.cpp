// generator - recursive accelerations in link frames and joint screws carried outward.
//
// Body j's wrench in its own frame is linear in its parameters: f = m a + U mc, n = I alpha + w x (I w) + mc x a, with
// U = [alpha]x + [w]x[w]x. Joint i sees tau_i = z_i . n + v_i . f, where (z_i, v_i) is the joint's screw seen from
// frame j (v_i = z_i x r_ij; a prismatic joint has z = 0, v = its axis). Carrying the screw outward instead of ten unit
// wrenches inward takes about a quarter less work.
#include "codegen/src/generator/rigid_body.hpp"

#include <cmath>
#include <numbers>

namespace armcal::codegen {
namespace {

using Vec = std::array<Expr, 3>;

Vec operator+(const Vec& a, const Vec& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Expr Dot(const Vec& a, const Vec& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Vec Cross(const Vec& a, const Vec& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

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

bool Slides(const Robot& robot, int j) {
  return j == robot.joints() - 1 && robot.joint[j].kinematics.type == JointType::kRevolute;
}

struct LinkFrame {
  Expr s, c;      // of theta
  double sa, ca;  // of alpha
  Vec p;          // origin of this frame in the frame before
  // v in the frame before -> this frame: Rz(theta)' Rx(alpha)'
  Vec Outward(const Vec& v) const {
    const Expr y = ca * v[1] + sa * v[2], z = ca * v[2] - sa * v[1];
    return {c * v[0] + s * y, c * y - s * v[0], z};
  }
};

LinkFrame MakeFrame(Graph& g, const Robot& robot, int j) {
  const JointKinematics& k = robot.joint[j].kinematics;
  const bool revolute = k.type == JointType::kRevolute;
  LinkFrame f;
  ExactSinCos(k.alpha_rad, f.sa, f.ca);
  double so, co;
  ExactSinCos(k.theta_rad, so, co);
  const Expr q = g.Input(InputName("q", j));
  if (revolute) {
    const Expr s = g.Unary(Op::kSin, q), c = g.Unary(Op::kCos, q);
    f.s = co * s + so * c;
    f.c = co * c - so * s;
  } else {
    f.s = g.Constant(so);
    f.c = g.Constant(co);
  }
  Expr d = Slides(robot, j) ? g.Constant(0) : g.Constant(k.d_m);
  if (!revolute) d = d + q;
  f.p = {g.Constant(k.a_m), -(f.sa * d), f.ca * d};
  return f;
}

// The six dot products of a screw with the unit wrenches of inertia, first moments and mass.
void Project(const Vec& z, const Vec& v, const Vec& w, const Vec& dw, const Vec& a, const std::array<Vec, 3>& U,
             Expr* row) {
  const Expr xx = w[0] * w[0], yy = w[1] * w[1], zz = w[2] * w[2], xy = w[0] * w[1], xz = w[0] * w[2], yz = w[1] * w[2];
  row[0] = Dot(v, a);
  // f = U e_k; n = e_k x a
  row[1] = v[0] * U[0][0] + v[1] * U[1][0] + v[2] * U[2][0] + (z[2] * a[1] - z[1] * a[2]);
  row[2] = v[0] * U[0][1] + v[1] * U[1][1] + v[2] * U[2][1] + (z[0] * a[2] - z[2] * a[0]);
  row[3] = v[0] * U[0][2] + v[1] * U[1][2] + v[2] * U[2][2] + (z[1] * a[0] - z[0] * a[1]);
  row[4] = z[0] * dw[0] + z[1] * xz - z[2] * xy;
  row[5] = -(z[0] * U[2][0]) + z[1] * U[2][1] + z[2] * (xx - yy);
  row[6] = z[0] * U[1][0] + z[1] * (zz - xx) - z[2] * U[1][2];
  row[7] = z[1] * dw[1] - z[0] * yz + z[2] * xy;
  row[8] = z[0] * (yy - zz) - z[1] * U[0][1] + z[2] * U[0][2];
  row[9] = z[0] * yz - z[1] * xz + z[2] * dw[2];
}

}  // namespace

std::string InputName(const char* quantity, int joint) { return quantity + std::to_string(joint + 1); }

std::vector<std::vector<Expr>> BodyRegressor(Graph& g, const Robot& robot, bool motion) {
  const int n = robot.joints();
  const Expr zero = g.Constant(0), one = g.Constant(1);
  std::vector<std::vector<Expr>> row(n, std::vector<Expr>(kBodyBlock * n, zero));
  const auto& R = robot.base_rotation;
  Vec w{zero, zero, zero}, dw = w, a;
  for (int k = 0; k < 3; ++k) {  // the base accelerates upward instead of gravity pulling down
    double value = 0;
    for (int m = 0; m < 3; ++m) value -= R[3 * m + k] * robot.gravity_mps2[m];
    a[k] = g.Constant(value);
  }
  std::vector<Vec> screw_z(n), screw_v(n);
  std::array<Vec, 3> U{Vec{zero, zero, zero}, Vec{zero, zero, zero}, Vec{zero, zero, zero}};
  for (int j = 0; j < n; ++j) {
    const LinkFrame f = MakeFrame(g, robot, j);
    const bool revolute = robot.joint[j].kinematics.type == JointType::kRevolute;
    const Expr qd = motion ? g.Input(InputName("qd", j)) : zero, qdd = motion ? g.Input(InputName("qdd", j)) : zero;
    Vec at;  // acceleration of the new origin as fixed to the link before
    for (int k = 0; k < 3; ++k) at[k] = a[k] + Dot(U[k], f.p);
    a = f.Outward(at);
    const Vec w_in = f.Outward(w), dw_in = f.Outward(dw);
    w = w_in;
    dw = dw_in;
    if (revolute) {
      w[2] = w_in[2] + qd;
      dw = {dw_in[0] + w_in[1] * qd, dw_in[1] - w_in[0] * qd, dw_in[2] + qdd};
    } else {
      a = a + Vec{2.0 * (w_in[1] * qd), -(2.0 * (w_in[0] * qd)), qdd};
    }
    const Expr xx = w[0] * w[0], yy = w[1] * w[1], zz = w[2] * w[2], xy = w[0] * w[1], xz = w[0] * w[2],
               yz = w[1] * w[2];
    U = {Vec{-(yy + zz), xy - dw[2], xz + dw[1]}, Vec{xy + dw[2], -(xx + zz), yz - dw[0]},
         Vec{xz - dw[1], yz + dw[0], -(xx + yy)}};
    const std::string link = std::to_string(j + 1);
    for (int k = 0; k < 3; ++k) {
      const char axis[] = {"xyz"[k], '\0'};
      g.Name(w[k], "w" + link + axis);
      g.Name(dw[k], "dw" + link + axis);
      g.Name(a[k], "a" + link + axis);
      for (int m = 0; m < 3; ++m) g.Name(U[k][m], "U" + link + axis + "xyz"[m]);
    }
    for (int i = 0; i < j; ++i) {
      const Vec moved = screw_v[i] + Cross(screw_z[i], f.p);
      screw_v[i] = f.Outward(moved);
      screw_z[i] = f.Outward(screw_z[i]);
      for (int k = 0; k < 3; ++k) {
        g.Name(screw_z[i][k], "z" + std::to_string(i + 1) + "_" + link + "xyz"[k]);
        g.Name(screw_v[i][k], "v" + std::to_string(i + 1) + "_" + link + "xyz"[k]);
      }
    }
    screw_z[j] = {zero, zero, revolute ? one : zero};
    screw_v[j] = {zero, zero, revolute ? zero : one};
    for (int i = 0; i <= j; ++i) Project(screw_z[i], screw_v[i], w, dw, a, U, row[i].data() + kBodyBlock * j);
    row[j][kBodyBlock * j + 10] = qdd;
  }
  return row;
}

Eigen::MatrixXd SlideMap(const Robot& robot) {
  const int n = robot.joints();
  Eigen::MatrixXd S = Eigen::MatrixXd::Identity(kBodyBlock * n, kBodyBlock * n);
  for (int j = 0; j < n; ++j) {
    if (!Slides(robot, j)) continue;
    const double d = robot.joint[j].kinematics.d_m;  // the old origin seen from the new one: (0, 0, d)
    const int b = kBodyBlock * j;
    S(b + 3, b + 0) = d;                 // mz
    for (const int diagonal : {4, 7}) {  // Ixx, Iyy
      S(b + diagonal, b + 0) = d * d;
      S(b + diagonal, b + 3) = 2 * d;
    }
    S(b + 6, b + 1) = -d;  // Ixz
    S(b + 8, b + 2) = -d;  // Iyz
  }
  return S;
}

}  // namespace armcal::codegen

// tests - the columns of records without memory against formulas written by hand from the physics.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/unit/codegen/effect_run.hpp"

namespace armcal::tests {
namespace {

// One column at one point. Joints of single-joint records: 2.
double At(const std::string& record, int column, const Values& inputs, const Values& eta = {},
          const std::vector<int>& joints = {1}, int row = 1) {
  Log log;
  for (const auto& [name, value] : inputs) log[name] = {value};
  return EffectRun(record, joints).Column(column, row, log, eta)[0];
}

// Cox and de Boor's recursion: spline i of degree d on unit knots.
double CoxDeBoor(double u, int i, int d) {
  if (d == 0) return u >= i && u < i + 1 ? 1 : 0;
  return (u - i) / d * CoxDeBoor(u, i, d - 1) + (i + d + 1 - u) / d * CoxDeBoor(u, i + 1, d - 1);
}
// The i-th of n clamped cubic splines on [lo, hi]; knots lo - 3h .. hi + 3h.
double Spline(double x, double lo, double hi, int i, int n) {
  const double h = (hi - lo) / (n - 3);
  return CoxDeBoor((std::min(std::max(x, lo), hi) - lo) / h + 3, i, 3);
}

constexpr std::array<double, 6> kSpeeds = {-1.3, -0.02, 0.0, 0.01, 0.4, 2.0};
constexpr std::array<double, 4> kAngles = {-1.1, 0.2, 0.9, 1.3};

// 1e-13 relative to columns of order one: a few roundings of double.
TEST(Effects, SpeedColumns_EqualFormulasWrittenByHand) {
  for (const double v : kSpeeds) {
    const Values at = {{"qd2", v}};
    EXPECT_EQ(At("coulomb_viscous", 0, at), Sign(v));
    EXPECT_EQ(At("coulomb_viscous", 1, at), v);
    EXPECT_EQ(At("coulomb_asymmetry", 0, at), v != 0);
    EXPECT_EQ(At("viscous_asymmetry", 0, at), v > 0 ? v : -v);
    EXPECT_NEAR(At("viscous_quadratic", 0, at), v > 0 ? v * v : -v * v, 1e-13);
    EXPECT_NEAR(At("viscous_cubic", 0, at), v * v * v, 1e-13);
    EXPECT_NEAR(At("viscous_cuberoot", 0, at), Sign(v) * std::pow(std::abs(v), 1.0 / 3), 1e-13);
    EXPECT_NEAR(At("stribeck", 0, at, {{"vs", 0.1}, {"delta", 1.5}}),
                Sign(v) / std::exp(std::pow(std::abs(v) / 0.1, 1.5)), 1e-13);
  }
  EXPECT_EQ(At("torque_offset", 0, {}), 1.0);
  EXPECT_EQ(At("rotor_inertia", 0, {{"qdd2", -3.5}}), -3.5);
}

// Survey, equations (5) and (6), whole laws with all amplitudes in.
TEST(Effects, FrictionLaws_EqualTheSurveysEquations) {
  const double f1 = 60, f2 = 18, f3 = 0.05, f4 = 25, f5 = 4, beta = 50, slope = 90;
  for (const double v : kSpeeds) {
    const Values at = {{"qd2", v}}, five = {{"f3", f3}, {"f5", f5}}, six = {{"f3", f5}, {"f4", slope}};
    const double w = std::abs(v);
    const double law5 =
        v == 0 ? 0
               : f1 * Sign(v) - f2 * Sign(v) * std::exp(-w / f3) - f4 * Sign(v) * std::exp(-1 / (f5 * w)) + beta * v;
    EXPECT_NEAR(f1 * At("friction_exponential", 0, at, five) + f2 * At("friction_exponential", 1, at, five) +
                    f4 * At("friction_exponential", 2, at, five) + beta * At("friction_exponential", 3, at, five),
                law5, 1e-11);
    const double law6 = (f1 + f2 / std::cosh(f5 * v)) * std::tanh(slope * v) + beta * v;
    EXPECT_NEAR(f1 * At("friction_sech_tanh", 0, at, six) + f2 * At("friction_sech_tanh", 1, at, six) +
                    beta * At("friction_sech_tanh", 2, at, six),
                law6, 1e-11);
  }
}

// Where 1/(f5 |v|) exceeds 80 the record stops at exp(-80) = 2e-35: nothing of a torque.
TEST(Effects, ExponentialLaw_NearRest_StaysFinite) {
  for (const double v : {1e-12, 1e-300, 0.0})
    EXPECT_NEAR(At("friction_exponential", 2, {{"qd2", v}}, {{"f5", 4}}), 0, 1e-34);
}

TEST(Effects, StribeckBasis_IsFiveGaussiansOfSpeed) {
  const double q[] = {0.03, 0.055, 0.1, 0.18, 0.33};
  for (const double v : kSpeeds)
    for (int k = 0; k < 5; ++k)
      EXPECT_NEAR(At("stribeck_basis", k, {{"qd2", v}}), Sign(v) * std::exp(-std::pow(v / q[k], 2)), 1e-13);
}

// Splines in log(1 + |v| / v_min), clamped at the speed limit.
TEST(Effects, FrictionTable_IsASplineOfTheLogarithmOfSpeed) {
  const double v_min = Arm().joint[1].v_min_radps, top = std::log(1 + Arm().joint[1].speed_limit_radps / v_min);
  for (const double v : {-1.3, 0.004, 0.03, 0.4, 2.0, 2.8})
    for (int i = 0; i < 8; ++i)
      EXPECT_NEAR(At("friction_table", i, {{"qd2", v}}),
                  Sign(v) * Spline(std::log(1 + std::abs(v) / v_min), 0, top, i, 8), 1e-12);
  double sum = 0;  // beyond the limit the last splines stay: a constant level
  for (int i = 0; i < 8; ++i) sum += At("friction_table", i, {{"qd2", 50.0}});
  EXPECT_NEAR(sum, 1, 1e-12);
}

TEST(Effects, LoadAndTemperatureColumns_EqualFormulasWrittenByHand) {
  for (const double v : kSpeeds) {
    EXPECT_NEAR(At("load_friction", 0, {{"qd2", v}, {"tau_rigid2", -350.0}}), 350 * Sign(v), 1e-12);
    EXPECT_NEAR(At("temp_viscous", 0, {{"qd2", v}, {"temp2", 41.0}}, {{"Tc", 25}}), v * std::exp(-11.0 / 25), 1e-13);
    EXPECT_NEAR(At("temp_coulomb", 0, {{"qd2", v}, {"temp2", 41.0}}), 11 * Sign(v), 1e-13);
  }
  for (const double load : {-70.0, -12.0, 3.0, 95.0})  // the range is narrower: two of them are clamped
    for (const double v : {-0.7, 0.2})
      for (int i = 1; i < 8; ++i) {
        const double s = Spline(load, -50, 60, i, 8);
        EXPECT_NEAR(At("curve_load_viscous", i - 1, {{"qd2", v}, {"tau_rigid2", load}}, {{"lo", -50}, {"hi", 60}}),
                    s * v, 1e-12);
        EXPECT_NEAR(
            At("curve_cross_load", i - 1, {{"qd5", v}, {"tau_rigid3", load}}, {{"lo", -50}, {"hi", 60}}, {4, 2}, 4),
            s * Sign(v), 1e-12);
      }
  // a payload's torque: mass times the unit mass's column plus first moments times theirs
  EXPECT_NEAR(At("load_linear", 0, {{"Y1_5_0", 3.0}, {"Y1_5_1", 0.5}, {"Y1_5_2", -0.7}, {"Y1_5_3", 11.0}},
                 {{"mass", 8}, {"cx", 0.1}, {"cy", 0.02}, {"cz", 0.25}}),
              8 * (3.0 + 0.1 * 0.5 - 0.02 * 0.7 + 0.25 * 11.0), 1e-13);
}

TEST(Effects, PositionColumns_EqualFormulasWrittenByHand) {
  for (const double q : kAngles)
    for (const double v : {-0.4, 0.7}) {
      const Values at = {{"q2", q}, {"qd2", v}};
      EXPECT_NEAR(At("torque_ripple", 0, at, {{"k", 40}}), std::cos(40 * q), 1e-13);
      EXPECT_NEAR(At("torque_ripple", 1, at, {{"k", 40}}), std::sin(40 * q), 1e-13);
      EXPECT_NEAR(At("meshing_friction", 0, at, {{"k", 40}}), std::cos(40 * q) * Sign(v), 1e-13);
      EXPECT_NEAR(At("meshing_friction", 1, at, {{"k", 40}}), std::sin(40 * q) * Sign(v), 1e-13);
      EXPECT_NEAR(At("cable_pack", 0, at, {{"q0", 0.3}}), q - 0.3, 1e-13);
      EXPECT_NEAR(At("cable_pack", 1, at, {{"q0", 0.3}}), std::pow(q - 0.3, 3), 1e-13);
      for (int i = 0; i < 8; ++i) {  // the range is narrower than the angles: two of them are clamped
        const double s = Spline(q, -0.9, 1.2, i, 8);
        EXPECT_NEAR(At("position_torque", i, at, {{"lo", -0.9}, {"hi", 1.2}}), s, 1e-12);
        if (i == 0) continue;
        EXPECT_NEAR(At("position_friction", i - 1, at, {{"lo", -0.9}, {"hi", 1.2}}), s * Sign(v), 1e-12);
        EXPECT_NEAR(At("position_viscous", i - 1, at, {{"lo", -0.9}, {"hi", 1.2}}), s * v, 1e-12);
      }
    }
}

// A spring with rate c and free length l0 between anchor (b, 0) and crank pin a (cos, sin)(q - q0): its energy's slope,
// by a central difference (error h^2 E'''/6 = 2e-7 of the torque).
TEST(Effects, GravitySpring_IsTheSlopeOfASpringsEnergy) {
  const double a = 0.15, b = 0.6, c = 40000, free = 0.3, q0 = 0.4, h = 1e-4;
  const auto energy = [&](double q) {
    const double x = b - a * std::cos(q - q0), y = a * std::sin(q - q0);
    return 0.5 * c * std::pow(std::hypot(x, y) - free, 2);
  };
  for (const double q : kAngles) {
    const Values eta = {{"q0", q0}, {"r", a / b}};
    const double tau = c * a * b * At("gravity_spring", 0, {{"q2", q}}, eta) -
                       c * free * a * At("gravity_spring", 1, {{"q2", q}}, eta);
    EXPECT_NEAR(tau, (energy(q + h) - energy(q - h)) / (2 * h), 1e-6 * c * a * b);
  }
}

TEST(Effects, RunStates_AreSplinesOfTime) {
  for (const double t : {-3.0, 0.0, 2.5, 11.0, 19.9, 30.0})
    for (int i = 1; i <= 6; ++i) {
      const Values eta = {{"t_begin", 0}, {"t_end", 20}}, at = {{"t", t}, {"qd2", -0.8}};
      // clamping at the very end belongs to the last interval
      const double s = Spline(std::min(t, 20 - 1e-12), 0, 20, i, 7);
      EXPECT_NEAR(At("torque_drift", i - 1, at, eta), s, 1e-10);
      EXPECT_NEAR(At("time_varying_coulomb", i - 1, at, eta), -s, 1e-10);
      EXPECT_NEAR(At("time_varying_viscous", i - 1, at, eta), -0.8 * s, 1e-10);
    }
}

// The payload's columns are the last link's own: ten unit bodies, only while the window is open.
TEST(Effects, PayloadStep_IsTheFlangeBodyInsideItsWindow) {
  for (const double t : {1.0, 5.0, 9.0})
    EXPECT_EQ(At("payload_step", 2, {{"t", t}, {"Y4_5_2", 0.37}}, {{"t_on", 3}, {"t_off", 7}}, {}, 4),
              t == 5.0 ? 0.37 : 0.0);
}

TEST(Effects, PairColumns_EqualFormulasWrittenByHand) {
  const std::vector<int> pair = {4, 5};  // j = joint 5, k = joint 6
  for (const double v5 : {-0.7, 0.3})
    for (const double v6 : {-0.2, 1.1}) {
      const Values at = {{"qd5", v5}, {"qd6", v6}, {"q6", 0.9}};
      EXPECT_EQ(At("coupled_friction", 0, at, {}, pair, 4), Sign(v6));
      EXPECT_EQ(At("coupled_friction", 1, at, {}, pair, 4), v6);
      EXPECT_NEAR(At("velocity_product", 0, at, {}, pair, 4), v5 * v6, 1e-15);
      EXPECT_NEAR(At("cross_ripple", 0, at, {{"w", 12}}, pair, 4), std::cos(12 * 0.9), 1e-13);
      EXPECT_NEAR(At("cross_ripple", 1, at, {{"w", 12}}, pair, 4), std::sin(12 * 0.9), 1e-13);
      // the motor's loss, carried to both joints by the transpose of its gearing (-0.6, 1)
      const double motor = -0.6 * v5 + v6, law[] = {motor, Sign(motor)};
      for (int c = 0; c < 2; ++c) {
        EXPECT_NEAR(At("wrist_coupling", c, at, {{"r", -0.6}}, pair, 5), law[c], 1e-14);
        EXPECT_NEAR(At("wrist_coupling", c, at, {{"r", -0.6}}, pair, 4), -0.6 * law[c], 1e-14);
      }
    }
}

TEST(Effects, SensorColumns_AreWhatTheSensorAdds) {
  for (const double tau : {-900.0, -120.0, 30.0, 700.0}) {
    EXPECT_EQ(At("torque_gain_error", 0, {{"tau_model2", tau}}), tau);
    const double read = std::abs(tau) > 500 ? 500 * Sign(tau) : tau;
    EXPECT_EQ(At("torque_saturation", 0, {{"tau_model2", tau}}, {{"limit", 500}}), read - tau);
  }
  for (int row = 0; row < 6; ++row) {  // y(t) = tau(t - d), in every row
    const std::string number = std::to_string(row + 1);
    EXPECT_EQ(
        At("time_delay", 0, {{"tau_model" + number, 7.0}, {"tau_delayed" + number, 4.0 - row}}, {{"d", 0.01}}, {}, row),
        -3.0 - row);
  }
  for (const double t : {0.5, 2.0, 2.5, 3.5, 4.0, 9.0}) {
    const double force = t < 2 || t > 4 ? 0 : std::sin(M_PI * (t - 2) / 2);
    EXPECT_NEAR(At("external_contact", 0, {{"t", t}}, {{"t_on", 2}, {"t_off", 4}}), force, 1e-15);
  }
}

// A force along one axis, held against by J'F.
TEST(Effects, FlangeContact_IsAHalfSineOfForce) {
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(At("flange_contact", axis, {{"t", 2.5}, {"J3_" + std::to_string(axis), 0.8}},
                   {{"t_on", 2}, {"t_off", 4}}, {}, 3),
                -0.8 * std::sin(M_PI / 4), 1e-15);
}

TEST(Effects, SurfaceOverTwoPositions_IsAProductOfSplines) {
  for (const double a : kAngles)
    for (const double b : kAngles)
      for (int i = 0; i < 36; ++i)
        EXPECT_NEAR(At("curve_two_positions", i, {{"q5", a}, {"q6", b}},
                       {{"lo", -1}, {"hi", 1.2}, {"lo_own", -1.3}, {"hi_own", 1.5}}, {4, 5}, 4),
                    Spline(b, -1, 1.2, i / 6, 6) * Spline(a, -1.3, 1.5, i % 6, 6), 1e-13);
}

TEST(Effects, BaseTilt_IsTheTorquePerGravityOfEachRow) {
  for (int row = 0; row < 6; ++row) {
    const std::string g = "G" + std::to_string(row) + "_";
    EXPECT_EQ(At("base_tilt", 0, {{g + "0", 3.0}, {g + "1", 5.0}}, {}, {}, row), 3.0);
    EXPECT_EQ(At("base_tilt", 1, {{g + "0", 3.0}, {g + "1", 5.0}}, {}, {}, row), 5.0);
  }
  EXPECT_EQ(At("base_tilt", 2, {{"q1", 0.4}}, {}, {}, 0), std::cos(0.4));  // the first moments of link 1, in row 1
  EXPECT_EQ(At("base_tilt", 3, {{"q1", 0.4}}, {}, {}, 0), std::sin(0.4));
}

}  // namespace
}  // namespace armcal::tests

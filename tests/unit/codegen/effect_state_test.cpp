// tests - records with memory against fine integration of the same physics; exactness, bounds and settling.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <random>

#include "tests/unit/codegen/effect_run.hpp"

namespace armcal::tests {
namespace {

constexpr double kDt = 0.008;

// Classical Runge-Kutta, n steps: error ~ (rate h)^4, below 1e-10 for the rates and steps used here.
double Integrate(const std::function<double(double)>& slope, double y, double length, int n) {
  const double h = length / n;
  for (int k = 0; k < n; ++k) {
    const double a = slope(y), b = slope(y + h / 2 * a), c = slope(y + h / 2 * b), d = slope(y + h * c);
    y += h / 6 * (a + 2 * b + 2 * c + d);
  }
  return y;
}

// A joint that reverses at several amplitudes, rests, and creeps: q and the speed held between samples.
Log Reversals(int samples = 400) {
  Log log;
  double q = 0.3;
  for (int k = 0; k < samples; ++k) {
    const double v = k % 97 < 9 ? 0 : 0.25 * std::sin(0.07 * k) + 0.04 * std::sin(0.61 * k);
    if (k > 0) q += v * kDt;
    log["q2"].push_back(q);
    log["qd2"].push_back(v);
    log["dt"].push_back(kDt);
    log["tau_gravity2"].push_back(-300 + 40 * std::cos(q));
  }
  return log;
}

// x0 dz/dx = 1 - z sgn(dx), along the path between two samples.
TEST(StatefulEffects, Dahl_EqualsFineIntegration) {
  const double x0 = 2e-3;
  const Log log = Reversals();
  const auto& q = log.at("q2");
  const auto z = EffectRun("presliding_dahl").Column(0, 1, log, {{"x0", x0}});
  double expected = 0;
  for (std::size_t k = 0; k < q.size(); ++k) {
    const double dx = k ? q[k] - q[k - 1] : 0, s = Sign(dx);
    expected = Integrate([&](double y) { return (s - y) / x0; }, expected, std::abs(dx), 200);
    ASSERT_NEAR(z[k], expected, 1e-9) << k;
  }
  EXPECT_EQ(EffectRun("presliding_dahl").Column(1, 1, log), log.at("qd2"));
}

// dz/dt = v - sigma0 |v| / g(v) z in force units, divided by Fc afterwards.
TEST(StatefulEffects, Lugre_EqualsFineIntegration) {
  const double fc = 60, fs = 84, vs = 0.05, sigma0 = 3e4;
  const Log log = Reversals();
  const auto& v = log.at("qd2");
  const auto z = EffectRun("presliding_lugre").Column(0, 1, log, {{"x0", fc / sigma0}, {"b", fs / fc - 1}, {"vs", vs}});
  double bristle = 0;  // m
  for (std::size_t k = 0; k < v.size(); ++k) {
    const double g = fc + (fs - fc) * std::exp(-std::pow(v[k] / vs, 2));
    bristle = Integrate([&](double y) { return v[k] - sigma0 * std::abs(v[k]) / g * y; }, bristle, kDt, 200);
    ASSERT_NEAR(z[k], sigma0 * bristle / fc, 1e-9) << k;
  }
}

// Push the ring with the pin in 1000 small moves between samples.
TEST(StatefulEffects, Backlash_EqualsAPinInARing) {
  const double gap = 4e-3;
  const Log log = Reversals();
  const auto& q = log.at("q2");
  EffectRun run("backlash");
  const auto inside = run.Column(0, 1, log, {{"gap", gap}}), load = run.Column(1, 1, log, {{"gap", gap}});
  double ring = q[0];
  for (std::size_t k = 0; k < q.size(); ++k) {
    for (int i = 1; k > 0 && i <= 1000; ++i) {
      const double pin = q[k - 1] + (q[k] - q[k - 1]) * i / 1000;
      if (pin > ring + gap / 2) ring = pin - gap / 2;
      if (pin < ring - gap / 2) ring = pin + gap / 2;
    }
    const double offset = q[k] - ring, share = 1 - std::pow(offset / (gap / 2), 2);
    ASSERT_NEAR(inside[k], offset, 1e-14) << k;
    ASSERT_NEAR(load[k], -log.at("tau_gravity2")[k] * share, 1e-8) << k;
  }
}

// A cell is a spring between the joint and a block that slips where the spring is at its length: four of them.
TEST(StatefulEffects, HysteresisLoops_EqualSpringsAndBlocksThatSlip) {
  const double shortest = 5e-4;
  const Log log = Reversals();
  const auto& q = log.at("q2");
  EffectRun run("hysteresis_loops");
  for (int cell = 0; cell < 4; ++cell) {
    const double length = shortest * std::pow(4, cell);
    const auto column = run.Column(cell, 1, log, {{"L", shortest}});
    double block = q[0];
    for (std::size_t k = 0; k < q.size(); ++k) {
      for (int i = 1; k > 0 && i <= 1000; ++i) {
        const double joint = q[k - 1] + (q[k] - q[k - 1]) * i / 1000;
        if (std::abs(joint - block) > length) block = joint - std::copysign(length, joint - block);
      }
      ASSERT_NEAR(column[k], (q[k] - block) / length - Sign(log.at("qd2")[k]), 1e-9) << cell << " " << k;
    }
  }
}

// The link between two stops that move with its motor: its load pushes it, and it stays where it lands. In flight it
// carries nothing; where it stands changes the torque by the slope. The load is straight between samples.
TEST(StatefulEffects, BacklashUnderLoad_EqualsFineIntegration) {
  const double gap = 4e-3, mass = 3.7, slope = 300;
  for (const double dt : {0.001, 0.004}) {
    Log log;
    const int samples = static_cast<int>(4 / dt);
    for (int k = 0; k < samples; ++k) {
      log["dt"].push_back(dt);
      log["tau_rigid2"].push_back(12 * std::sin(7 * k * dt + 0.4) + 2 * std::sin(23 * k * dt) - 3);
      for (int r = 0; r < 6; ++r) {
        log["M" + std::to_string(r) + "_1"].push_back(mass + r);
        log["T" + std::to_string(r) + "_1"].push_back(slope);
      }
    }
    const auto& load = log.at("tau_rigid2");
    EffectRun run("backlash_load");
    ASSERT_EQ(run.instance().columns[0].rows.size(), 6u);
    std::vector<double> stands(load.size()), flies(load.size());
    double place = -std::copysign(gap / 2, load[0]), rate = 0;  // the load pushes the link back
    for (std::size_t k = 1; k < load.size(); ++k) {
      constexpr int kSteps = 2000;
      for (int i = 0; i < kSteps; ++i) {  // speed first, then place
        rate -= dt / kSteps * (load[k - 1] + (load[k] - load[k - 1]) * (i + 0.5) / kSteps) / (mass + 1);
        place += dt / kSteps * rate;
        if (std::abs(place) >= gap / 2) place = std::copysign(gap / 2, place), rate = 0;
      }
      stands[k] = place, flies[k] = std::abs(place) < gap / 2;
    }
    for (const int row : {0, 1, 5}) {
      const auto column = run.Column(0, row, log, {{"gap", gap}});
      double error = 0, all = 0;
      for (std::size_t k = load.size() / 4; k < load.size(); ++k) {
        const double missing = -(mass + row) / (mass + 1) * load[k] * flies[k] + slope * stands[k];
        error += std::pow(column[k] - missing, 2), all += missing * missing;
      }
      EXPECT_LT(std::sqrt(error / all), 0.1) << "row " << row << ", dt " << dt;  // it lands at the end of a sample
    }
  }
}

// The link hangs on the motor by a spring and a damper: a_link'' = w0^2 (a_motor - a_link) + 2 zeta w0 (a_motor' -
// a_link'), in every row times M; a_motor straight between samples.
TEST(StatefulEffects, BeltElasticity_EqualsATwoMassSimulation) {
  const double w0 = 150, zeta = 0.3, mass = 3.7;
  Log log;
  for (int k = 0; k < 300; ++k) {
    log["dt"].push_back(kDt);
    log["qdd2"].push_back(k < 10 ? 0 : 5 * std::sin(0.3 * k) + (k > 150));
    for (int r = 0; r < 6; ++r) log["M" + std::to_string(r) + "_1"].push_back(mass + r);
  }
  EffectRun run("belt_elasticity");
  ASSERT_EQ(run.instance().columns[0].rows.size(), 6u);
  EXPECT_TRUE(run.instance().columns[0].fixed_amplitude);
  EXPECT_EQ(run.instance().columns[0].amplitude, 1);
  for (const int row : {0, 1, 5}) {
    const auto column = run.Column(0, row, log, {{"w0", w0}});
    double y = 0, rate = 0;
    for (int k = 0; k < 300; ++k) {
      const double x = log["qdd2"][k], from = log["qdd2"][k ? k - 1 : 0], slope = (x - from) / kDt, h = kDt / 400;
      for (int i = 0; i < 400; ++i) {  // Runge-Kutta for the pair (y, rate)
        const auto f = [&](double t, double a, double b) {
          return w0 * w0 * (from + slope * t - a) + 2 * zeta * w0 * (slope - b);
        };
        const double t = i * h, y1 = rate, r1 = f(t, y, rate);
        const double y2 = rate + h / 2 * r1, r2 = f(t + h / 2, y + h / 2 * y1, y2);
        const double y3 = rate + h / 2 * r2, r3 = f(t + h / 2, y + h / 2 * y2, y3);
        const double y4 = rate + h * r3, r4 = f(t + h, y + h * y3, y4);
        y += h / 6 * (y1 + 2 * y2 + 2 * y3 + y4);
        rate += h / 6 * (r1 + 2 * r2 + 2 * r3 + r4);
      }
      ASSERT_NEAR(column[k], (mass + row) * (y - x), 1e-7) << k;
    }
  }
}

// Samples twice as often, between those before, end in the same state.
TEST(StatefulEffects, TwoHalfSteps_EqualOneWhole) {
  const Log log = Reversals();
  Log twice;
  for (std::size_t k = 0; k < log.at("q2").size(); ++k)
    for (const double share : {0.5, 1.0}) {
      const double before = k ? log.at("q2")[k - 1] : log.at("q2")[0];
      twice["q2"].push_back(before + share * (log.at("q2")[k] - before));
      twice["qd2"].push_back(log.at("qd2")[k]);
      const double signal = log.at("qd2")[k], earlier = k ? log.at("qd2")[k - 1] : signal;
      twice["qdd2"].push_back(earlier + share * (signal - earlier));  // any signal
      twice["dt"].push_back(kDt / 2);
      twice["M1_1"].push_back(1);
      twice["tau_gravity2"].push_back(0);
    }
  Log once = log;
  once["qdd2"] = log.at("qd2");
  once["M1_1"].assign(log.at("q2").size(), 1);
  for (const std::string record :
       {"presliding_dahl", "presliding_lugre", "backlash", "belt_elasticity", "hysteresis_loops"}) {
    EffectRun run(record);
    const auto whole = run.Column(0, 1, once), half = run.Column(0, 1, twice);
    for (std::size_t k = 0; k < whole.size(); ++k) ASSERT_NEAR(half[2 * k + 1], whole[k], 1e-12) << record << " " << k;
  }
}

// Whatever the step, from 10 us to 10 s, and however wild the input. What hangs on a spring is bounded by
// the integral of its impulse response's envelope, 1 / (zeta sqrt(1 - zeta^2)) = 3.5 for zeta = 0.3.
TEST(StatefulEffects, AnyStep_StaysWithinItsBound) {
  constexpr double kRounding = 1e-15;  // two roundings of a position of 3 rad
  std::mt19937 random(7);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const double dt : {1e-5, 1e-3, 0.008, 0.3, 10.0}) {
    Log log;
    for (int k = 0; k < 5000; ++k) {
      log["q2"].push_back(3 * unit(random));
      log["qd2"].push_back(3 * unit(random));
      log["qdd2"].push_back(k % 2 ? unit(random) : Sign(unit(random)));
      log["dt"].push_back(dt);
      log["M1_1"].push_back(1);
      log["tau_gravity2"].push_back(1);
      log["tau_rigid2"].push_back(k % 2 ? unit(random) : Sign(unit(random)));
      log["T1_1"].push_back(0);
      log["V1_1"].push_back(0);
    }
    const auto bounded = [&](const std::string& record, int column, double bound, const Values& eta) {
      for (const double v : EffectRun(record).Column(column, 1, log, eta)) {
        ASSERT_TRUE(std::isfinite(v)) << record;
        ASSERT_LE(std::abs(v), bound * (1 + 1e-12) + kRounding) << record << ", dt " << dt;
      }
    };
    for (const double x0 : {1e-5, 1e-1}) {
      bounded("presliding_dahl", 0, 1, {{"x0", x0}});
      bounded("presliding_lugre", 0, 1.8, {{"x0", x0}, {"b", 0.8}, {"vs", 0.1}});
      bounded("backlash", 0, x0 / 2, {{"gap", x0}});
      bounded("backlash", 1, 1, {{"gap", x0}});
      bounded("backlash_load", 0, 1, {{"gap", std::min(x0, 5e-2)}});
    }
    for (const double w0 : {60.0, 600.0}) {
      bounded("belt_elasticity", 0, 3.5 + 1, {{"w0", w0}});
      bounded("belt_load", 0, w0 * w0 * (3.5 + 1), {{"k", w0 * w0}});
    }
  }
}

// Until a record says that it has settled its rows are not used; after that the unknown start is below 1 %.
TEST(StatefulEffects, Settled_OnceTheStartIsForgotten_AndStays) {
  const Log log = Reversals();
  const auto& q = log.at("q2");
  const auto latched = [&](const std::string& record, const Values& eta) {
    EffectRun run(record);
    EXPECT_EQ(run.instance().settled.size(), 1u) << record;
    std::vector<double> out;
    for (const auto& s : run.Run<double>({run.instance().settled[0]}, log, eta)) out.push_back(s[0]);
    return out;
  };
  const double x0 = 5e-3, gap = 0.02, vs = 0.05, b = 0.4;
  const auto dahl = latched("presliding_dahl", {{"x0", x0}}), lost = latched("backlash", {{"gap", gap}});
  const auto lugre = latched("presliding_lugre", {{"x0", x0}, {"b", b}, {"vs", vs}});
  double path = 0, low = q[0], high = q[0], slip = 0;
  bool was_dahl = false, was_lost = false, was_lugre = false;
  for (std::size_t k = 0; k < q.size(); ++k) {
    if (k) path += std::abs(q[k] - q[k - 1]) / x0;
    const double v = log.at("qd2")[k];
    slip += std::abs(v) * kDt / x0 / (1 + b * std::exp(-v * v / (vs * vs)));
    low = std::min(low, q[k]), high = std::max(high, q[k]);
    was_dahl |= std::exp(-path) < 0.01;
    was_lost |= high - low > gap;
    was_lugre |= std::exp(-slip) < 0.01;
    ASSERT_EQ(dahl[k] > 0.5, was_dahl) << k;
    ASSERT_EQ(lost[k] > 0.5, was_lost) << k;
    ASSERT_EQ(lugre[k] > 0.5, was_lugre) << k;
  }
  EXPECT_TRUE(was_dahl && was_lost && was_lugre);
}

}  // namespace
}  // namespace armcal::tests

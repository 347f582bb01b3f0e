// tests - derivatives with respect to nonlinear parameters, along whole runs, against complex steps of the same run;
// and differentiation on the graph against functions written in C++.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "codegen/src/generator/expression.hpp"
#include "tests/unit/codegen/complex_step.hpp"
#include "tests/unit/codegen/effect_run.hpp"

namespace armcal::tests {
namespace {

// Smooth random motion of every graph input that a record may read; the same for every call.
Log Motion(const codegen::Graph& graph, int samples) {
  Log log;
  std::mt19937 random(3);
  std::uniform_real_distribution<double> unit(-1, 1);
  for (const codegen::InputId& input : graph.inputs()) {
    const std::string name = TestName(input);
    if (name.find('.') != std::string::npos || name.find(' ') != std::string::npos) continue;  // parameters
    const double a = unit(random), w = 0.05 + 0.1 * std::abs(unit(random)), phase = unit(random);
    for (int k = 0; k < samples; ++k)
      log[name].push_back(name == "t" ? 0.3 * k + 0.1 : name == "dt" ? 0.008 : (1 + a) * std::sin(w * k + phase));
  }
  for (const auto& s : graph.states()) log.erase(s.name);
  return log;
}

// 1e-11 of the largest derivative seen: complex step has no truncation; both are sums of some hundred roundings. The
// columns are of order one, so a smaller slope carries the roundings of larger numbers.
TEST(Gradients, AlongARun_EqualComplexSteps_ForEveryRecord) {
  constexpr double kLeast = 1e-3;
  int compared = 0;
  for (const auto& [name, record] : Records()) {
    EffectRun run(name, JointsFor(record));
    std::vector<codegen::Expr> columns, slopes;
    for (const auto& c : run.instance().columns)
      for (const auto& [row, e] : c.rows) columns.push_back(e);
    for (const auto& u : run.instance().unknowns) {
      slopes.clear();
      const codegen::Expr parameter = run.graph().Symbol(u.name);
      for (const codegen::Expr& e : columns) slopes.push_back(codegen::TotalDerivative(e, parameter));
      const Log log = Motion(run.graph(), 150);
      const auto along = run.Run<double>(slopes, log, {});
      const auto stepped = run.Run<Complex>(columns, log, {}, u.key);
      for (std::size_t c = 0; c < columns.size(); ++c) {
        double largest = kLeast;
        for (const auto& at : stepped) largest = std::max(largest, std::abs(Slope(at[c])));
        for (std::size_t k = 0; k < along.size(); ++k)
          ASSERT_NEAR(along[k][c], Slope(stepped[k][c]), 1e-11 * largest) << u.name << ", column " << c << ", " << k;
        compared += largest > kLeast;
      }
    }
  }
  EXPECT_GE(compared, 40);
}

struct Case {
  const char* text;
  std::function<Complex(Complex x, Complex p)> formula;
};

const Case kCases[] = {
    {"x*p + p/x - x^2*p^3", [](auto x, auto p) { return x * p + p / x - x * x * p * p * p; }},
    {"-x^2 + 2*-p", [](auto x, auto p) { return -(x * x) - p - p; }},
    {"x - p - 3 - x*p*2", [](auto x, auto p) { return ((x - p) - 3.0) - (x * p) * 2.0; }},
    {"12/p/3", [](auto, auto p) { return 4.0 / p; }},
    {"p^2^0.5", [](auto, auto p) { return pow(p, Complex(std::sqrt(2.0))); }},
    {"sin(p*x)*cos(p) + exp(-p*p)", [](auto x, auto p) { return sin(p * x) * cos(p) + exp(-(p * p)); }},
    {"log(1 + p*p) - sqrt(2 + p)", [](auto, auto p) { return log(1.0 + p * p) - sqrt(2.0 + p); }},
    {"tanh(p*x) + sech(3*p)", [](auto x, auto p) { return tanh(p * x) + 2.0 / (exp(3.0 * p) + exp(-3.0 * p)); }},
    {"cbrt(x*p) + abs(x*p)", [](auto x, auto p) { return cbrt(x * p) + abs(x * p); }},
    {"pow(abs(x)/p, p)", [](auto x, auto p) { return exp(p * log(abs(x) / p)); }},
    {"min(p, x*x) + max(p*p, x)", [](auto x, auto p) { return (p < x * x ? p : x * x) + (p * p > x ? p * p : x); }},
    {"clamp(x*p, -0.5, 0.7)",
     [](auto x, auto p) { return x * p < -0.5  ? Complex(-0.5)
                                 : x * p > 0.7 ? Complex(0.7)
                                               : x * p; }},
    {"sign(x)*p + step(x - 0.1)*p*p",
     [](auto x, auto p) { return (x > 0.0 ? p : -p) + (x > 0.1 ? p * p : Complex(0)); }},
    {"bspline(x, 0, p, 3, 4)",
     [](auto x, auto p) {  // the last of four splines on one interval: u^3/6
       const Complex u = x < 0.0 ? Complex(0) : x > p ? Complex(1) : x / p;
       return u * u * u / 6.0;
     }},
};

TEST(Derivative, OfEveryFunction_EqualsAComplexStepOfItsFormula) {
  for (const Case& c : kCases) {
    codegen::Graph g;
    const codegen::Scope scope{[&](const std::string& name, const std::vector<std::string>&, codegen::Expr& value) {
                                 return value = g.Symbol(name), name == "x" || name == "p";
                               },
                               [&](codegen::Expr e) { return g.Unary(codegen::Op::kSign, e); }};
    g.Symbol("x"), g.Symbol("p");
    const codegen::Expr e = codegen::ParseExpression(g, c.text, scope, "test");
    const codegen::Tape tape(g, {e, codegen::Derivative(e, g.Symbol("p"))});
    for (const double x : {-1.7, -0.4, 0.3, 0.62, 2.1})
      for (const double p : {0.45, 0.9, 1.6}) {
        const auto got = tape.EvaluateAt<double>(std::vector<double>{x, p});
        const Complex expected = c.formula(Complex(x), Complex(p, kComplexStep));
        EXPECT_NEAR(got[0], expected.z.real(), 1e-13 * (1 + std::abs(got[0]))) << c.text << " at " << x << ", " << p;
        EXPECT_NEAR(got[1], Slope(expected), 1e-12 * (1 + std::abs(got[1]))) << c.text << " at " << x << ", " << p;
      }
  }
}

}  // namespace
}  // namespace armcal::tests

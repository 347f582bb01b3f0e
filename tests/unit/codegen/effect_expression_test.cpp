// tests - the expression language: where a wrong text is wrong, and the functions with memory.
#include <gtest/gtest.h>

#include <cmath>

#include "codegen/src/generator/expression.hpp"
#include "codegen/src/generator/state_path.hpp"
#include "codegen/src/io/input_error.hpp"

namespace armcal::tests {
namespace {

using codegen::Binding;
using codegen::Expr;
using codegen::Graph;

// Names x, p, dt and the vector v[1..3].
Expr Parse(Graph& g, const std::string& text) {
  const codegen::Scope scope{[&](const std::string& name, const std::vector<std::string>& index, Expr& value) {
                               if (index.size() == 1 && name == "v" && (index[0] == "1" || index[0] == "2"))
                                 return value = g.Symbol("v" + index[0]), true;
                               if (!index.empty() || (name != "x" && name != "p" && name != "dt")) return false;
                               return value = name == "dt" ? g.Input({codegen::Quantity::kTimeStep}) : g.Symbol(name),
                                      true;
                             },
                             [&](Expr e) { return g.Unary(codegen::Op::kTanh, 100.0 * e); }};
  return codegen::ParseExpression(g, text, scope, "record.toml: rows.j of a");
}

struct Wrong {
  const char* text;
  int column;  // 1-based: where reading stops
  const char* expected;
};

const Wrong kWrong[] = {
    {"", 1, "a number, a name or '('"},
    {"   ", 4, "a number, a name or '('"},
    {"x +", 4, "a number, a name or '('"},
    {"* x", 1, "a number, a name or '('"},
    {"x ** p", 4, "a number, a name or '('"},
    {"(x + p", 7, "')'"},
    {"x + p)", 6, "an operator or the end"},
    {"x p", 3, "an operator or the end"},
    {"2x", 2, "an operator or the end"},
    {"x + y", 5, "a known name instead of 'y'"},
    {"x*frequency", 3, "a known name instead of 'frequency'"},
    {"v[3] + x", 1, "a known name instead of 'v'"},
    {"v[1", 4, "']'"},
    {"v[]", 3, "a name"},
    {"x[1]", 1, "a known name instead of 'x'"},
    {"sine(x)", 1, "a known function instead of 'sine'"},
    {"x + sin(x, p)", 5, "1 argument(s) to sin"},
    {"pow(x)", 1, "2 argument(s) to pow"},
    {"x + clamp(x, 1)", 5, "3 argument(s) to clamp"},
    {"sin()", 1, "1 argument(s) to sin"},
    {"min(x, p", 9, "')'"},
    {"sin(x + )", 9, "a number, a name or '('"},
    {"1.5.2", 4, "an operator or the end"},
    {".", 1, "a number"},
    {"x $ p", 3, "an operator or the end"},
    {"x^", 3, "a number, a name or '('"},
    {"bspline(x, 0, 1, p, 8)", 23, "a constant index and count in bspline"},
    {"lowpass(x)", 1, "2 argument(s) to lowpass"},
    {"delay(x, p, 2.5)", 17, "a whole number of samples, 1 to 64, in delay"},
    {"delay(x, p, dt)", 16, "a whole number of samples, 1 to 64, in delay"},
};

TEST(Expression, WrongText_IsRefusedWithItsColumn) {
  for (const Wrong& w : kWrong) {
    Graph g;
    try {
      Parse(g, w.text);
      ADD_FAILURE() << "accepted: " << w.text;
    } catch (const io::InputError& e) {
      EXPECT_EQ(std::string(e.what()), std::string("record.toml: rows.j of a: \"") + w.text + "\", column " +
                                           std::to_string(w.column) + ": expected " + w.expected);
    }
  }
}

double At(const std::string& text, double x, double p) {
  Graph g;
  g.Symbol("x"), g.Symbol("p");
  return codegen::Tape(g, {Parse(g, text)}).EvaluateAt<double>(std::vector<double>{x, p})[0];
}

TEST(Expression, Division_ByZeroGivesZero) {
  EXPECT_EQ(At("p/x", 0, 3), 0);
  EXPECT_EQ(At("p/(x - x)", 2, 3), 0);
  EXPECT_EQ(At("x/p", 3, 0), 0);
  EXPECT_EQ(At("1/0", 0, 0), 0);
}

TEST(Expression, Sign_IsThePlainOne_AndSgnTheCallers) {
  for (const double x : {-2.0, -1e-9, 0.0, 1e-9, 0.3}) {
    EXPECT_EQ(At("sign(x)", x, 0), (x > 0) - (x < 0));
    EXPECT_EQ(At("sgn(x)", x, 0), std::tanh(100 * x));
  }
}

// A graph run over a log: values of one expression.
std::vector<double> RunOver(const std::string& text, const std::vector<double>& x, double p, double dt,
                            int restart_at = 0) {
  Graph g;
  g.Symbol("x"), g.Symbol("p"), g.Input({codegen::Quantity::kTimeStep});
  const Expr e = Parse(g, text);
  const int samples = static_cast<int>(x.size());
  std::vector<Binding> bindings(g.inputs().size());
  bindings[0].column = x.data(), bindings[1].value = p, bindings[2].value = dt;
  std::vector<char> restart(x.size(), 0);
  restart[static_cast<std::size_t>(restart_at)] = 1;
  const auto path = codegen::StatePath(g, g.states().size(), bindings, samples, restart);
  for (std::size_t s = 0; s < g.states().size(); ++s)
    bindings[g.nodes()[g.states()[s].value.id()].a].column = path.col(static_cast<Eigen::Index>(s)).data();
  std::vector<double> out(x.size());
  double* target = out.data();
  codegen::Tape(g, {e}).Evaluate(bindings, samples, {&target, 1});
  return out;
}

const std::vector<double> kSignal = {0.4, 0.4, 1.0, -0.2, -0.9, -0.9, -0.9, 0.3, 2.0, 2.0, 2.0, 1.5, 1.4, -3.0, -3.0};

TEST(Memory, Previous_IsTheSampleBefore_AtTheFirstItself) {
  const auto y = RunOver("previous(x)", kSignal, 0, 0.01);
  EXPECT_EQ(y[0], kSignal[0]);
  for (std::size_t k = 1; k < y.size(); ++k) EXPECT_EQ(y[k], kSignal[k - 1]);
  const auto twice = RunOver("previous(previous(x)*p)", kSignal, 2, 0.01);
  for (std::size_t k = 2; k < y.size(); ++k) EXPECT_EQ(twice[k], 2 * kSignal[k - 2]);
}

TEST(Memory, States_AreThoseThatAnExpressionHangsOn_OthersAreNotRun) {
  Graph g;
  g.Symbol("x"), g.Symbol("p"), g.Input({codegen::Quantity::kTimeStep});
  const Expr slow = Parse(g, "lowpass(previous(x), p)");
  const std::size_t own = g.states().size();
  const Expr other = Parse(g, "previous(x*x)");
  ASSERT_EQ(own, 2u);
  ASSERT_EQ(g.states().size(), 3u);
  EXPECT_EQ(codegen::StatesOf(g, {slow}), (std::vector<char>{1, 1, 0}));
  EXPECT_EQ(codegen::StatesOf(g, {other}), (std::vector<char>{0, 0, 1}));
  EXPECT_EQ(codegen::StatesOf(g, {g.Symbol("x")}), (std::vector<char>{0, 0, 0}));
  std::vector<Binding> bindings(g.inputs().size());
  bindings[0].column = kSignal.data(), bindings[1].value = 0.02, bindings[2].value = 0.01;
  const std::vector<char> restart(kSignal.size(), 0);
  const int samples = static_cast<int>(kSignal.size());
  const auto all = codegen::StatePath(g, 3, bindings, samples, restart);
  const auto some = codegen::StatePath(g, 3, bindings, samples, restart, {1, 1, 0});
  EXPECT_EQ(some.leftCols(2), all.leftCols(2));
  EXPECT_EQ(some.col(2).norm(), 0);
  for (int k = 1; k < samples; ++k) EXPECT_EQ(all(k, 2), kSignal[k - 1] * kSignal[k - 1]);
}

TEST(Memory, LongRun_IsTheRecursionByHand_AndStartsAnewWhereItIsBroken) {
  std::vector<double> x(203);
  for (std::size_t k = 0; k < x.size(); ++k) x[k] = std::sin(0.3 * static_cast<double>(k));
  const auto y = RunOver("lowpass(x, p) + x*previous(x)", x, 0.02, 0.01, 150);
  double slow = x[0];
  for (std::size_t k = 0; k < x.size(); ++k) {
    const bool starts = k == 0 || k == 150;
    slow = starts ? x[k] : slow;
    slow = x[k] + (slow - x[k]) * std::exp(-0.01 / 0.02);
    EXPECT_NEAR(y[k], slow + x[k] * x[starts ? k : k - 1], 1e-12) << k;
  }
}

TEST(Memory, StepsThatOnlyRoundingTellsApart_AreOneStep) {
  Eigen::VectorXd t(300);
  for (int k = 0; k < 300; ++k) t[k] = std::round(k / 0.0003) * 1e-6 + (k < 200 ? 0 : 0.5);  // 300 Hz in microseconds
  std::vector<char> restart;
  const Eigen::VectorXd dt = codegen::SampleSteps(t, 300, 0, restart);
  EXPECT_NEAR(codegen::BindSteps(dt).value, 1 / 300.0, 1e-6);
  EXPECT_EQ(codegen::BindSteps(dt).column, nullptr);
  for (int k = 0; k < 300; ++k) EXPECT_EQ(restart[k], k == 200) << k;
  t[100] += 1e-4;
  EXPECT_EQ(codegen::BindSteps(codegen::SampleSteps(t, 300, 0, restart)).column != nullptr, true);
}

// RC circuit: y = x + (y0 - x) 2^(-dt / half-life).
TEST(Memory, Lowpass_HalvesTheDistanceEveryHalfLife) {
  const double half_life = 0.02;
  for (const double dt : {1e-5, 0.01, 0.02, 10.0}) {
    const auto y = RunOver("lowpass(x, p)", kSignal, half_life / std::log(2.0), dt);
    double expected = kSignal[0];
    for (std::size_t k = 0; k < y.size(); ++k) {
      expected = kSignal[k] + (expected - kSignal[k]) * std::exp2(-dt / half_life);
      EXPECT_NEAR(y[k], expected, 1e-13);
    }
  }
}

// A mass on a spring with p as its frequency, at rest when the other end starts to move steadily: v t - v / w sin(w t).
TEST(Memory, Spring_WithoutDamping_KeepsSwingingAboutWhatItFollows) {
  const double v = 0.7, w = 30, dt = 0.01;
  std::vector<double> x;
  for (int k = 0; k < 200; ++k) x.push_back(v * dt * k);
  const auto ahead = RunOver("spring_stretch(x, p, 0)", x, w, dt);
  for (std::size_t k = 0; k < ahead.size(); ++k)
    EXPECT_NEAR(ahead[k], -v / w * std::sin(w * dt * static_cast<double>(k)), 1e-11);
  const auto rate = RunOver("spring_rate(x, p, 0)", x, w, dt);
  for (std::size_t k = 0; k < rate.size(); ++k)
    EXPECT_NEAR(rate[k], v - v * std::cos(w * dt * static_cast<double>(k)), 1e-10);
}

TEST(Memory, Play_FollowsOnceTheGapIsCrossed) {
  const auto z = RunOver("play(x, p)", kSignal, 1.0, 0.01);
  double ring = kSignal[0];
  for (std::size_t k = 0; k < z.size(); ++k) {
    if (kSignal[k] - ring > 0.5) ring = kSignal[k] - 0.5;
    if (kSignal[k] - ring < -0.5) ring = kSignal[k] + 0.5;
    EXPECT_EQ(z[k], ring);
  }
}

// Linear between samples; before the log's first sample the signal stood still; at most n samples.
TEST(Memory, Delay_LooksBackAlongTheSamples) {
  const double dt = 0.01;
  for (const double d : {-0.01, 0.0, 0.004, 0.01, 0.0275, 0.03, 0.5}) {
    const auto y = RunOver("delay(x, p, 3)", kSignal, d, dt);
    for (int k = 0; k < static_cast<int>(y.size()); ++k) {
      const double back = std::min(std::max(d / dt, 0.0), 3.0), at = std::max(0.0, k - back);
      const int i = static_cast<int>(std::floor(at)), next = std::min(i + 1, k);
      EXPECT_NEAR(y[k], kSignal[i] + (at - i) * (kSignal[next] - kSignal[i]), 1e-14) << d << " " << k;
    }
  }
}

}  // namespace
}  // namespace armcal::tests

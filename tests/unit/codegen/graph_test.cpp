// tests - the expression graph: normal form, evaluation, the parser's values and its errors.
#include <gtest/gtest.h>

#include <cmath>

#include "codegen/src/generator/expression.hpp"
#include "codegen/src/generator/tape.hpp"
#include "codegen/src/io/input_error.hpp"

namespace armcal::tests {
namespace {

using codegen::Expr;
using codegen::Graph;
using codegen::Op;

TEST(Graph, EqualExpressions_AreOneNode) {
  Graph g;
  const Expr a = g.Symbol("a"), b = g.Symbol("b");
  EXPECT_EQ((a * b + a).id(), (a + b * a).id());
  EXPECT_EQ((-(a - b)).id(), (b - a).id());
  EXPECT_EQ(((-a) * (-b)).id(), (a * b).id());
  EXPECT_TRUE((a - a).IsZero());
  EXPECT_TRUE((a * g.Constant(0)).IsZero());
  EXPECT_EQ((a * g.Constant(1)).id(), a.id());
}

double Value(const std::string& text, double x, double y = 0) {
  Graph g;
  const codegen::Scope scope{[&](const std::string& name, const std::vector<std::string>& indices, Expr& e) {
                               if (!indices.empty() || (name != "x" && name != "y")) return false;
                               return e = g.Symbol(name), true;
                             },
                             [&](Expr e) { return g.Unary(Op::kSign, e); }};
  const Expr e = codegen::ParseExpression(g, text, scope, "test");
  const codegen::Tape tape(g, {e});
  std::vector<double> inputs;
  for (const auto& input : g.inputs()) inputs.push_back(input.symbol == "x" ? x : y);
  return tape.EvaluateAt<double>(inputs)[0];
}

TEST(Expression, Values_EqualTheSameFormulaInCpp) {
  for (const double x : {-1.7, -0.3, 0.0, 0.4, 2.2}) {
    const double y = 0.7;
    EXPECT_DOUBLE_EQ(Value("x*x - 2*x/y + 1", x, y), x * x - 2 * x / y + 1);
    EXPECT_DOUBLE_EQ(Value("-x^3", x), -(x * x * x));
    EXPECT_DOUBLE_EQ(Value("exp(-pow(abs(x)/y, 1.5))*sgn(x)", x, y),
                     std::exp(-std::pow(std::abs(x) / y, 1.5)) * ((x > 0) - (x < 0)));
    EXPECT_DOUBLE_EQ(Value("tanh(x) + cbrt(x) + cos(3*x) - sin(-x)", x),
                     std::tanh(x) + std::cbrt(x) + std::cos(3 * x) - std::sin(-x));
    EXPECT_DOUBLE_EQ(Value("clamp(x, -1, 1)", x), std::min(std::max(x, -1.0), 1.0));
    EXPECT_NEAR(Value("sech(x)", x), 1 / std::cosh(x), 1e-15);
  }
  EXPECT_EQ(Value("1/x", 0.0), 0.0);  // total: no infinity
  EXPECT_EQ(Value("step(x)", 2.0), 1.0);
  EXPECT_EQ(Value("step(x)", -2.0), 0.0);
}

TEST(Expression, Bsplines_SumToOneInsideTheRangeAndAreClampedOutside) {
  for (const double x : {-0.9, 0.0, 0.33, 1.0, 1.99}) {
    double sum = 0;
    for (int i = 0; i < 8; ++i) sum += Value("bspline(x, -1, 2, " + std::to_string(i) + ", 8)", x);
    EXPECT_NEAR(sum, 1, 1e-12) << x;
  }
  EXPECT_DOUBLE_EQ(Value("bspline(x, -1, 2, 7, 8)", 50), Value("bspline(x, -1, 2, 7, 8)", 2));
}

TEST(Expression, Errors_NameTheColumn) {
  const std::pair<const char*, const char*> cases[] = {{"x + ", "column 5"},      {"x + q", "column 5"},
                                                       {"foo(x)", "column 1"},    {"(x", "column 3"},
                                                       {"exp(x, y)", "column 1"}, {"2 x", "column 3"}};
  for (const auto& [text, column] : cases) {
    try {
      Value(text, 1);
      ADD_FAILURE() << text;
    } catch (const io::InputError& e) {
      EXPECT_NE(std::string(e.what()).find(column), std::string::npos) << text << ": " << e.what();
    }
  }
}

TEST(Tape, BlockEvaluation_EqualsPointEvaluation) {
  Graph g;
  const Expr a = g.Symbol("a"), b = g.Symbol("b");
  const Expr e = g.Unary(Op::kExp, a * b) + g.Unary(Op::kAbs, a - b) * (0.5 * b);
  const codegen::Tape tape(g, {e, a, g.Unary(Op::kExp, b) * b});
  const int samples = 203;  // no multiple of the block
  std::vector<double> x(samples), out(samples), copy(samples), same(samples);
  for (int i = 0; i < samples; ++i) x[i] = 0.01 * i - 1;
  const std::vector<codegen::Binding> bindings{{x.data(), 0}, {nullptr, 0.75}};
  std::vector<double*> targets{out.data(), copy.data(), same.data()};
  tape.Evaluate(bindings, samples, targets);
  for (int i = 0; i < samples; ++i) {
    EXPECT_DOUBLE_EQ(out[i], std::exp(x[i] * 0.75) + std::abs(x[i] - 0.75) * 0.5 * 0.75);
    EXPECT_EQ(copy[i], x[i]);
    EXPECT_DOUBLE_EQ(same[i], std::exp(0.75) * 0.75);  // hangs on no sample
  }
}

}  // namespace
}  // namespace armcal::tests

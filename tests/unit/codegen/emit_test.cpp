// tests - generated files: byte for byte what the generator makes now, and their C++ against the graph.
#include <gtest/gtest.h>

#include <fstream>
#include <random>
#include <regex>
#include <sstream>

#include "codegen/generated/emps/model.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "codegen/generated/kuka_kr300/model.hpp"
#include "codegen/generated/two_link/model.hpp"
#include "codegen/src/generator/emit.hpp"
#include "tests/unit/codegen/checked_in.hpp"

namespace armcal::tests {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

std::string FileText(const std::string& path) {
  std::ifstream in(path);
  std::stringstream s;
  s << in.rdbuf();
  return s.str();
}

class GeneratedTest : public testing::TestWithParam<const char*> {};

TEST_P(GeneratedTest, Files_AreWhatTheGeneratorMakesNow) {
  const codegen::GeneratedFiles files = codegen::Emit(Load(GetParam()));
  for (const auto& [name, text] : files.text)
    EXPECT_TRUE(text == FileText(std::string("codegen/generated/") + GetParam() + "/" + name))
        << name << " differs: run build/host/armcal generate --robot " << GetParam() << " and look at the difference";
}

TEST_P(GeneratedTest, Passport_CountsWhatTheTextHolds) {
  const codegen::GeneratedFiles files = codegen::Emit(Load(GetParam()));
  const std::string& text = files.text.at("model.hpp");
  const std::string body = text.substr(text.find("static void Regressor"));
  const auto count = [&](const char* pattern) {
    const std::regex r(pattern);
    return static_cast<int>(std::distance(std::sregex_iterator(body.begin(), body.end(), r), std::sregex_iterator()));
  };
  const int fused = count("MulAdd\\(");  // one of each
  EXPECT_EQ(count(" \\* ") + fused, files.passport.multiplications);
  EXPECT_EQ(count(" [+-] ") + fused, files.passport.additions);
}

INSTANTIATE_TEST_SUITE_P(Robots, GeneratedTest,
                         testing::Values("er20_like", "kuka_kr300", "kuka_lwr4", "puma560", "ur10", "emps",
                                         "two_link"));

template <class Generated, class T>
void CompareWithGraph(const std::string& robot, double tolerance) {
  const codegen::Model model = Load(robot);
  ASSERT_EQ(Generated::kColumns, model.columns());
  ASSERT_EQ(Generated::kSchema, codegen::Schema(model));
  constexpr int n = Generated::kJoints;
  const int samples = 300;
  std::mt19937_64 random(2);
  std::uniform_real_distribution<double> u(-1, 1);
  codegen::Signals s;
  s.t = VectorXd::LinSpaced(samples, 0, 10);
  for (auto* m : {&s.q, &s.qd, &s.qdd, &s.temp})
    *m = MatrixXd::NullaryExpr(samples, n, [&] { return static_cast<float>(2 * u(random)); });
  VectorXd committed = VectorXd::NullaryExpr(model.columns(), [&] { return static_cast<float>(u(random)); });
  std::vector<double> eta;
  for (int k = 0; k < model.nonlinear(); ++k)
    eta.push_back(model.table()[model.parameters() - model.nonlinear() + k].mean);
  std::vector<MatrixXd> row;
  model.Regressor(s, {committed.data(), static_cast<std::size_t>(committed.size())}, eta, row);
  const Eigen::Matrix<T, Eigen::Dynamic, 1> p = committed.cast<T>();
  std::vector<T> e(eta.begin(), eta.end());
  e.push_back(T(0));
  for (int k = 0; k < samples; ++k) {
    model::ModelInput<T, n> x;
    for (int j = 0; j < n; ++j)
      x.q[j] = T(s.q(k, j)), x.qd[j] = T(s.qd(k, j)), x.qdd[j] = T(s.qdd(k, j)), x.temp[j] = T(s.temp(k, j));
    x.t = T(s.t[k]), x.dt = T(0.008);
    T front[Generated::kFront + 1] = {}, dense[n * Generated::kDense] = {};
    Generated::Regressor(x, p.data(), e.data(), static_cast<const T*>(nullptr), static_cast<T*>(nullptr), front, dense);
    for (int i = 0; i < n; ++i) {
      for (int c = Generated::kFrontBegin[i]; c < Generated::kFrontBegin[i + 1]; ++c)
        EXPECT_NEAR(static_cast<double>(front[c]), row[i](k, c), tolerance);
      for (int d = 0; d < Generated::kDense; ++d)
        EXPECT_NEAR(static_cast<double>(dense[i * Generated::kDense + d]), row[i](k, Generated::kFront + d), tolerance)
            << robot << " row " << i << " column " << d;
      for (int d = 0; d < Generated::kRowBegin[i]; ++d)
        EXPECT_EQ(static_cast<double>(dense[i * Generated::kDense + d]), 0.0);
    }
  }
}

// Double: same operations but for the order in which the compiler may evaluate; columns are of order 10.
TEST(Generated, RegressorInDouble_EqualsTheGraph) {
  CompareWithGraph<generated::Er20Like, double>("er20_like", 1e-12);
  CompareWithGraph<generated::KukaKr300, double>("kuka_kr300", 1e-12);
  CompareWithGraph<generated::Emps, double>("emps", 1e-12);
  CompareWithGraph<generated::TwoLink, double>("two_link", 1e-12);
}

// Float: six frames of products, each within 2^-24 of values up to 100: below 2e-4.
TEST(Generated, RegressorInFloat_StaysWithinItsRounding) {
  CompareWithGraph<generated::Er20Like, float>("er20_like", 2e-4);
  CompareWithGraph<generated::TwoLink, float>("two_link", 2e-5);
}

}  // namespace
}  // namespace armcal::tests

// methods tests - Stribeck truths, written by hand, against the log-EKF, variable projection and the fixed basis.
#include <gtest/gtest.h>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/shared_steps.hpp"
#include "tests/unit/methods/better_arm.hpp"
#include "tests/unit/methods/classic_arm.hpp"

namespace armcal::calibration {
namespace {

using Eigen::VectorXd;
using tests::SyntheticArm;

// One random law a joint: Fs - Fc = 10 .. 50 % of Fc, q_s = 0.05 .. 0.2 rad/s.
struct Law {
  double extra[2], speed[2];
  explicit Law(std::uint64_t seed) {
    std::mt19937_64 random(seed);
    std::uniform_real_distribution<double> u(0, 1);
    for (int j = 0; j < 2; ++j) extra[j] = 0.1 + 0.4 * u(random), speed[j] = 0.05 * std::pow(4, u(random));
  }
  // The same law on both joints, with half of Fc more at standstill.
  static Law Slow(double speed_radps) {
    Law law(0);
    for (int j = 0; j < 2; ++j) law.speed[j] = speed_radps, law.extra[j] = 0.5;
    return law;
  }
};

tests::Effect FrictionOf(const SyntheticArm& arm, const Law& law) {
  return [&arm, law](const tests::State& s) {
    const double x = s.qd / law.speed[s.joint];
    return law.extra[s.joint] * arm.Friction("Fc", s.joint) * std::copysign(std::exp(-x * x), s.qd);
  };
}

// Mean relative error of Fc, Fv, Fs, q_s over the joints: the study's e_f.
double FrictionError(const SyntheticArm& arm, const Law& law, const VectorXd& z) {
  const codegen::Model& model = arm.model();
  const auto at = [&](const std::string& name) {
    for (int c = 0; c < model.columns(); ++c)
      if (model.column_name(c) == name) return z[c];
    throw std::logic_error("no " + name);
  };
  double sum = 0;
  for (int j = 0; j < 2; ++j) {
    const std::string n = std::to_string(j + 1);
    const double Fc = arm.Friction("Fc", j), Fv = arm.Friction("Fv", j), Fs = Fc * (1 + law.extra[j]);
    double amplitude = 0, speed = 0;
    for (int c = 0; c < model.columns(); ++c)
      if (!model.is_rigid(c) && model.table()[model.table_index(c)].effect == "stribeck" && model.column_joint(c) == j)
        amplitude = z[c];
    for (int k = 0; k < model.nonlinear(); ++k)
      if (model.unknowns()[k].key == "vs" && model.table()[model.parameters() - model.nonlinear() + k].joint == j)
        speed = z[model.columns() + k];
    sum += std::abs(at("Fc" + n) / Fc - 1) + std::abs(at("Fv" + n) / Fv - 1) +
           std::abs((at("Fc" + n) + amplitude) / Fs - 1) + std::abs(speed / law.speed[j] - 1);
  }
  return sum / 8;
}

struct DrawnArm {
  SyntheticArm arm;
  Law law;
  Dataset data;
  Problem problem;
  explicit DrawnArm(std::uint64_t seed)
      : arm(tests::WithStribeck(tests::PlainRobot("two_link", tests::Columns::kBase)), seed), law(seed) {
    data = arm.Run(20, 100 + seed, FrictionOf(arm, law), 0.25);
    problem = tests::ProblemOf(arm, {&data});
    tests::HoldDelta(problem);
  }
};

using Solve = Solution (*)(const Problem&);

// The study reaches a mean of 0.045. Two joints with 20 s of slow motion give less information, so the bound is wider.
void Judge(Solve solve, const char* name, int first = 1) {
  double sum = 0, worst = 0, prior = 0, seconds = 0;
  constexpr int kDraws = 10;
  for (int seed = first; seed < first + kDraws; ++seed) {
    const DrawnArm draw(seed);
    const Solution s = solve(draw.problem);
    ASSERT_TRUE(s.z.allFinite()) << name << seed;
    const double e = FrictionError(draw.arm, draw.law, s.z);
    seconds += s.seconds / kDraws;
    sum += e / kDraws, worst = std::max(worst, e),
                       prior += FrictionError(draw.arm, draw.law, draw.problem.start) / kDraws;
  }
  printf("%s: e_f mean %.4f worst %.4f, of the prior %.3f, %.3f s\n", name, sum, worst, prior, seconds);
  EXPECT_LT(sum, 0.1) << name;
  EXPECT_LT(worst, 0.3) << name;
  EXPECT_GT(prior, 2 * sum) << name;
}

// A filter that linearises each sample once needs a prior about as wide as the truths are: Fs - Fc a quarter of Fc give
// or take half of that, q_s within a factor of 1.5. Left as wide as its range, it settles elsewhere in some draws. The
// two others start from nothing.
Problem Informed(Problem p) {
  const codegen::Model& model = *p.model;
  for (int c = 0; c < model.columns(); ++c) {
    if (model.is_rigid(c) || model.table()[model.table_index(c)].effect != "stribeck") continue;
    const double extra = 0.25 * model.robot().joint[model.column_joint(c)].nominal.at("Fc");
    p.start[c] = extra, p.covariance(c, c) = 0.25 * extra * extra;
  }
  for (int k = 0; k < model.nonlinear(); ++k) {
    const int c = model.columns() + k;
    if (model.unknowns()[k].key == "vs") p.covariance(c, c) = std::pow(0.4 * p.start[c], 2);
  }
  return p;
}
Solution InformedLogEkf(const Problem& problem) { return LogEkf(Informed(problem)); }

// The coordinates whose logarithm the filter estimates.
std::vector<int> Logarithms(const Problem& p) {
  const codegen::Model& model = *p.model;
  std::vector<int> out;
  for (int c = 0; c < p.start.size(); ++c)
    if (c >= model.columns() ? p.lower[c] < p.upper[c]
                             : !model.is_rigid(c) && model.table()[model.table_index(c)].effect == "stribeck")
      out.push_back(c);
  return out;
}

// Of a logarithm, where the parameter's relative deviation is the problem's.
double PriorVariance(const Problem& p, int c) { return std::log1p(p.covariance(c, c) / (p.start[c] * p.start[c])); }

// One pass over the log ends off this point, because its first rows are linearised at the prior.
TEST(LogEkf, EndsWhereNoStepInALogarithmIsMoreLikely) {
  for (const std::uint64_t seed : {11, 12, 13, 14}) {
    const DrawnArm draw(seed);
    const Problem p = Informed(draw.problem);
    const Solution found = LogEkf(p);
    const std::vector<int> logarithms = Logarithms(p);
    ASSERT_EQ(logarithms.size(), 4U);
    // chi^2: the logs, and a normal prior of each logarithm.
    const auto against = [&](const VectorXd& z) {
      const VectorXd error = Linearise(p, z).residual;
      double sum = error.squaredNorm();
      for (const int c : logarithms) sum += std::pow(std::log(z[c] / p.start[c]), 2) / PriorVariance(p, c);
      return sum;
    };
    const double least = against(found.z);
    for (const int c : logarithms)
      for (const int side : {-1, 1}) {
        VectorXd z = found.z;
        z[c] *= std::exp(side * 0.1 * std::sqrt(found.covariance(c, c)) / z[c]);
        EXPECT_GT(against(z), least) << seed << " " << c;
      }
  }
}

// The deviations follow from what rows and prior tell, linearised where the filter ended.
TEST(LogEkf, DeviationsAreThoseOfTheParameters_NotOfTheirLogarithms) {
  for (const std::uint64_t seed : {11, 12}) {
    const DrawnArm draw(seed);
    const Problem p = Informed(draw.problem);
    const Solution found = LogEkf(p);
    Eigen::MatrixXd A = Linearise(p, found.z).A, prior = p.covariance;
    for (const int c : Logarithms(p)) {
      A.col(c) *= found.z[c];
      prior.row(c).setZero(), prior.col(c).setZero();
      prior(c, c) = PriorVariance(p, c);
    }
    std::vector<int> known;  // all but what is held
    for (int c = 0; c < A.cols(); ++c)
      if (prior(c, c) > 0 && (c < p.model->columns() || p.lower[c] < p.upper[c])) known.push_back(c);
    const Eigen::MatrixXd told = Eigen::MatrixXd(A.transpose() * A)(known, known) +
                                 Eigen::MatrixXd(prior(known, known)).inverse(),
                          expected = told.inverse();
    for (const int c : Logarithms(p)) {
      const auto at = std::find(known.begin(), known.end(), c) - known.begin();
      const double sd = found.z[c] * std::sqrt(expected(at, at));
      EXPECT_NEAR(std::sqrt(found.covariance(c, c)), sd, 0.1 * sd) << seed << " " << c;
    }
  }
}

TEST(LogEkf, FindsStribeckTruths) { Judge(InformedLogEkf, "log_ekf", 11); }
TEST(LogEkf, WithoutAnIdeaOfTheAmplitude_SaysThatItMayBeWrong) {
  EXPECT_NE(LogEkf(DrawnArm(1).problem).remark.find("no prior mean"), std::string::npos);
}
TEST(VariableProjection, FindsStribeckTruths) { Judge(VariableProjection, "variable_projection"); }
TEST(StribeckBasis, FindsStribeckTruths) { Judge(StribeckBasis, "stribeck_basis"); }

// The range of q_s begins at 0.01 rad/s and ends a hundred times higher. On a logarithmic scale these laws lie in its
// lower third, where a slow motion shows them.
TEST(StribeckBasis, FindsALawThatEndsAtALowSpeed) {
  SyntheticArm arm(tests::WithStribeck(tests::PlainRobot("two_link", tests::Columns::kBase)), 5);
  for (const double speed : {0.03, 0.045}) {
    const Law law = Law::Slow(speed);
    const Dataset data = arm.Run(40, 105, FrictionOf(arm, law), 0.05);
    Problem problem = tests::ProblemOf(arm, {&data});
    tests::HoldDelta(problem);
    const Solution s = StribeckBasis(problem);
    EXPECT_LT(FrictionError(arm, law, s.z), 0.1) << speed;
  }
}

// The expected q_s is twice the true one, give or take a third. The logs know better.
TEST(StribeckBasis, WithAnExpectationThatIsOff_FollowsTheLogs) {
  SyntheticArm arm(tests::WithStribeck(tests::PlainRobot("two_link", tests::Columns::kBase)), 5);
  constexpr double kSpeed_radps = 0.045;
  const Dataset data = arm.Run(40, 105, FrictionOf(arm, Law::Slow(kSpeed_radps)), 0.05);
  Problem p = tests::ProblemOf(arm, {&data});
  tests::HoldDelta(p);
  std::vector<int> speeds;
  for (int k = 0; k < arm.model().nonlinear(); ++k)
    if (arm.model().unknowns()[k].key == "vs") speeds.push_back(arm.model().columns() + k);
  ASSERT_EQ(speeds.size(), 2U);
  for (const int c : speeds) {
    p.start[c] = 2 * kSpeed_radps;
    p.covariance.row(c).setZero(), p.covariance.col(c).setZero();
    p.covariance(c, c) = std::pow(0.3 * p.start[c], 2);
  }
  const Solution s = StribeckBasis(p);
  for (const int c : speeds) EXPECT_NEAR(s.z[c] / kSpeed_radps, 1, 0.2) << c;
}

TEST(VariableProjection, FromAFarStart_ReachesTheSameMinimum) {
  const DrawnArm draw(3);
  Problem far = draw.problem;
  const Solution near = VariableProjection(draw.problem);
  far.covariance.bottomRightCorner(4, 4) *= 1e6;  // no opinion on eta: the start must not matter
  Problem other = far;
  for (int c = draw.arm.model().columns(); c < far.start.size(); ++c)
    if (far.lower[c] < far.upper[c]) other.start[c] = 0.9 * far.upper[c];
  const Solution a = VariableProjection(far), b = VariableProjection(other);
  // The objective is flat to 1e-6 about its minimum; deviations of eta are some per cent.
  for (int c = 0; c < far.start.size(); ++c)
    EXPECT_NEAR(a.z[c], b.z[c], 0.05 * std::sqrt(std::max(1e-12, near.covariance(c, c))) + 1e-3 * std::abs(a.z[c]))
        << c;
}

TEST(LogEkf, OnALinearModel_IsTheBayesUpdate) {
  SyntheticArm arm(tests::PlainRobot("two_link", tests::Columns::kBase), 2);
  const Dataset d = arm.Run(4, 3);
  const Problem p = tests::ProblemOf(arm, {&d});
  const tests::Stacked s = tests::StackByHand(arm.model(), d);
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(p.start.size(), p.start.size());
  VectorXd g = VectorXd::Zero(p.start.size());
  for (Eigen::Index r = 0; r < s.tau.size(); ++r) {
    const double w = 1 / std::pow(p.sigma_Nm[s.joint[r]], 2);
    H += w * s.K.row(r).transpose() * s.K.row(r);
    g += w * s.K.row(r).transpose() * (s.tau[r] - s.K.row(r).dot(p.start));
  }
  const Eigen::MatrixXd& P = p.covariance;
  const VectorXd z = p.start + P * (Eigen::MatrixXd::Identity(H.rows(), H.cols()) + H * P).partialPivLu().solve(g);
  const Solution k = LogEkf(p);
  for (int c = 0; c < z.size(); ++c)
    EXPECT_NEAR(k.z[c], z[c], 1e-6 * std::sqrt(P(c, c))) << c;  // round-off of 1000 updates
  EXPECT_EQ(k.path.rows(), d.samples());
}

TEST(StribeckMethods, OnAModelWithoutTheLaw_SaySo) {
  SyntheticArm arm(tests::PlainRobot("two_link", tests::Columns::kBase), 2);
  const Dataset d = arm.Run(4, 3);
  EXPECT_THROW(StribeckBasis(MakeProblem(arm.model(), {&d})), io::InputError);
  EXPECT_THROW(VariableProjection(MakeProblem(arm.model(), {&d})), io::InputError);
}

}  // namespace
}  // namespace armcal::calibration

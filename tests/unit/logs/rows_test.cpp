// logs tests - rows that are no samples are left out and noted; what cannot be mended is one line.
#include "host_sim/data/logs/rows.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host_sim/data/logs/signals.hpp"
#include "host_sim/data/logs/steps.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::logs {
namespace {

using Eigen::Index;
using files::test::ErrorOf;

constexpr double kStep_s = 0.004;

double Position(double t, Index j) { return 0.4 * std::sin(1.3 * t + static_cast<double>(j)); }

// Two joints that move, each torque with noise: no value occurs twice.
RawRows Good(Index count) {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0, 0.5);
  RawRows rows;
  rows.source = "run.csv", rows.time_column = "t", rows.columns = {"q1", "q2", "tau1", "tau2"};
  rows.t = Eigen::VectorXd::LinSpaced(count, 10, 10 + kStep_s * static_cast<double>(count - 1));
  rows.q.resize(count, 2), rows.tau.resize(count, 2), rows.missing.setZero(count);
  for (Index k = 0; k < count; ++k)
    for (Index j = 0; j < 2; ++j) rows.q(k, j) = Position(rows.t[k], j), rows.tau(k, j) = noise(random);
  return rows;
}

// The same rows in another order or number; times stay with them.
RawRows Pick(const RawRows& from, const std::vector<Index>& index) {
  RawRows out = from;
  out.t = from.t(index), out.q = from.q(index, Eigen::all), out.tau = from.tau(index, Eigen::all);
  out.missing = from.missing(index);
  return out;
}

std::string Said(const RawRows& rows) {
  std::string said;
  for (const std::string& note : ChooseSamples(rows).notes) said += note + "|";
  return said;
}

std::vector<Index> Count(Index count) {
  std::vector<Index> out;
  for (Index k = 0; k < count; ++k) out.push_back(k);
  return out;
}

TEST(Rows, OfAGoodLog_AllStayAndNothingIsSaid) {
  const RawRows rows = Good(1000);
  const Samples samples = ChooseSamples(rows);
  EXPECT_EQ(samples.row, Count(1000));
  EXPECT_EQ(samples.t, rows.t);
  EXPECT_TRUE(samples.notes.empty()) << samples.notes[0];
}

TEST(Rows, OneThatGoesBackOrLeaps_IsLeftOutAlone) {
  for (const double wrong : {9.0, 10.2, 11.5, -1e148, 1e9}) {  // before the log, inside of it, far away
    RawRows rows = Good(1000);
    rows.t[500] = wrong;
    const Samples samples = ChooseSamples(rows);
    EXPECT_EQ(samples.row.size(), 999u) << wrong;
    EXPECT_EQ(std::count(samples.row.begin(), samples.row.end(), 500), 0) << wrong;
    ASSERT_EQ(samples.notes.size(), 1u) << wrong;
    EXPECT_NE(samples.notes[0].find("1 row left out"), std::string::npos) << samples.notes[0];
    EXPECT_NE(samples.notes[0].find("first line 502"), std::string::npos) << samples.notes[0];
  }
}

TEST(Rows, TwoThatChangedPlaces_CostOne) {
  RawRows rows = Good(1000);
  std::swap(rows.t[500], rows.t[501]);
  EXPECT_EQ(ChooseSamples(rows).row.size(), 999u);
}

TEST(Rows, WrongAtTheBeginning_AreLeftOut) {  // the first stamps are rubbish, and none of them goes back
  RawRows rows = Good(1000);
  rows.t[0] = -3, rows.t[1] = 0.7;
  const Samples samples = ChooseSamples(rows);
  EXPECT_EQ(samples.row.front(), 2);
  EXPECT_EQ(samples.row.size(), 998u);
}

TEST(Rows, APauseOfTheLogger_IsNoFault) {
  RawRows rows = Good(1000);
  rows.t.tail(400).array() += 60;
  EXPECT_EQ(ChooseSamples(rows).row.size(), 1000u);
}

TEST(Rows, ManyThatGoBack_AreRefused) {
  RawRows rows = Good(1000);
  for (Index k = 100; k < 500; k += 10) std::swap(rows.t[k], rows.t[k + 1]);
  EXPECT_EQ(ErrorOf([&] { ChooseSamples(rows); }),
            "run.csv:103: column 't': time goes back (such rows: 40), expected it to rise");
  RawRows repeated = Good(1000);  // stamps of a coarse clock
  for (Index k = 0; k + 1 < 1000; k += 2) repeated.t[k + 1] = repeated.t[k];
  EXPECT_NE(ErrorOf([&] { ChooseSamples(repeated); }).find("run.csv:3: column 't': time is repeated"),
            std::string::npos);
  const std::vector<Index> first = Count(600);  // two runs in one file, of one clock that started again
  std::vector<Index> twice = first;
  twice.insert(twice.end(), first.begin(), first.end());
  RawRows two = Pick(Good(600), twice);
  two.tau.bottomRows(600) *= 1.01;
  EXPECT_NE(ErrorOf([&] { ChooseSamples(two); }).find("time goes back"), std::string::npos);
}

TEST(Rows, WrittenTwice_AreTakenOnce) {
  std::vector<Index> twice;
  for (Index k = 0; k < 500; ++k) twice.insert(twice.end(), {k, k});
  EXPECT_EQ(ChooseSamples(Pick(Good(500), twice)).row.size(), 500u);
}

TEST(Rows, WithoutANumber_AreLeftOutIfTheyPadOrAreFew) {
  RawRows rows = Good(1000);
  const auto lose = [&rows](Index first, Index count) {
    rows.q.middleRows(first, count).setConstant(NAN);
    rows.missing.segment(first, count).setOnes();
  };
  lose(700, 300);
  EXPECT_EQ(ChooseSamples(rows).row.size(), 700u);
  EXPECT_NE(Said(rows).find("300 rows left out"), std::string::npos) << Said(rows);
  lose(350, 20);
  EXPECT_EQ(ChooseSamples(rows).row.size(), 680u);
  lose(100, 200);
  EXPECT_NE(ErrorOf([&] { ChooseSamples(rows); }).find("line 102: column 'q1' has no number"), std::string::npos);
}

TEST(Rows, ThatRepeatTheLastOneOrAreZero_AreFiller) {
  RawRows rows = Good(1000);
  for (Index k = 992; k < 1000; ++k) rows.q.row(k) = rows.q.row(991), rows.tau.row(k).setZero();
  EXPECT_EQ(ChooseSamples(rows).row.size(), 992u);
  EXPECT_NE(Said(rows).find("from line 994"), std::string::npos) << Said(rows);
  rows = Good(1000);
  rows.q.middleRows(300, 7).setZero(), rows.tau.middleRows(300, 7).setZero();
  EXPECT_EQ(ChooseSamples(rows).row.size(), 993u);
}

TEST(Rows, ThatRepeatWhileTheArmMoves_AreLeftOut_ButNotAtRest) {
  RawRows rows = Good(1000);
  for (Index k = 100; k < 900; k += 50) rows.q.row(k) = rows.q.row(k - 1), rows.tau.row(k) = rows.tau.row(k - 1);
  EXPECT_EQ(ChooseSamples(rows).row.size(), 1000u - 16u);
  RawRows still = Good(1000);  // a noise-free simulation that waits for two seconds
  for (Index k = 300; k < 800; ++k) still.q.row(k) = still.q.row(299), still.tau.row(k) = still.tau.row(299);
  for (Index k = 800; k < 1000; ++k)  // and moves on from there
    for (Index j = 0; j < 2; ++j)
      still.q(k, j) = still.q(299, j) + 0.1 * (1 - std::cos(2 * kStep_s * static_cast<double>(k - 799)));
  EXPECT_EQ(ChooseSamples(still).row.size(), 1000u) << Said(still);
}

TEST(Rows, EachValueThreeTimes_LeavesTheFreshOnesAndTheirRate) {
  RawRows rows = Good(1500);
  for (Index k = 0; k < 1500; ++k) rows.q.row(k) = rows.q.row(k - k % 3), rows.tau.row(k) = rows.tau.row(k - k % 3);
  const Samples samples = ChooseSamples(rows);
  EXPECT_EQ(samples.row.size(), 500u);
  for (const Index k : samples.row) EXPECT_EQ(k % 3, 0);
  EXPECT_NE(Said(rows).find("83.33 Hz and not 250"), std::string::npos) << Said(rows);
  rows = Good(1500);  // the torque alone is slower
  for (Index k = 0; k < 1500; ++k) rows.tau.row(k) = rows.tau.row(k - k % 3);
  EXPECT_EQ(ChooseSamples(rows).row.size(), 500u);
}

TEST(Rows, OfACoarseEncoder_AreNotHeld) {
  RawRows rows = Good(3000);
  constexpr double kEncoder = 5e-3;  // two to four samples on each step at full speed
  rows.q = kEncoder * (rows.q / kEncoder).array().round();
  EXPECT_EQ(ChooseSamples(rows).row.size(), 3000u) << Said(rows);
}

TEST(Rows, WithTimeInAnotherUnit_AreRefusedNamingIt) {
  const auto error = [](double factor) {
    RawRows rows = Good(1000);
    rows.t *= factor;
    return ErrorOf([&] { ChooseSamples(rows); });
  };
  EXPECT_NE(error(1e3).find("run.csv: column 't': the time step is 4 s (0.25 Hz)"), std::string::npos) << error(1e3);
  EXPECT_NE(error(1e3).find("looks like ms"), std::string::npos);
  EXPECT_NE(error(1e6).find("looks like us"), std::string::npos);
  EXPECT_NE(error(1e9).find("looks like ns"), std::string::npos);
  EXPECT_NE(error(1e-3).find("1000 times too short"), std::string::npos) << error(1e-3);
}

// Sampled evenly, stamped late by what the program needed: the even grid is nearer to the truth.
TEST(Rows, EvenlySampledWithJitteringStamps_AreMadeEven) {
  std::mt19937_64 random(8);
  std::uniform_real_distribution<double> late(0, 0.3 * kStep_s);
  RawRows rows = Good(2000);
  const Eigen::VectorXd truth = rows.t;
  for (double& t : rows.t) t += late(random);
  const Samples samples = ChooseSamples(rows);
  ASSERT_EQ(samples.notes.size(), 1u);
  const Eigen::VectorXd error = samples.t - truth;
  // what stays is the mean delay and the error of a line through 2000 stamps
  EXPECT_LT((error.array() - error.mean()).abs().maxCoeff(), 0.02 * kStep_s);
  for (Index k = 0; k < 2000; ++k)  // the same stamps, and the joints sampled at them
    for (Index j = 0; j < 2; ++j) rows.q(k, j) = Position(rows.t[k], j);
  EXPECT_EQ(ChooseSamples(rows).t, rows.t);
}

// Two stamps that jitter may be nearly two steps apart, and nothing is lost between them.
TEST(Steps, StampsThatJitter_LoseNothing_AndEachLostSampleIsFound) {
  std::mt19937_64 random(9);
  const auto stamps = [&](double jitter, Index every) {
    std::normal_distribution<double> normal(0, jitter);
    Eigen::VectorXd t(21000);
    double clock = 0;
    for (Index k = 0; k < t.size(); ++k, clock += k % every == 0 && k > 0 ? 2 : 1)
      t[k] = kStep_s * (clock + std::clamp(normal(random), -0.45, 0.45));
    return t;
  };
  EXPECT_TRUE(LostBehind(stamps(0.2, 1000000)).empty());
  // At a jitter of 0.18 of a step one loss in forty is hidden: its step is shorter than 1.5.
  int found = 0, false_ones = 0;
  for (int log = 0; log < 20; ++log) {
    const std::vector<int> lost = LostBehind(stamps(0.18, 700));
    int hits = 0;
    for (int each = 1; each < 30; ++each)
      hits += std::any_of(lost.begin(), lost.end(), [&](int k) { return std::abs(k - 700 * each) <= 2; });
    found += hits, false_ones += static_cast<int>(lost.size()) - hits;
  }
  EXPECT_GE(found, 20 * 29 - 20);
  EXPECT_LE(false_ones, 6);
  Eigen::VectorXd every_second = stamps(0, 1000000)(Eigen::seq(0, 400));
  every_second.tail(101) += kStep_s * Eigen::VectorXd::LinSpaced(101, 0, 100);  // of the last part, every step is two
  EXPECT_EQ(LostBehind(every_second).size(), 100u);
}

TEST(Rows, EvenlySampledWithStampsNearlyTwoStepsApart_AreMadeEven) {
  std::mt19937_64 random(10);
  std::normal_distribution<double> normal(0, 0.3);
  RawRows rows = Good(2000);
  const Eigen::VectorXd truth = rows.t;
  for (double& t : rows.t) t += kStep_s * std::clamp(normal(random), -0.45, 0.45);
  const Samples samples = ChooseSamples(rows);
  const Eigen::VectorXd error = samples.t - truth;
  EXPECT_LT((error.array() - error.mean()).abs().maxCoeff(), 0.03 * kStep_s);
}

TEST(Signals, NoRateOrFewSamples_HaveNoSpectrumAndDoNotCrash) {
  const Eigen::VectorXd q = Eigen::VectorXd::Random(2000);
  for (const double rate_Hz : {0.0, 1e-9, 0.01, 0.1, 0.124, 0.5, 1e6, 1e12, std::numeric_limits<double>::infinity()})
    EXPECT_EQ(MotionBand_Hz(q, 1e-3, rate_Hz), 0.5 * rate_Hz) << rate_Hz;
}

}  // namespace
}  // namespace armcal::logs

// survey tests - the firmware's estimator reaches the required accuracy on fresh draws.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>

#include "host_sim/study/survey/tables.hpp"
#include "tests/unit/survey/survey_arm.hpp"

namespace armcal::survey::test {
namespace {

const char* const kWorst = "worst case +-20 %";
const char* const kUniform = "uniform +-20 %";
const char* const kStribeck = "(4), uniform +-20 %";

// 200 in the long test: see CMakeLists.txt. The limits are the same; they leave room for the means of fewer.
int Draws() {
  const char* draws = std::getenv("ARMCAL_DRAWS");
  return draws ? std::atoi(draws) : 12;
}

class Online : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    Settings settings;
    settings.robot = File();
    settings.records = AllRecords();
    settings.levels = LevelFile();
    settings.draws = Draws();
    settings.seed = 3;
    Motions motions;
    motions.linear.series = StudyLinear();
    motions.nonlinear.series = StudyNonlinear();
    motions.other = Validation(File(), AllRecords(), 5);
    Findings found;
    ShowOnline(settings, motions, found);
    sheet_ = found.sheets.at(0);
  }
  static double At(const std::string& prior, const std::string& filter, const std::string& column) {
    for (const auto& row : sheet_.rows)
      for (std::size_t c = 0; c < sheet_.columns.size(); ++c)
        if (row[0].words == prior && row[1].words == filter && sheet_.columns[c] == column) return row[c].value;
    ADD_FAILURE() << "no " << prior << ", " << filter << ", " << column;
    return std::nan("");
  }
  static inline Sheet sheet_;
};

TEST_F(Online, OfWorstCaseTables_IsNearerToTheTruthInEveryIndex) {
  for (const std::string filter : {"Kalman", "forgetting"}) {
    EXPECT_LE(At(kWorst, filter, "e_d"), 0.19) << filter;
    EXPECT_LE(At(kWorst, filter, "e_d p95"), 0.19) << filter;
    EXPECT_LE(At(kWorst, filter, "e_d / e_d(prior)"), 0.9) << filter;
    EXPECT_LE(At(kWorst, filter, "e_f"), 0.02) << filter;
    EXPECT_LE(At(kWorst, filter, "J_e"), 0.25) << filter;
  }
}

TEST_F(Online, Bodies_CanExistInEveryDraw) {
  for (const auto& row : sheet_.rows) {
    EXPECT_EQ(At(row[0].words, row[1].words, "share physical"), 1) << row[0].words;
    EXPECT_EQ(At(row[0].words, row[1].words, "share converged"), 1) << row[0].words;
  }
}

TEST_F(Online, BaseParameters_AreNearWhatTheRowsAllow) {
  for (const std::string filter : {"Kalman", "forgetting"})
    EXPECT_LE(At(kWorst, filter, "over Cramer-Rao"), 1.15) << filter;
  EXPECT_LE(At(kUniform, "Kalman", "over Cramer-Rao"), 1.15);
}

TEST_F(Online, StribeckFrictionOfAnyDraw_IsFoundByTheExtendedFilter) {
  EXPECT_LE(At(kStribeck, "extended Kalman", "e_f"), 0.06);
  EXPECT_GE(At(kStribeck, "extended Kalman", "share e_f < .2"), 0.98);
  EXPECT_LE(At(kStribeck, "extended Kalman", "J_e"), 0.30);
}

TEST_F(Online, Intervals_HoldWhatTheySay) {
  EXPECT_GE(At(kUniform, "Kalman", "coverage"), 0.92);
  EXPECT_LE(At(kUniform, "Kalman", "coverage"), 0.98);
  EXPECT_EQ(At(kUniform, "Kalman", "share inconsistent"), 0);
  EXPECT_GE(At(kWorst, "forgetting", "coverage"), 0.92);
}

TEST_F(Online, IntervalsThatDoNotHold_AreCalledInconsistent) {
  for (const std::string prior : {"uniform +-20 %, half of it stated", "worst case +-20 %, half of it stated",
                                  "uniform +-20 %, ripple of 1 % of tau_max"})
    EXPECT_TRUE(At(prior, "Kalman", "coverage") >= 0.85 || At(prior, "Kalman", "share inconsistent") >= 0.95) << prior;
}

}  // namespace
}  // namespace armcal::survey::test

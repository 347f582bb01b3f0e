// survey tests - a model that contains another never fits the training data worse. The survey's own Table 12 breaks
// this.
#include <gtest/gtest.h>

#include "host_sim/identify/choice/fit_model.hpp"
#include "host_sim/study/survey/platform.hpp"
#include "host_sim/study/survey/trial.hpp"
#include "tests/unit/survey/survey_arm.hpp"

namespace armcal::survey {
namespace {

class Nesting : public testing::Test {
 protected:
  Nesting() {
    const codegen::Model truth = test::Arm(Law::kStribeck, Bodies::kBase);
    for (int j = 0; j < 6; ++j) sigma_[j] = test::File().joint[j].torque_noise_Nm;
    const codegen::Signals s = Sampled(test::StudyNonlinear(), 500);
    log_ = Measured(s, Torque(truth, s, SetParameters(truth)) + Noise(500, sigma_, 7));
  }
  double TrainingError(Law law) const {
    const codegen::Model model = test::Arm(law, Bodies::kBase);
    const choice::ModelFit fit = choice::FitModel(model, {&log_});
    EXPECT_GT(fit.z.size(), 0) << LawName(law) << ": " << fit.why;
    return fit.z.size() ? BaseError(log_.tau - Torque(model, log_.s, fit.z), sigma_) : 1e9;
  }

  Eigen::VectorXd sigma_ = Eigen::VectorXd::Zero(6);
  calibration::Dataset log_;
};

TEST_F(Nesting, ModelsFourFiveEightNine_NeverFitWorseThanSeven) {
  const double seven = TrainingError(Law::kCoulombViscous);
  for (const Law law : {Law::kStribeck, Law::kExponential, Law::kCubeRoot, Law::kLoad})
    EXPECT_LE(TrainingError(law), seven * (1 + 1e-6)) << LawName(law);
  // (6) contains (7) only as f4 grows without bound.
  EXPECT_LE(TrainingError(Law::kSechTanh), seven * 1.01);
}

TEST_F(Nesting, TrueModel_LeavesTheNoiseAndTheOthersMore) {
  EXPECT_NEAR(TrainingError(Law::kStribeck), 1, 0.03);  // 3000 rows less 60 parameters: 0.99, +- 0.013
  EXPECT_GT(TrainingError(Law::kCoulombViscous), TrainingError(Law::kStribeck));
}

}  // namespace
}  // namespace armcal::survey

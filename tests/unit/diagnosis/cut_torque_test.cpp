// diagnosis tests - cut torque off at a limit: the limit and the parameters are found together.
#include <gtest/gtest.h>

#include <algorithm>

#include "host_sim/diagnose/diagnosis/diagnose.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"

namespace armcal::diagnosis {
namespace {

using calibration::Dataset;

constexpr int kCutJoint = 1;

// Noise comes behind the limit.
struct CutOff {
  explicit CutOff(double limit) : arm(codegen::ReadRobot("codegen/robots/two_link.toml"), 8) {
    const auto cut = [&](const tests::State& s) {
      if (s.joint != kCutJoint) return 0.0;
      const double sign = s.qd > 0 ? 1 : s.qd < 0 ? -1 : 0;
      const double tau = s.tau_rigid + arm.Friction("Fc", kCutJoint) * sign + arm.Friction("Fv", kCutJoint) * s.qd;
      return std::clamp(tau, -limit, limit) - tau;
    };
    const Dataset train = arm.Run(20, 80, cut), test = arm.Run(20, 81, cut);
    Diagnosis diagnosis(arm.model(), tests::Records(), {&train});
    const HeldOut held_out = diagnosis.Judge(test);
    terms = diagnosis.finding().terms;
    after_Nm = calibration::Rms(test, held_out.after, true)[kCutJoint];
    measured_limit_Nm = limit * (1 + arm.truth()[arm.model().columns() + kCutJoint]);
  }
  tests::SyntheticArm arm;
  double measured_limit_Nm = 0, after_Nm = 0;
  std::vector<Term> terms;
};

TEST(CutTorque, LimitAndParametersAreFoundTogether) {
  for (const double limit_Nm : {2.5, 3.0, 5.0}) {
    const CutOff c(limit_Nm);
    const auto confirmed = [](const Term& t) { return t.confirmed; };
    ASSERT_EQ(std::count_if(c.terms.begin(), c.terms.end(), confirmed), 1) << limit_Nm;
    const Term& t = *std::find_if(c.terms.begin(), c.terms.end(), confirmed);
    EXPECT_EQ(t.record->name, "torque_saturation");
    EXPECT_NEAR(t.eta[0], c.measured_limit_Nm, 0.01 * c.measured_limit_Nm);
    EXPECT_NEAR(t.amplitude[0], 1, std::clamp(2 * t.sd[0], 0.02, 0.06));  // the highest limit cuts few samples
    EXPECT_LT(c.after_Nm, 1.02 * c.arm.noise_Nm(kCutJoint));
  }
}

}  // namespace
}  // namespace armcal::diagnosis

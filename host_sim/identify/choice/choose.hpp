// choice - which friction law each joint has, by errors on stretches of the training logs that took no part in a fit.
#pragma once

#include <atomic>
#include <functional>

#include "host_sim/identify/calibration/dataset.hpp"
#include "host_sim/identify/choice/friction_laws.hpp"

namespace armcal::choice {

// A ratio of two RMS errors, minus one, with its 95 % interval: stretches of two seconds are drawn with replacement.
struct Ratio {
  double value = 0, low = 0, high = 0;
};

// One law on one joint.
struct LawError {
  double rms_Nm = 0;    // on stretches that the fit has not seen
  Ratio over_best;      // over the law with the smallest error
  bool beaten = false;  // the interval is above 0
  std::string failed;   // why the law could not be fitted; then nothing above holds
};

struct JointChoice {
  std::vector<LawError> law;  // in the order of Choice::laws
  std::size_t best = 0, chosen = 0;
  bool differ = false;  // some law is beaten
  std::string failed;   // why no law could be fitted; then nothing above holds
};

// NaN where the joint has no row of the log.
struct HeldOut {
  double plain_Nm = 0, chosen_Nm = 0, torque_Nm = 0;  // RMS where the joint moves, in the band that is fitted
  Ratio over_plain;                                   // of the errors
};

struct Choice {
  std::vector<FrictionLaw> laws;
  std::vector<JointChoice> joint;
};

struct ChooseSettings {
  const std::atomic<bool>* stop = nullptr;
  std::function<void(double share)> progress = {};  // may be empty
};

// Each joint's torque is fitted by itself, by least squares and without a prior, with each law in turn. The joint takes
// the law with the fewest parameters that is not beaten by the best one. InputError: no joint has a law that could be
// fitted, or a log is shorter than ten stretches of half a second.
Choice Choose(const codegen::Robot& robot, const codegen::Catalogue& records,
              const std::vector<calibration::Dataset>& train, const ChooseSettings& settings = {});

// [law] Squares of the errors on one joint's rows of a test, by stretches, with each law fitted to the whole training
// logs as in Choose; empty: the law could not be fitted.
std::vector<Eigen::VectorXd> TestLaws(const std::vector<FrictionLaw>& laws, const codegen::Robot& robot,
                                      const codegen::Catalogue& records, const std::vector<calibration::Dataset>& train,
                                      const calibration::Dataset& test, int joint,
                                      const std::atomic<bool>* stop = nullptr);

// [test][joint] The chosen laws together, and Coulomb and viscous friction alone, each fitted to the whole training
// logs. InputError: they cannot be fitted.
std::vector<std::vector<HeldOut>> Judge(const Choice& choice, const codegen::Robot& robot,
                                        const codegen::Catalogue& records,
                                        const std::vector<calibration::Dataset>& train,
                                        const std::vector<calibration::Dataset>& tests);

}  // namespace armcal::choice

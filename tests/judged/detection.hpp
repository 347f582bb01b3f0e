// judged set - computes, without the diagnosis, how clearly a log shows an effect.
#pragma once

#include "tests/judged/channel.hpp"

namespace armcal::judged {

// From here on a log shows an effect: 15 that a term must clear, and 15 for its parameters and the places tried.
inline constexpr double kDetectable = 30;
inline constexpr double kBand_Hz = 10;  // the band whose noise sizes are told in

struct Seen {
  double score = 0;      // twice the gain in log likelihood of the true term, beside all that the declared model gives
  Eigen::VectorXd size;  // RMS of what the declared model leaves of it, over the noise in the band; per joint
};

class Detector {
 public:
  // fine: the motion that `m` samples, for the links' columns. noise: what the true model leaves, [samples x joints];
  // its spectrum is that of an autoregression.
  Detector(const Arm& arm, const Motion& fine, const Motion& m, const Channel& channel, const Eigen::MatrixXd& noise,
           plant::Random& random);
  Seen Look(const Eigen::MatrixXd& term) const;
  const Eigen::VectorXd& band_noise_Nm() const { return band_noise_Nm_; }

 private:
  Eigen::VectorXd Whitened(int joint, const Eigen::VectorXd& x) const;

  std::vector<Eigen::VectorXd> filter_;  // of each joint: whitening, over the noise
  std::vector<Eigen::MatrixXd> white_, thin_;
  Eigen::MatrixXd inverse_;  // of all joints' normal equations
  Eigen::VectorXd band_noise_Nm_, scale_;
};

}  // namespace armcal::judged

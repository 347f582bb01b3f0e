// analysis - runs a diagnosis from logs to its JSON.
#include "host_sim/diagnose/analysis/diagnosed.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "codegen/src/io/watch.hpp"
#include "host_sim/diagnose/verdict/common_rows.hpp"
#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/diagnose/verdict/json.hpp"
#include "host_sim/diagnose/verdict/words.hpp"

namespace armcal::analysis {

namespace {

constexpr double kPreparing = 0.1, kTraining = 0.9;  // for a watch: of the training, and of all, about

}  // namespace

Diagnosed::Diagnosed(std::unique_ptr<codegen::Model> declared, codegen::Catalogue records,
                     const std::vector<logs::Log>& train_logs, const DiagnoseOptions& given, const Say& say)
    : options(given), catalogue(std::move(records)), model(std::move(declared)) {
  const io::Stage training(0, kTraining);
  whole_ = CheckedLogs(*model, train_logs, options.cutoff_Hz, say);
  const auto start = std::chrono::steady_clock::now();
  std::vector<calibration::Dataset> narrow = NarrowLogs(*model, train_logs, options.cutoff_Hz);
  // A filter smooths what a derivation up to a cut-off that was asked for leaves of noise, whether there is one or not.
  channel_ = calibration::SeeChannel(*model, calibration::Pointers(options.cutoff_Hz > 0 ? narrow : whole_));
  for (calibration::Dataset& log : whole_) PutBehindChannel(log);
  for (const calibration::Dataset& log : whole_) train.push_back(calibration::ThinToBand(log));
  for (calibration::Dataset& log : narrow) {
    PutBehindChannel(log);
    narrow_.push_back(calibration::ThinToBand(log));
  }
  const io::Stage deciding(kPreparing, 1);
  diagnosis = std::make_unique<diagnosis::Diagnosis>(*model, catalogue, calibration::Pointers(train),
                                                     calibration::Pointers(narrow_), options.at_turns);
  view.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();

  const diagnosis::Finding& finding = diagnosis->finding();
  Eigen::VectorXd z(model->columns() + model->nonlinear());
  z << finding.x.head(model->columns()), Eigen::VectorXd::Map(finding.declared.eta.data(), model->nonlinear());
  view.exogeneity =
      calibration::CheckExogeneity(*model, diagnosis->WithoutTerms(), z, calibration::Instruments::kCommanded);
}

void Diagnosed::PutBehindChannel(calibration::Dataset& log) const {
  log.channel = channel_;
  calibration::UseWhatMoved(log);
}

void Diagnosed::Judge(const logs::Log& log, const std::string& robot, const std::string& file, const Say& say) {
  const diagnosis::Finding& finding = diagnosis->finding();
  test = std::move(CheckedLogs(*model, {log}, options.cutoff_Hz, say)[0]);
  PutBehindChannel(test);
  held_out = diagnosis->Judge(test, options.gain_tolerance);
  view.motion = calibration::CompareMotion(*model, finding.declared, calibration::Pointers(train), test);
  if (view.motion.repeats()) diagnosis->ConfirmNothing(verdict::MotionText(view.motion)[0]);
  view.model = model.get(), view.finding = &finding, view.test = &test, view.held_out = &held_out, view.train = &train;
  view.left_at_samples = LeftAtSamples();
  if (!finding.terms.empty()) {
    const std::vector<calibration::Dataset> judged{test};
    view.term_torque = verdict::CommonRows(*model, judged, finding.declared).Beyond(diagnosis->TermTorque(test));
  }
  for (const diagnosis::Term& t : finding.terms)
    view.separation.push_back(verdict::Separations(t, finding, *model, catalogue, robot, file));
  WriteJson();
}

// What the terms leave at the samples of the training logs: [n] RMS where the joint moves.
Eigen::VectorXd Diagnosed::LeftAtSamples() const {
  const diagnosis::Finding& finding = diagnosis->finding();
  Eigen::ArrayXd square = Eigen::ArrayXd::Zero(model->joints()), samples = square;
  for (const calibration::Dataset& log : whole_) {
    Eigen::MatrixXd left = log.tau - calibration::Predict(*model, log, finding.x, finding.declared.eta);
    for (const Eigen::MatrixXd& torque : diagnosis->TermTorque(log)) left -= torque;
    const Eigen::ArrayXd own = (log.moving.transpose() * log.scored).cast<double>();  // a joint may rest in a log
    square += own * calibration::Rms(log, left, true).array().square();
    samples += own;
  }
  return (square / samples.max(1)).sqrt();
}

void Diagnosed::WriteJson() {
  json = verdict::DiagnosisJson(view);
  json["fitted_at_turns"] = nlohmann::ordered_json::array();
  for (const int j : diagnosis->finding().at_turns) json["fitted_at_turns"].push_back(j + 1);
  json["torque_channel"] = nlohmann::ordered_json::array();
  for (std::size_t j = 0; j < channel_.size(); ++j)
    if (const calibration::JointChannel& c = channel_[j]; !c.empty())
      json["torque_channel"].push_back(
          {{"joint", j + 1}, {"lag_s", c.lag_s}, {"late_s", c.late_s}, {"low_passes", c.lag_s == 0 ? 0 : c.lags}});
  // Averages of a limited band have less noise than the samples that `before` and `after` are about.
  const auto limited = [this](int j) {
    return std::any_of(whole_.begin(), whole_.end(), [j](const auto& log) { return log.averaged(j); });
  };
  for (int j = 0; j < model->joints(); ++j)
    if (limited(j)) json["noise_floor"][static_cast<std::size_t>(j)] = view.left_at_samples[j];
  for (const calibration::Dataset& log : train) {
    json["cutoff_Hz"].push_back(verdict::ToList(log.cutoff_Hz));
    for (const auto& [key, limits_Hz] : {std::pair{"band_Hz", &log.band_Hz}, std::pair{"saved_Hz", &log.saved_Hz}}) {
      nlohmann::ordered_json& each = json[key].emplace_back(nlohmann::ordered_json::array());
      for (const double limit_Hz : *limits_Hz)
        each.push_back(std::isfinite(limit_Hz) ? nlohmann::ordered_json(limit_Hz) : nlohmann::ordered_json());
    }
  }
}

}  // namespace armcal::analysis

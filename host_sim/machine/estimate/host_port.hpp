// estimate - lib's estimators as one object of a PC program; knows no drive and no log.
#pragma once

#include <memory>
#include <stdexcept>
#include <string>

#include <selected_model.hpp>
#include "armcal/estimator/estimator.hpp"
#include "armcal/estimator/physical_read_out.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/table_file.hpp"

namespace armcal::estimate {

using Model = generated::SelectedModel;
constexpr int n = Model::kJoints;
using Sample = model::Sample<n>;
using BodyReadOut = physical::MapReadOut<Model, double>;

// Both filters of the firmware on one stream of samples, and the bodies that the Kalman filter's result stands for.
class HostPort {
 public:
  explicit HostPort(const std::vector<std::uint16_t>& words) {
    if (words.size() != static_cast<std::size_t>(estimator::Table<Model>::kWords))
      throw io::InputError("table: not of this model's size");
    const core::Status decoded = model::Decode(words.data(), Model::kSchema, table_);
    if (!core::IsOk(decoded))
      throw io::InputError("table: refused as on the drive, status " + std::to_string(static_cast<int>(decoded)));
    const core::Status built = estimator::BuildAdoptedTable<Model>(table_, 1, *rigid_, *adopted_);
    if (!core::IsOk(built))
      throw io::InputError("table: refused as on the drive, status " + std::to_string(static_cast<int>(built)));
    a_->Adopt(*adopted_, 0);
    b_->Adopt(*adopted_, 0);
  }
  void Add(const Sample& s) {
    Run();
    if (!core::IsOk(a_->PushSample(s)) || !core::IsOk(b_->PushSample(s)))
      throw std::logic_error("host port: its own ring is full");
    Run();
  }
  void Finish() {
    a_->RequestReadOut();
    b_->RequestReadOut();
    Run();
    (void)a_->Take(a);
    (void)b_->Take(b);
    const core::Status begun = estimator::BeginPhysical(*adopted_, *rigid_, *b_, false, *bodies_);
    if (!core::IsOk(begun))
      throw io::InputError("physical read-out: refused, status " + std::to_string(static_cast<int>(begun)));
    while (!bodies_->Step()) {
    }
  }
  // Changes of the parameters are larger than the table's deviations allow.
  bool prior_too_narrow() const { return estimator::PriorIsTooNarrow(*bodies_); }
  const BodyReadOut::Result& bodies() const { return bodies_->result(); }
  const estimator::Table<Model>& table() const { return table_; }
  estimator::Estimates<Model> a, b;

 private:
  void Run() {
    while (a_->Step()) {
    }
    while (b_->Step()) {
    }
  }
  estimator::Table<Model> table_;
  std::unique_ptr<estimator::RigidPrior<Model, float>> rigid_ = std::make_unique<estimator::RigidPrior<Model, float>>();
  std::unique_ptr<estimator::AdoptedTable<Model>> adopted_ = std::make_unique<estimator::AdoptedTable<Model>>();
  std::unique_ptr<estimator::Estimator<Model, filter::ForgettingFilter<Model>>> a_ =
      std::make_unique<estimator::Estimator<Model, filter::ForgettingFilter<Model>>>();
  std::unique_ptr<estimator::Estimator<Model, filter::KalmanFilter<Model>>> b_ =
      std::make_unique<estimator::Estimator<Model, filter::KalmanFilter<Model>>>();
  std::unique_ptr<BodyReadOut> bodies_ = std::make_unique<BodyReadOut>();
};

}  // namespace armcal::estimate

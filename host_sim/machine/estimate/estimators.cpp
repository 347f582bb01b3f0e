// estimate - lib's estimators for one model. Compiled once for each model, linked in or loaded.
#include "host_sim/machine/estimate/estimators.hpp"

#include <stdexcept>

#include <selected_model.hpp>
#include "armcal/controller/trace_records.hpp"
#include "armcal/estimator/estimator.hpp"
#include "armcal/estimator/physical_read_out.hpp"
#include "armcal/filter/forgetting_filter.hpp"
#include "armcal/filter/kalman_filter.hpp"

namespace armcal::estimate {
namespace {

template <class Model>
class Compiled final : public Estimators {
 public:
  static constexpr int n = Model::kJoints;

  std::uint32_t schema() const override { return Model::kSchema; }
  int joints() const override { return n; }
  int columns() const override { return Model::kColumns; }
  int bodies() const override { return Model::kBodyParameters; }
  const char* body_name(int k) const override { return Model::kInfo[k].name; }
  double body_in_table(int k) const override { return static_cast<double>(table_.parameter[k].mean); }

  std::string Start(const std::uint16_t* words, int count) override {
    if (count < model::kHeaderWords ||
        !core::IsOk(model::CheckHeading<n, Model::kParameters>(words, count, Model::kSchema)))
      return "table: not of this model's schema and size";
    core::Status status = model::Decode(words, Model::kSchema, table_);
    if (core::IsOk(status)) status = estimator::BuildAdoptedTable<Model>(table_, 1, rigid_, adopted_);
    if (!core::IsOk(status))
      return "table: refused as on the drive, status " + std::to_string(static_cast<int>(status));
    a_.Adopt(adopted_, 0);
    b_.Adopt(adopted_, 0);
    return "";
  }
  void Add(const SampleView& view) override {
    model::Sample<n> sample;
    sample.tick = view.tick;
    for (int j = 0; j < n; ++j) {
      sample.q[j] = view.q[j], sample.qd[j] = view.qd[j], sample.qdd[j] = view.qdd[j];
      sample.tau[j] = view.tau[j], sample.temperature_degC[j] = view.temperature_degC[j];
      sample.flags[j] = view.flags[j];
    }
    Push(sample);
  }
  int AddRecord(std::uint32_t tick, const std::uint16_t* record) override {
    model::Sample<n> sample;
    float tau_model_Nm[n];
    sample.tick = tick;
    controller::ReadSampleRecord<n>(record, sample, tau_model_Nm);
    int used = 0;
    for (int j = 0; j < n; ++j) used += (sample.flags[j] & model::kUsed) != 0;
    Push(sample);
    return used;
  }
  std::string Finish() override {
    a_.RequestReadOut();
    b_.RequestReadOut();
    Run();
    (void)a_.Take(of_a_);
    (void)b_.Take(of_b_);
    const core::Status begun = estimator::HandOverPhysical(adopted_, rigid_, b_, false, bodies_);
    if (!core::IsOk(begun)) return "physical read-out: refused, status " + std::to_string(static_cast<int>(begun));
    while (!bodies_.Step()) {
    }
    return "";
  }
  FilterResult forgetting() const override { return View(of_a_); }
  FilterResult kalman() const override { return View(of_b_); }
  BodiesResult physical() const override {
    const auto& r = bodies_.result();
    return {r.body, r.body_sd, r.converged, estimator::PriorIsTooNarrow(bodies_)};
  }

 private:
  static FilterResult View(const estimator::Estimates<Model>& e) {
    return {e.value, e.sd, e.rows_used, e.rows_outside, e.samples, e.inconsistent};
  }
  void Push(const model::Sample<n>& sample) {
    Run();
    if (!core::IsOk(a_.PushSample(sample)) || !core::IsOk(b_.PushSample(sample)))
      throw std::logic_error("estimators: their own ring is full");
    Run();
  }
  void Run() {
    while (a_.Step()) {
    }
    while (b_.Step()) {
    }
  }

  estimator::Table<Model> table_;
  physical::RigidPrior<Model, float> rigid_;
  estimator::AdoptedTable<Model> adopted_;
  estimator::Estimator<Model, filter::ForgettingFilter<Model>> a_;
  estimator::Estimator<Model, filter::KalmanFilter<Model>> b_;
  physical::MapReadOut<Model, double> bodies_;
  estimator::Estimates<Model> of_a_, of_b_;
};

}  // namespace
}  // namespace armcal::estimate

extern "C" __attribute__((visibility("default"))) armcal::estimate::Estimators* MakeArmcalEstimators(int interface) {
  if (interface != armcal::estimate::kEstimatorsInterface) return nullptr;
  return new armcal::estimate::Compiled<armcal::generated::SelectedModel>;
}

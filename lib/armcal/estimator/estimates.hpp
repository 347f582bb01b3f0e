// estimator - the struct of published estimates, and the row statistics in it.
#pragma once

#include "armcal/estimator/adopted_table.hpp"
#include "armcal/filter/slices.hpp"
#include "armcal/model/sample.hpp"
#include "armcal/monitor/innovations.hpp"
#include "armcal/monitor/residual_statistics.hpp"

namespace armcal::estimator {

// What an estimator publishes. Columns in filter coordinates [front, dense], in their own units.
template <class Model>
struct Estimates {
  std::uint32_t generation = 0;  // of the table that the filter started from
  std::uint32_t tick = 0;        // of the last sample inside
  std::uint32_t samples = 0;     // processed since the adoption
  std::uint32_t stale = 0;       // samples of another table, dropped since the adoption
  std::uint32_t refused = 0;     // samples lost because the ring was full, since power-up
  float value[Model::kColumns] = {};
  float sd[Model::kColumns] = {};
  // Nonlinear parameters. Only an extended filter estimates them. For other filters eta is the committed value and
  // eta_sd is 0.
  float eta[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};
  float eta_sd[Model::kNonlinear > 0 ? Model::kNonlinear : 1] = {};
  std::uint32_t clamps = 0;  // how often an eta was cut to its bound
  std::uint32_t rows_used[Model::kJoints] = {};
  // rows_gated: rows that were not used. Either the row is not valid or its joint does not move; or an effect's memory is
  // not ready; or the gate refused it; or learning is on hold.
  std::uint32_t rows_gated[Model::kJoints] = {};
  std::uint32_t rows_outside[Model::kJoints] = {};  // of these, in motion and outside the gate: see RowGate
  std::uint32_t rows_refused[Model::kJoints] = {};  // not finite or beyond filter::kRowLimit
  float nis[Model::kJoints] = {};                   // see monitor::JointMonitor
  float residual_rms_Nm[Model::kJoints] = {};       // measured minus committed model, used rows
  bool inconsistent = false;                        // the deviations are too small: see monitor::InnovationTest
};

// Fills in values and standard deviations from a filter's read-out, which is in prior units. out.x, out.sd: [kColumns],
// of an extended filter [kColumns + kNonlinear]. Context: background.
template <class Model, class ReadOut>
void FromPriorUnits(const AdoptedTable<Model>& table, const ReadOut& out, Estimates<Model>& estimates) {
  for (int k = 0; k < Model::kColumns; ++k) {
    estimates.value[k] = table.committed.p[k] + table.scale[k] * out.x[k];
    estimates.sd[k] = table.scale[k] * out.sd[k];
  }
  constexpr bool kExtended = sizeof(out.x) > Model::kColumns * sizeof(float);
  for (int e = 0; e < Model::kNonlinear; ++e) {
    estimates.eta[e] = table.committed.eta[e];
    if constexpr (kExtended) {
      estimates.eta[e] = EtaAt(table, e, out.x[Model::kColumns + e]);
      estimates.eta_sd[e] = EtaSlope(table, e, estimates.eta[e]) * out.sd[Model::kColumns + e];
    }
  }
}

// Hands the report of every row to the monitors. Context of every call: background.
template <class Model>
class RowStatistics {
 public:
  static constexpr int n = Model::kJoints;

  // The residual statistics to fill from now on and to restart with each adoption; nullptr: none.
  void SetResiduals(monitor::ResidualStatistics<n>* residuals) { residuals_ = residuals; }

  void Restart(std::uint32_t adopted_tick) {
    for (monitor::JointMonitor& m : monitors_) m = monitor::JointMonitor{};
    ForgetInnovations();
    if (residuals_ != nullptr) residuals_->Restart(adopted_tick);
  }
  // After a reset of the filter: its earlier innovations no longer say anything about it.
  void ForgetInnovations() { test_ = monitor::InnovationTest{}; }

  // One row: the filter's report, residual and load of the committed model, the sample, and whether the row may change
  // an estimate.
  void Add(int i, const filter::UpdateReport& report, float residual_Nm, float load_Nm, const model::Sample<n>& s,
           bool moves, Estimates<Model>& counts) {
    counts.rows_used[i] += report.accepted;
    counts.rows_gated[i] += report.status == core::Status::kGated;
    counts.rows_refused[i] += core::IsRefused(report.status);
    if (report.accepted) {
      monitors_[i].Add(report.innovation, report.variance, residual_Nm);
      test_.Add(report.innovation, report.variance);
    }
    // The residual statistics also take rows that the filter's gate keeps out: a changed arm shows in those.
    if (residuals_ == nullptr) return;
    residuals_->Add(i, {residual_Nm, s.qd[i], s.q[i], load_Nm, s.temperature_degC[i]}, moves);
  }
  void EndSample(std::uint32_t tick) {
    if (residuals_ != nullptr) residuals_->EndSample(tick, static_cast<std::uint32_t>(Model::kTickRate_Hz));
  }

  void Publish(Estimates<Model>& estimates) const {
    for (int i = 0; i < n; ++i) {
      estimates.nis[i] = monitors_[i].nis();
      estimates.residual_rms_Nm[i] = monitors_[i].residual_rms_Nm();
    }
    estimates.inconsistent = test_.inconsistent();
  }

 private:
  monitor::JointMonitor monitors_[n];
  monitor::InnovationTest test_;
  monitor::ResidualStatistics<n>* residuals_ = nullptr;
};

}  // namespace armcal::estimator

// estimator - what the rows since an adoption have shown; knows a row's report, no filter.
#pragma once

#include "armcal/estimator/estimates.hpp"
#include "armcal/estimator/sample_rows.hpp"
#include "armcal/filter/row.hpp"
#include "armcal/monitor/consistency.hpp"
#include "armcal/monitor/monitor.hpp"
#include "armcal/monitor/residual_statistics.hpp"

namespace armcal::estimator {

// Context: background.
template <class Model>
class RowStatistics {
 public:
  static constexpr int n = Model::kJoints;

  // Statistics to fill from now on and to restart with each adoption; nullptr: none.
  void SetResiduals(monitor::ResidualStatistics<n>* residuals) { residuals_ = residuals; }

  void Restart(std::uint32_t adopted_tick) {
    for (monitor::JointMonitor& m : monitors_) m = monitor::JointMonitor{};
    ForgetSurprise();
    if (residuals_ != nullptr) residuals_->Restart(adopted_tick);
  }
  // After a reset of the filter: what surprised it no longer counts, either.
  void ForgetSurprise() { consistency_ = monitor::Consistency{}; }

  // One row: what the filter reports, residual and load of the committed model, the sample, and whether it moves.
  void Add(int i, const filter::UpdateReport& report, float residual_Nm, float load_Nm, const model::Sample<n>& s,
           bool moves, Estimates<Model>& counts) {
    counts.rows_used[i] += report.accepted;
    counts.rows_gated[i] += report.status == core::Status::kGated;
    counts.rows_refused[i] += core::IsRefused(report.status);
    if (report.accepted) {
      monitors_[i].Add(report.innovation, report.variance, residual_Nm);
      consistency_.Add(report.innovation, report.variance);
    }
    // Rows that the filter's gate keeps out count as well: they are what a changed arm looks like.
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
    estimates.inconsistent = consistency_.inconsistent();
  }

 private:
  monitor::JointMonitor monitors_[n];
  monitor::Consistency consistency_;
  monitor::ResidualStatistics<n>* residuals_ = nullptr;
};

}  // namespace armcal::estimator

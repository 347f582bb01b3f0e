// diagnosis - shows what the training logs say of a candidate: its columns, its signals, its excitation.
#pragma once

#include <cmath>
#include <map>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/diagnose/diagnosis/candidate.hpp"
#include "host_sim/diagnose/diagnosis/metric.hpp"
#include "host_sim/diagnose/diagnosis/noise.hpp"

namespace armcal::diagnosis {

// All training logs with the current estimate's model torque.
struct Evidence {
  const codegen::Model* model = nullptr;
  std::vector<Quantities> logs;
  std::vector<RowIndex> index;               // [n] used rows over all logs
  std::vector<Eigen::VectorXd> steady = {};  // [n] of each row: 1 where the sign of friction hardly changes, else 0
};

// The candidate's columns at eta over the used rows of its joints.
Columns GatherColumns(const Candidate& candidate, const Evidence& evidence, const std::vector<double>& eta);

// Columns on thinned rows, for the searches to come: most of them visit the same points.
class KeptColumns {
 public:
  // Null if it has none; the pointer holds until the next Keep.
  const Columns* Find(const Candidate& candidate, const std::vector<double>& eta);
  void Keep(const Candidate& candidate, const std::vector<double>& eta, const Columns& columns);
  // Forgets what nobody has asked for since the last call.
  void ForgetUnused();
  void Clear() { kept_.clear(), values_ = 0; }

 private:
  struct Entry {
    Columns columns;
    bool used = true;
  };
  std::map<std::pair<const Candidate*, std::vector<double>>, Entry> kept_;
  std::size_t values_ = 0;
};

// Every m-th sample of the evidence, for a rough search. The torque about such a sample is averaged, so that little of
// the log is lost. Columns with memory are evaluated at all samples and averaged, too. The others are smooth over so
// short a time and are evaluated at that sample only. Where rows are averages already, every m-th log is kept instead.
struct Thinned {
  // Keeps about `rows` samples a log, or as many averages of a joint. columns: of the same rows, from searches before.
  Thinned(const Evidence& evidence, int rows, KeptColumns& columns);
  Columns Gather(const Candidate& candidate, const std::vector<double>& eta) const;
  Columns GatherAnew(const Candidate& candidate, const std::vector<double>& eta) const;
  // averaged: the noise of these rows. What is whitened here keeps the size of slow columns, which are not whitened.
  BaseRows Average(const BaseRows& all, const std::vector<NoiseModel>& noise, std::vector<NoiseModel>& averaged) const;
  Eigen::MatrixXd AverageRows(const Eigen::MatrixXd& m, int j) const;
  // The noise of an averaged row, and the share of a gain that averaging leaves; both for white noise.
  double noise() const { return 1 / std::sqrt(2.0 * reach + 1); }
  double share() const { return of_logs * (2.0 * reach + 1) / every; }

  const Evidence& all;
  KeptColumns& kept_columns;  // those that no estimate changes
  int every = 1, reach = 0;   // a row stands for the samples that far about it
  double of_logs = 1;         // share of the rows that the kept logs hold
  std::vector<std::unique_ptr<calibration::Dataset>> data;
  std::vector<Quantities> logs;
  std::vector<std::vector<int>> kept;  // [n] places in all.index[j]
  std::vector<RowIndex> index;         // [n] of the shorter logs
};

// A signal of the candidate's joint j ("q", "abs(qd)") or of its other one ("q[k]") in the rows of joint j.
Eigen::VectorXd OwnSignal(const Candidate& candidate, const Evidence& evidence, std::string name);

// A joint with fewer rows shows no term beside the base.
bool HasEnough(const RowIndex& rows);

// The excitation the record asks for is in the logs.
bool IsExcited(const Candidate& candidate, const Evidence& evidence);

}  // namespace armcal::diagnosis

// diagnosis - a candidate's signals over its rows, and whether they show what its record asks for.
#include "host_sim/diagnose/diagnosis/searcher.hpp"

namespace armcal::diagnosis {

using Eigen::VectorXd;

namespace {
constexpr int kFewRows = 200;  // of a joint: too few for terms beside the base
constexpr double kSlow = 0.1;  // of the fastest that was seen is low speed, of the joint's limit is high speed
constexpr int kFewSlowRows = 30;
constexpr double kAboveStiction = 5;  // times v_min: a log that only creeps has no low speed to compare
constexpr double kTempSpan_K = 2;
constexpr double kLoadSpan = 2;  // times the torque's noise
}  // namespace

VectorXd OwnSignal(const Candidate& candidate, const Evidence& evidence, std::string name) {
  int j = candidate.joints().empty() ? candidate.rows()[0] : candidate.joints()[0];
  const RowIndex& index = evidence.index[j];
  const bool size = name.starts_with("abs(");
  if (size) name = name.substr(4, name.size() - 5);
  if (name.ends_with("[k]")) {
    name.resize(name.size() - 3);
    j = candidate.joints().at(1);
  }
  VectorXd out(index.size());
  for (int k = 0; k < index.size(); ++k) {
    const Quantities& log = evidence.logs[index.dataset[k]];
    const auto& s = log.data->s;
    const int at = index.sample[k];
    out[k] = name == "t"      ? s.t[at]
             : name == "q"    ? s.q(at, j)
             : name == "qd"   ? s.qd(at, j)
             : name == "temp" ? (s.temp.cols() > j ? s.temp(at, j) : 0)
                              : log.parts.rigid(at, j);
  }
  return size ? out.cwiseAbs() : out;
}

bool IsExcited(const Candidate& candidate, const Evidence& evidence) {
  const int j = candidate.joints().empty() ? candidate.rows().back() : candidate.joints()[0];
  const auto& joint = evidence.model->robot().joint[j];
  const int rows = evidence.index[j].size();
  if (rows < kFewRows) return false;
  for (const std::string& need : candidate.record().needs) {
    if (need == "low_speed" || need == "high_speed") {
      const VectorXd v = OwnSignal(candidate, evidence, "qd").cwiseAbs();
      const double fastest = v.maxCoeff();
      if (need == "high_speed" && fastest < kSlow * joint.speed_limit_radps) return false;
      if (need == "low_speed" &&
          ((v.array() < kSlow * fastest).count() < kFewSlowRows || fastest < kAboveStiction * joint.v_min_radps))
        return false;
    } else if (need == "temp_span") {
      const VectorXd temp = OwnSignal(candidate, evidence, "temp");
      if (temp.maxCoeff() - temp.minCoeff() < kTempSpan_K) return false;
    } else if (need == "load_span") {
      const VectorXd load = OwnSignal(candidate, evidence, "tau_rigid").cwiseAbs();
      if (load.maxCoeff() - load.minCoeff() < kLoadSpan * joint.torque_noise_Nm) return false;
    }
  }
  return true;
}

}  // namespace armcal::diagnosis

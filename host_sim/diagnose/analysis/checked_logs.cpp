// analysis - checks logs against the model.
#include "host_sim/diagnose/analysis/checked_logs.hpp"

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/calibration/body_check.hpp"
#include "host_sim/identify/calibration/column_check.hpp"
#include "host_sim/identify/calibration/log_check.hpp"
#include "host_sim/identify/calibration/untold.hpp"

namespace armcal::analysis {

namespace {

constexpr double kNarrow = 0.62;  // of the cut-off: half the noise of an acceleration

// Why the log is too little to be fitted alone; empty: it is not.
std::string Lack(const codegen::Model& model, const logs::Log& log, const Say& say) {
  if (log.joints != model.joints()) return {};  // Prepare names what is wrong
  const calibration::SignalCheck check = calibration::CheckSignals(model.robot(), log);
  for (const std::string& note : check.notes) say(log.source + ": " + note);
  return check.lack;
}

std::string Joined(const std::vector<std::string>& faults) {
  std::string text;
  for (const std::string& fault : faults) text += (text.empty() ? "" : "; ") + fault;
  return text;
}

}  // namespace

std::vector<calibration::Dataset> CheckedLogs(const codegen::Model& model, const std::vector<logs::Log>& logs,
                                              double cutoff_Hz, const Say& say) {
  std::vector<calibration::Dataset> out;
  for (const logs::Log& log : logs) {
    const std::string lack = Lack(model, log, say);
    if (lack.empty()) out.push_back(calibration::Prepare(model, log, {cutoff_Hz}));
    else if (logs.size() == 1) throw io::InputError(log.source + ": " + lack);
    else say(log.source + ": left out: " + lack);
  }
  if (out.empty()) throw io::InputError(logs[0].source + " and others: none is long enough to be fitted");
  const std::vector<const calibration::Dataset*> data = calibration::Pointers(out);
  for (const std::string& note : calibration::CheckRows(model.robot(), data)) say(note);
  for (const std::string& note : calibration::CheckColumns(model, data)) say(note);
  for (const calibration::Dataset* log : data)
    for (const std::string& note : calibration::CheckAgainstModel(model, *log)) say(note);
  return out;
}

std::vector<calibration::Dataset> NarrowLogs(const codegen::Model& model, const std::vector<logs::Log>& logs,
                                             double cutoff_Hz) {
  const Say nothing = [](const std::string&) {};
  std::vector<calibration::Dataset> out;
  for (const logs::Log& log : logs)
    if (logs.size() == 1 || Lack(model, log, nothing).empty())
      out.push_back(calibration::Prepare(model, log, {cutoff_Hz, kNarrow}));
  return out;
}

std::vector<std::string> Untold(const codegen::Model& model, const std::vector<calibration::Dataset>& data) {
  std::vector<std::string> out;
  if (model.robot().has_prior) return out;
  if (const std::string text = Joined(calibration::UntoldFaults(model)); !text.empty())
    out.push_back("cannot be told without link data: " + text);
  if (const std::string text = Joined(calibration::EquallyGood(model, calibration::Pointers(data))); !text.empty())
    out.push_back("cannot be told from these logs: " + text);
  return out;
}

}  // namespace armcal::analysis

// excitation - the weighted regressor, its Gram matrix and its condition number.
#include "host_sim/identify/excitation/observation.hpp"

#include <algorithm>

#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/excitation/criterion.hpp"

namespace armcal::excitation {
namespace {

constexpr Eigen::Index kPiece = 1024;  // samples evaluated at once, since the rows of a minute would fill the memory

bool MotionShows(const codegen::Model& model, const std::string& effect) {
  for (const codegen::EffectInstance& e : model.effects())
    if (e.record->name == effect) return excitation::MotionShows(*e.record);
  return true;
}

codegen::Signals Piece(const codegen::Signals& s, Eigen::Index begin, Eigen::Index count) {
  codegen::Signals piece;
  piece.t = s.t.segment(begin, count);
  piece.q = s.q.middleRows(begin, count);
  piece.qd = s.qd.middleRows(begin, count);
  piece.qdd = s.qdd.middleRows(begin, count);
  return piece;
}

// Calls visit(first sample, rows of the piece) for every piece of the motion.
template <class Visit>
void ForEachPiece(const Observation& observation, const codegen::Signals& s, Visit visit) {
  std::vector<Eigen::MatrixXd> row;
  for (Eigen::Index begin = 0; begin < s.q.rows(); begin += kPiece) {
    observation.Rows(Piece(s, begin, std::min(kPiece, s.q.rows() - begin)), row);
    visit(begin, row);
  }
}

Eigen::VectorXd MeanOfColumns(const codegen::Model& model) {
  Eigen::VectorXd bodies(model.body_parameters()), mean(model.columns());
  for (int p = 0; p < bodies.size(); ++p) bodies[p] = model.table()[p].mean;
  for (int c = 0; c < mean.size(); ++c)
    if (!model.is_rigid(c)) mean[c] = model.table()[model.table_index(c)].mean;
  mean.segment(model.front(), model.rigid()) = model.base_map() * bodies;
  return mean;
}

}  // namespace

bool MotionShows(const codegen::EffectRecord& record) {
  return record.effect_class == codegen::EffectClass::kStatic &&
         !record.inputs.contains(codegen::Quantity::kTemperature) && !record.inputs.contains(codegen::Quantity::kTime);
}

Observation::Observation(const codegen::Model& model, Rotors rotors) : model_(model), mean_(MeanOfColumns(model)) {
  for (int c = 0; c < model.columns(); ++c) {
    if (model.is_rigid(c)) {
      if (rotors == Rotors::kAsked || !model.column_name(c).starts_with("Ia")) column_.push_back(c);
      continue;
    }
    const codegen::TableParameter& parameter = model.table()[model.table_index(c)];
    if (parameter.state != "estimated") continue;
    if (MotionShows(model, parameter.effect)) column_.push_back(c);
    else left_out_.push_back(parameter.name);
  }
}

double Observation::weight(int joint) const {
  const double noise = model_.robot().joint[joint].torque_noise_Nm;
  return 1 / (noise * noise);
}

void Observation::Rows(const codegen::Signals& s, std::vector<Eigen::MatrixXd>& row) const {
  model_.Regressor(s, {mean_.data(), static_cast<std::size_t>(mean_.size())}, {}, row);
}

Eigen::MatrixXd Observation::Torque(const codegen::Signals& s) const {
  Eigen::MatrixXd torque(s.q.rows(), model_.joints());
  ForEachPiece(*this, s, [&](Eigen::Index begin, const std::vector<Eigen::MatrixXd>& row) {
    for (int i = 0; i < model_.joints(); ++i) torque.col(i).segment(begin, row[i].rows()) = row[i] * mean_;
  });
  return torque;
}

Eigen::MatrixXd Observation::Gram(const std::vector<Eigen::MatrixXd>& row, Eigen::Index samples) const {
  Eigen::MatrixXd all = Eigen::MatrixXd::Zero(model_.columns(), model_.columns());
  for (int i = 0; i < model_.joints(); ++i)
    all.selfadjointView<Eigen::Lower>().rankUpdate(row[i].topRows(samples).transpose(), weight(i));
  all.triangularView<Eigen::StrictlyUpper>() = all.transpose();
  return all(column_, column_);
}

Eigen::MatrixXd Observation::Gram(const codegen::Signals& s) const {
  const auto asked = static_cast<Eigen::Index>(column_.size());
  Eigen::MatrixXd gram = Eigen::MatrixXd::Zero(asked, asked);
  ForEachPiece(*this, s,
               [&](Eigen::Index, const std::vector<Eigen::MatrixXd>& row) { gram += Gram(row, row[0].rows()); });
  return gram;
}

double Observation::ConditionNumber(const codegen::Signals& s) const { return Figure({}, Gram(s)); }

std::vector<int> Observation::Places(const std::vector<std::string>& effects) const {
  std::vector<int> places;
  for (const std::string& name : effects) {
    const auto colon = name.find(':');
    const std::string effect = name.substr(0, colon), joint = colon == name.npos ? "" : name.substr(colon + 1);
    const std::size_t before = places.size();
    for (std::size_t k = 0; k < column_.size(); ++k) {
      if (model_.is_rigid(column_[k])) continue;
      const codegen::TableParameter& p = model_.table()[model_.table_index(column_[k])];
      if (p.effect == effect && (joint.empty() || joint == std::to_string(p.joint + 1)))
        places.push_back(static_cast<int>(k));
    }
    if (places.size() == before)
      throw io::InputError(model_.robot().path + ": no estimated column of " + name +
                           "; expected an effect that motion alone shows: no temperature, time or memory");
  }
  return places;
}

}  // namespace armcal::excitation

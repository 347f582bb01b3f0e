// excitation - turns effects that the user names into estimated effects of a robot in memory.
#include "host_sim/identify/excitation/target.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <sstream>

#include "codegen/src/io/input_error.hpp"

namespace armcal::excitation {
namespace {

struct Wanted {
  std::string record;
  std::vector<int> joints;  // 0-based; empty: all that the record can have
};

Wanted Parse(const std::string& name) {
  const auto colon = name.find(':');
  Wanted wanted{name.substr(0, colon), {}};
  if (colon == name.npos) return wanted;
  std::istringstream numbers(name.substr(colon + 1));
  bool good = true;
  for (std::string number; std::getline(numbers, number, '-');) {
    const auto digit = [](unsigned char c) { return c >= '0' && c <= '9'; };
    good = good && !number.empty() && number.size() < 4 && std::all_of(number.begin(), number.end(), digit);
    if (good) wanted.joints.push_back(std::stoi(number) - 1);
  }
  if (!good || wanted.joints.empty())
    throw io::InputError(name + ": expected record, record:joint or record:joint-joint");
  return wanted;
}

// An instance that the robot already has keeps its values, unless others were found.
void Estimate(const codegen::EffectRecord& record, const std::vector<int>& joints,
              const std::vector<codegen::EffectUse>& found, codegen::Robot& robot) {
  codegen::EffectUse use;
  use.effect = record.name;
  for (codegen::EffectUse& known : robot.effect) {
    const bool of_joint = record.scope == codegen::EffectScope::kJoint &&
                          std::count(known.joints.begin(), known.joints.end(), joints[0]) > 0;
    if (known.effect != record.name || (known.joints != joints && !of_joint)) continue;
    use = known;
    if (of_joint) std::erase(known.joints, joints[0]);  // else it would be there twice, where a record may repeat
    else known.effect.clear();
  }
  std::erase_if(robot.effect, [&](const codegen::EffectUse& known) {
    return known.effect.empty() || (known.effect == record.name && known.joints.empty() && !joints.empty());
  });
  for (const codegen::EffectUse& f : found)
    if (f.effect == record.name && f.joints == joints) use.nonlinear = f.nonlinear;
  use.joints = joints;
  use.state = "estimated";
  robot.effect.push_back(use);
}

void Add(const std::string& name, const codegen::Catalogue& records, const std::vector<codegen::EffectUse>& values,
         codegen::Robot& robot) {
  const Wanted wanted = Parse(name);
  const codegen::EffectRecord& record = codegen::FindRecord(records, name, wanted.record);
  if (record.friction_law) return;  // every model has it
  bool found = false;
  for (const std::vector<int>& joints : codegen::JointSets(record, robot.joints())) {
    if (!wanted.joints.empty() && joints != wanted.joints) continue;
    Estimate(record, joints, values, robot);
    found = true;
  }
  if (!found)
    throw io::InputError(name + ": expected joints of " + robot.name + " (1 to " + std::to_string(robot.joints()) +
                         ") that " + wanted.record + " can have");
}

// Random states, slow ones among them. No path has them all, so effects that they do not tell apart, no motion does.
codegen::Signals AnyStates(const codegen::Robot& robot) {
  constexpr int kSamples = 1500;
  std::mt19937_64 random(1);
  const auto share = [&] { return 2 * (static_cast<double>(random() >> 11) * 0x1p-53) - 1; };
  codegen::Signals s;
  s.t.setZero(kSamples);
  s.q.resize(kSamples, robot.joints()), s.qd = s.q, s.qdd = s.q;
  for (int j = 0; j < robot.joints(); ++j) {
    const codegen::Joint& joint = robot.joint[j];
    const double lower = joint.position_limit_rad[0], upper = joint.position_limit_rad[1];
    for (int k = 0; k < kSamples; ++k) {
      s.q(k, j) = 0.5 * (lower + upper) + 0.5 * (upper - lower) * share();
      s.qd(k, j) = joint.speed_limit_radps * std::pow(share(), 3);
      s.qdd(k, j) = joint.acceleration_limit_radps2 * share();
    }
  }
  return s;
}

}  // namespace

Target::Target(const codegen::Robot& robot, const codegen::Catalogue& records, Criterion::Kind kind)
    : model_(std::make_unique<codegen::Model>(robot, records)),
      observation_(std::make_unique<Observation>(*model_)),
      criterion_{kind, {}} {}

Target::Target(codegen::Robot robot, const codegen::Catalogue& records, const std::vector<std::string>& effects,
               const std::vector<codegen::EffectUse>& found) {
  std::vector<std::string> asked;  // as Places names them: a column that several joints share belongs to none of them
  for (const std::string& name : effects) {
    Add(name, records, found, robot);
    const Wanted wanted = Parse(name);
    asked.push_back(wanted.joints.size() > 1 ? wanted.record : name);
  }
  model_ = std::make_unique<codegen::Model>(robot, records);
  observation_ = std::make_unique<Observation>(*model_);
  criterion_ = {Criterion::Kind::kAccuracy, observation_->Places(asked)};
}

Target Target::Friction(const codegen::Robot& robot, const codegen::Catalogue& records) {
  Target target(robot, records, {"stribeck"});
  target.criterion_.about.clear();
  const codegen::Model& model = *target.model_;
  const std::vector<int>& columns = target.observation_->columns();
  for (std::size_t k = 0; k < columns.size(); ++k) {
    if (model.is_rigid(columns[k])) continue;
    const codegen::EffectRecord& record = records.at(model.table()[model.table_index(columns[k])].effect);
    if (record.friction_law || !record.replaces.empty() || record.name == "stribeck")
      target.criterion_.about.push_back(static_cast<int>(k));
  }
  return target;
}

bool CanSeparate(const codegen::Robot& robot, const codegen::Catalogue& records,
                 const std::vector<std::string>& effects, const std::vector<codegen::EffectUse>& found) {
  try {
    const Target target(robot, records, effects, found);
    return std::isfinite(Figure(target.criterion(), target.observation().Gram(AnyStates(robot))));
  } catch (const io::InputError&) {  // motion alone does not show one of them
    return false;
  }
}

const char* Name(Criterion::Kind kind) {
  constexpr const char* kName[] = {"cond(K)", "geometric mean sd of all axes of K", "geometric mean sd"};
  return kName[static_cast<int>(kind)];
}

}  // namespace armcal::excitation

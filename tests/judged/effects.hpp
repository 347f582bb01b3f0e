// judged set - computes from physics what a declared model may lack. It uses no effect record.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "tests/judged/arm.hpp"

namespace armcal::judged {

// One effect of one draw: its torque along any motion of the arm, before it is scaled to a size.
struct Effect {
  std::string kind;
  nlohmann::json joint;                                  // 3, "5-6", "all", "flange", "base"
  nlohmann::json also_joints = nlohmann::json::array();  // that say the same
  std::vector<std::string> accept, signals;              // names that say the same; what it depends on
  bool held_by_a_record = true;                          // false: no record has this form exactly
  bool needs_temperature = false, run_state = false;
  int seen_on = 0;  // the joint whose visible part is scaled
  // Where a record has exactly this form: its parameter that is the factor of this torque, and its other ones.
  std::string factor;
  std::map<std::string, double> others;
  // Where a larger effect is not the same torque times a number: what makes it larger, and its largest value.
  std::shared_ptr<double> strength;
  double most = 0;
  std::shared_ptr<double> Strength(double first, double largest) {
    most = largest;
    return strength = std::make_shared<double>(first);
  }
  // links: LinkTorque of the motion, [samples x joints].
  std::function<Eigen::MatrixXd(const Motion& motion, const Eigen::MatrixXd& links)> torque;
};

using Curve = std::function<Eigen::ArrayXd(const Motion& motion, const Eigen::MatrixXd& links, int joint)>;
// Makes an effect that acts on joint `joint` (from 0). Signals end in its number, sgn(qd) becomes sgn(qd3).
void OnJoint(Effect& effect, int joint, const Curve& curve);

inline std::string Signal(const std::string& name, int j) { return name + std::to_string(j + 1); }
inline Eigen::ArrayXd Q(const Motion& m, int j) { return m.q.col(j); }
inline Eigen::ArrayXd V(const Motion& m, int j) { return m.qd.col(j); }
inline Eigen::ArrayXd S(const Motion& m, int j) { return Sign(m.qd.col(j)); }

// A smooth function of a joint's position that no single record holds: three bumps.
std::function<Eigen::ArrayXd(const Eigen::ArrayXd&)> Bumps(plant::Random& random);
// A joint's largest load on the first motion that is asked for, the training's: a property of the gear from then on.
std::function<double(const Eigen::ArrayXd& load)> LargestLoad();

// Kinds that DrawEffect knows.
const std::vector<std::string>& Kinds();
Effect DrawEffect(const std::string& kind, const Arm& arm, plant::Random& random);
// One that no record holds: a bump of speed, a product of two joints' positions, ...
Effect DrawUnknown(const Arm& arm, plant::Random& random);

}  // namespace armcal::judged

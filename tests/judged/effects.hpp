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
  nlohmann::json joint;                      // 3, "5-6", "all", "flange", "base"
  std::vector<std::string> accept, signals;  // names that say the same; what it depends on
  bool held_by_a_record = true;              // false: no record has this form exactly
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

// Kinds that DrawEffect knows.
const std::vector<std::string>& Kinds();
Effect DrawEffect(const std::string& kind, const Arm& arm, plant::Random& random);
// One that no record holds: a bump of speed, a product of two joints' positions, ...
Effect DrawUnknown(const Arm& arm, plant::Random& random);

}  // namespace armcal::judged

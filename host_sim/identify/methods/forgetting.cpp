// methods - exponential forgetting, (23) for linear and (24) for nonlinear models, as the survey prints it.
#include "codegen/src/io/input_error.hpp"
#include "host_sim/identify/methods/classic_methods.hpp"
#include "host_sim/identify/methods/online_filter.hpp"

namespace armcal::calibration {

Solution Forgetting(const Problem& problem) {
  if (!(problem.forgetting > 0 && problem.forgetting <= 1))
    throw io::InputError("exponential forgetting: expected mu of (23) in (0, 1], not " +
                         std::to_string(problem.forgetting));
  return RunOnline(problem, problem.forgetting);
}

}  // namespace armcal::calibration

// budget - the example arm's regressor as the target compiles it, all that the estimator asks for; to be counted.
#include "selected_model.hpp"

using Model = armcal::generated::SelectedModel;
static_assert(Model::kStates == 0, "the budget is that of a model without memory");

extern "C" void armcal_regressor(const armcal::model::ModelInput<float, Model::kJoints>& x, float* front,
                                 float* dense) {
  Model::Regressor<float>(x, nullptr, nullptr, nullptr, nullptr, front, dense);
}

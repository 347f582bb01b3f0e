// tests - a firmware that forgets the required flags: CMake compiles it with the compiler's own and GNU's C++17.
#include "codegen/generated/er20_like/model.hpp"

#include "armcal/estimator/adopted_table.hpp"
#include "port/runner/line.hpp"

using Model = armcal::generated::Er20Like;

int Program() {
  static armcal::physical::RigidPrior<Model, float> rigid;
  static armcal::estimator::AdoptedTable<Model> adopted;
  const auto status = armcal::estimator::BuildAdoptedTable(armcal::estimator::DefaultTable<Model>(), 1, rigid, adopted);
  armcal::port::runner::Line("table").Decimal(static_cast<std::uint32_t>(status)).End();
  return armcal::core::IsOk(status) ? 0 : 1;
}

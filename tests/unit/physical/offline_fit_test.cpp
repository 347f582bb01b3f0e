// physical - the read-out against the offline fit, and of many draws of data.
#include <gtest/gtest.h>

#include "codegen/generated/er20_like/model.hpp"
#include "host_sim/identify/calibration/barrier_fit.hpp"
#include "tests/unit/physical/read_out_case.hpp"

namespace armcal::physical {
namespace {
using namespace test;  // NOLINT: the bench of these tests
using Six = generated::Er20Like;

// The offline method's own fit of the same information, made by dense inverses.
calibration::BarrierFit Offline(const codegen::Model& model, const Case<Six>& c) {
  calibration::BarrierProblem problem;
  const int size = Six::kColumns;
  std::vector<int> active;
  for (int k = 0; k < size; ++k)
    if (c.adopted->prior.active[k]) active.push_back(k);
  const Vector scale = Eigen::Map<const Eigen::VectorXf>(c.adopted->scale, size).cast<double>();
  const Matrix p = Covariance(c.ud.data(), size)(active, active),
               p0 = Covariance(c.Before().data(), size)(active, active);
  const Vector x = Eigen::Map<const Eigen::VectorXf>(c.x.data(), size).cast<double>()(active);
  const Vector inverse = scale(active).cwiseInverse();
  const Matrix information = p.inverse() - p0.inverse();
  calibration::DataTerm at;  // about x = b0
  at.gradient = Vector::Zero(size);
  at.hessian = Matrix::Zero(size, size);
  at.gradient(active) = -(inverse.asDiagonal() * (p.inverse() * x));
  at.hessian(active, active) = inverse.asDiagonal() * information * inverse.asDiagonal();

  problem.model = &model;
  problem.bodies = Eigen::Map<const Eigen::VectorXf>(c.rigid->mean, 66).cast<double>();
  problem.bodies_sd = Eigen::Map<const Eigen::VectorXf>(c.rigid->sd, 66).cast<double>();
  problem.x = Eigen::Map<const Eigen::VectorXf>(c.adopted->committed.p, size).cast<double>();
  problem.x_sd = scale;
  problem.data = [at](const Vector&, bool) { return at; };
  return calibration::FitWithBarrier(problem);
}

TEST(MapReadOut, OfAnyAmountOfData_IsTheOfflineFit) {
  const codegen::Model model(codegen::ReadRobot("codegen/robots/er20_like.toml"),
                             codegen::ReadCatalogue("codegen/effects"));
  auto read_out = std::make_unique<ReadOut<Six>>();
  for (const double weight : {0.03, 0.3, 3.0}) {
    const auto c = Draw<Six>(11, weight, 0.5);
    const auto& got = Solve(*read_out, *c);
    const calibration::BarrierFit expected = Offline(model, *c);
    ASSERT_TRUE(got.converged && expected.converged) << weight;
    // The offline fit stops where 1e-7 of chi^2 is left: 3e-4 standard deviations.
    EXPECT_LT(Distance(*c, got.body, expected.bodies.data()), 2e-3) << weight;
    for (int k = 0; k < 66; ++k) EXPECT_NEAR(got.body_sd[k], expected.bodies_sd(k), 1e-3 * c->rigid->sd[k]) << k;
    for (int k = 0; k < Six::kColumns; ++k) {
      const double sd = std::sqrt(expected.covariance(k, k)), scale = c->adopted->scale[k];
      EXPECT_NEAR(got.column[k], expected.x(k), 2e-3 * scale + 1e-5 * std::abs(expected.x(k))) << weight << " " << k;
      EXPECT_NEAR(got.column_sd[k], sd, 1e-2 * sd) << weight << " " << k;
    }
  }
}

TEST(MapReadOut, OfAnyData_IsPhysical) {
  auto read_out = std::make_unique<ReadOut<Six>>();
  int converged = 0, draws = 0;
  for (unsigned seed = 0; seed < 25; ++seed)
    for (const double weight : {0.1, 1.0, 30.0, 1e4})
      for (const double size : {0.3, 2.0}) {
        const auto c = Draw<Six>(seed, weight, size);
        const auto& got = Solve(*read_out, *c);
        EXPECT_TRUE(PhysicalInATable<Six>(got.body)) << seed << " " << weight << " " << size;
        // Data a thousand times sharper than the prior may stand for a body that cannot exist at any price.
        if (weight > 1 || size > 1) continue;
        converged += got.converged;
        ++draws;
      }
  EXPECT_EQ(converged, draws);
}

}  // namespace
}  // namespace armcal::physical

// generator - dots each link's wrench per unit of a parameter with the joints' screws.
//
// Body j's wrench is linear in its parameters: f = m a + U mc, n = I alpha + w x (I w) + mc x a, with
// U = [alpha]x + [w]x[w]x. Joint i sees tau_i = z_i . n + v_i . f, where (z_i, v_i) is its screw about the body's
// origin. Carrying six components of a screw outward takes less work than carrying ten wrenches inward; carrying some
// of them inward a little, to axes in which the screws of several joints are nearly unit vectors, takes less still.
#include "codegen/src/generator/arm_vectors.hpp"

namespace armcal::codegen {

BodyRows BodyRegressor(Graph& g, const Robot& robot, bool motion, const FrameChoice& choice) {
  const int n = robot.joints();
  BodyRows row(n, std::vector<Expr>(kBodyBlock * n, g.Constant(0)));
  ArmVectors arm(g, robot, motion, choice);
  for (int j = 0; j < n; ++j)
    for (int i = 0; i <= j; ++i)
      for (int p = 0; p < kBodyBlock; ++p) row[i][kBodyBlock * j + p] = arm.Torque(i, j, p, choice.axes[i * n + j]);
  return row;
}

BodyRows BodyRegressor(Graph& graph, const Robot& robot, bool motion) {
  if (motion) return BodyRegressor(graph, robot, true, BestFrames(robot));
  FrameChoice choice = LocalFrames(robot);
  choice.slide_m = BestSlides(robot);
  return BodyRegressor(graph, robot, false, choice);
}

Eigen::MatrixXd SlideMap(const Robot& robot, const std::vector<double>& slide_m) {
  const int n = robot.joints();
  Eigen::MatrixXd S = Eigen::MatrixXd::Identity(kBodyBlock * n, kBodyBlock * n);
  for (int j = 0; j < n; ++j) {
    const double d = -slide_m[j];  // the file's origin seen from the slid one: (0, 0, d)
    const int b = kBodyBlock * j;
    S(b + 3, b + 0) = d;                 // mz
    for (const int diagonal : {4, 7}) {  // Ixx, Iyy
      S(b + diagonal, b + 0) = d * d;
      S(b + diagonal, b + 3) = 2 * d;
    }
    S(b + 6, b + 1) = -d;  // Ixz
    S(b + 8, b + 2) = -d;  // Iyz
  }
  return S;
}

Eigen::MatrixXd SlideMap(const Robot& robot) { return SlideMap(robot, BestSlides(robot)); }

}  // namespace armcal::codegen

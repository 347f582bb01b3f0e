// generator - searches the axes in which the base regressor takes the fewest operations.
#include <algorithm>
#include <cmath>
#include <map>
#include <mutex>
#include <numbers>
#include <span>
#include <sstream>
#include <unordered_map>

#include "codegen/src/generator/arm_vectors.hpp"
#include "codegen/src/generator/base_parameters.hpp"

namespace armcal::codegen {
namespace {

// Counting again and again over one growing graph; a unary minus is free, as in the emitted text.
class OperationCounter {
 public:
  explicit OperationCounter(const Graph& graph) : graph_(graph) {}

  int Count(std::span<const Expr> roots) {
    const auto& nodes = graph_.nodes();
    seen_.resize(nodes.size(), 0);
    ++pass_;
    int count = 0;
    for (const Expr& r : roots) stack_.push_back(r.id());
    while (!stack_.empty()) {
      const int id = stack_.back();
      stack_.pop_back();
      if (id < 0 || seen_[id] == pass_) continue;
      seen_[id] = pass_;
      const Node& n = nodes[id];
      if (n.op == Op::kInput) continue;
      count += n.op == Op::kAdd || n.op == Op::kSubtract || n.op == Op::kMultiply;
      stack_.push_back(n.a), stack_.push_back(n.b);
    }
    return count;
  }

 private:
  const Graph& graph_;
  std::vector<int> seen_, stack_;
  int pass_ = 0;
};

// Counts one choice after the other over one graph that keeps every product tried so far.
class Trial {
 public:
  Trial(const Robot& robot, const std::vector<int>& base, const FrameChoice& start)
      : n_(robot.joints()), base_(base), arm_(graph_, robot, true, start), counter_(graph_) {}

  int Count(const FrameChoice& choice) {
    roots_.clear();
    for (const int c : base_)
      for (int i = 0, j = c / kBodyBlock; i <= j; ++i) roots_.push_back(Torque(i, c, choice.axes[i * n_ + j]));
    return counter_.Count(roots_);
  }

 private:
  using Axes = std::array<int, FrameChoice::kParts>;

  Expr Torque(int i, int c, const Axes& axes) {
    std::size_t place = static_cast<std::size_t>(i) * kBodyBlock * n_ + c;
    for (const int half : axes) place = place * 2 * n_ + half;
    const auto [it, fresh] = torque_.try_emplace(place);
    if (fresh) it->second = arm_.Torque(i, c / kBodyBlock, c % kBodyBlock, axes);
    return it->second;
  }

  int n_;
  const std::vector<int>& base_;
  Graph graph_;
  ArmVectors arm_;
  OperationCounter counter_;
  std::unordered_map<std::size_t, Expr> torque_;
  std::vector<Expr> roots_;
};

int CountOnce(const Robot& robot, const std::vector<int>& base, const FrameChoice& choice) {
  return Trial(robot, base, choice).Count(choice);
}

// Coordinate descent. Rows and links share the vectors that are carried, so a move takes some parts of one link, or of
// all links from it outward, in all rows; then of one row. Axes that a quarter turn takes into each other cost the
// same.
int ImproveAxes(const Robot& robot, const std::vector<int>& base, FrameChoice& choice) {
  const int n = robot.joints();
  Trial trial(robot, base, choice);
  int best = trial.Count(choice);
  const auto try_moving = [&](int first_row, int last_row, int first_link, int last_link, unsigned parts, int half) {
    FrameChoice candidate = choice;
    for (int j = first_link; j <= last_link; ++j)
      for (int i = first_row; i <= std::min(j, last_row); ++i)
        for (int part = 0; part < FrameChoice::kParts; ++part)
          if (parts >> part & 1u) candidate.axes[i * n + j][part] = std::clamp(half, 2 * i, 2 * j + 1);
    if (candidate.axes == choice.axes) return;
    const int count = trial.Count(candidate);
    if (count < best) best = count, choice = candidate;
  };
  std::vector<int> halves;
  for (int j = 0; j < n; ++j) {
    const double quarters = robot.joint[j].kinematics.alpha_rad / (std::numbers::pi / 2);
    if (std::abs(quarters - std::round(quarters)) > 1e-12) halves.push_back(2 * j);
    halves.push_back(2 * j + 1);
  }
  for (int before = best + 1; best < before;) {
    before = best;
    for (int last = n - 1; last >= 0; --last)
      for (int first = last; first >= 0; --first)
        for (unsigned parts = 1; parts < 1u << FrameChoice::kParts; ++parts)
          for (const int half : halves) try_moving(0, last, first, last, parts, half);
    for (int j = n - 1; j >= 0; --j)
      for (int i = 0; i <= j; ++i)
        for (int part = 0; part < FrameChoice::kParts; ++part)
          for (const int half : halves) try_moving(i, i, j, j, 1u << part, half);
  }
  return best;
}

// The inputs that decide, every digit.
std::string KinematicsKey(const Robot& robot) {
  std::ostringstream key;
  key << std::hexfloat << robot.parameters.standard << ' ';
  for (const auto& columns : {robot.parameters.prefer, robot.parameters.omit}) {
    for (const int c : columns) key << c << ' ';
    key << '|';
  }
  for (const Joint& j : robot.joint) {
    const JointKinematics& k = j.kinematics;
    key << static_cast<int>(k.type) << ' ' << k.alpha_rad << ' ' << k.a_m << ' ' << k.d_m << ' ' << k.theta_rad << ' ';
  }
  return key.str();
}

std::string Key(const Robot& robot) {
  std::ostringstream key;
  key << std::hexfloat << KinematicsKey(robot);
  for (const double v : robot.base_rotation) key << v << ' ';
  for (const double v : robot.gravity_mps2) key << v << ' ';
  return key.str();
}

template <class T, class F>
T Remembered(const std::string& key, F find) {
  static std::mutex mutex;
  static std::map<std::string, T> known;
  const std::lock_guard<std::mutex> lock(mutex);
  const auto [it, fresh] = known.try_emplace(key);
  if (fresh) it->second = find();
  return it->second;
}

std::vector<int> BaseColumns(const Robot& robot, const FrameChoice& choice) {
  Graph graph;
  return IndependentColumns(graph, BodyRegressor(graph, robot, true, choice), robot);
}

// The run of parallel axes that link j belongs to is turned in one step where that saves work.
void ImproveLumping(const Robot& robot, const std::vector<int>& base, FrameChoice& choice) {
  int best = CountOnce(robot, base, choice);
  for (int j = 1; j < robot.joints(); ++j) {
    FrameChoice candidate = choice;
    candidate.lumped[j] = true;
    const int count = CountOnce(robot, base, candidate);
    if (count < best) best = count, choice = candidate;
  }
}

// Slides give the parameters their meaning, so they must not depend on gravity.
std::vector<double> FindSlides(Robot robot) {
  robot.base_rotation = Robot().base_rotation;
  robot.gravity_mps2 = {0, 0, -9.81};
  FrameChoice choice = LocalFrames(robot);
  if (robot.parameters.standard) return choice.slide_m;
  const std::vector<int> base = BaseColumns(robot, choice);
  ImproveLumping(robot, base, choice);
  const auto count = [&](FrameChoice candidate) { return ImproveAxes(robot, base, candidate); };
  // Who names a link's parameters means them about the file's frame.
  const auto named = [&](int j) {
    const auto of_link = [j](int c) { return c / kBodyBlock == j && c % kBodyBlock != kBodyBlock - 1; };
    const auto& [standard, prefer, omit] = robot.parameters;
    return std::any_of(prefer.begin(), prefer.end(), of_link) || std::any_of(omit.begin(), omit.end(), of_link);
  };
  int best = count(choice);
  for (int j = robot.joints() - 1; j > 0; --j) {
    const double d = robot.joint[j].kinematics.d_m;
    if (robot.joint[j].kinematics.type != JointType::kRevolute || d == 0 || named(j)) continue;
    FrameChoice candidate = choice;
    candidate.slide_m[j] = -d;
    if (const int now = count(candidate); now < best) best = now, choice = candidate;
  }
  return choice.slide_m;
}

FrameChoice SearchFrames(const Robot& robot) {
  FrameChoice choice = LocalFrames(robot);
  choice.slide_m = BestSlides(robot);
  const std::vector<int> base = BaseColumns(robot, choice);
  ImproveLumping(robot, base, choice);
  ImproveAxes(robot, base, choice);
  return choice;
}

}  // namespace

FrameChoice LocalFrames(const Robot& robot) {
  const int n = robot.joints();
  FrameChoice choice;
  choice.slide_m.assign(n, 0);
  choice.lumped.assign(n, false);
  choice.axes.resize(n * n);
  for (int i = 0; i < n; ++i)
    for (int j = i; j < n; ++j) choice.axes[i * n + j].fill(2 * j + 1);
  return choice;
}

std::vector<double> BestSlides(const Robot& robot) {
  return Remembered<std::vector<double>>(KinematicsKey(robot), [&] { return FindSlides(robot); });
}

FrameChoice BestFrames(const Robot& robot) {
  return Remembered<FrameChoice>(Key(robot), [&] { return SearchFrames(robot); });
}

}  // namespace armcal::codegen

// survey - Figures 1, 2 and 3: the joint frames of the arm, the trajectories, and a diagram of the platform.
#include <Eigen/Geometry>
#include <cmath>

#include <fmt/format.h>

#include "host_sim/data/report/canvas.hpp"
#include "host_sim/study/survey/platform.hpp"
#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {
namespace {

// Frames 0 to n at q = 0, seen from frame 0.
std::vector<Eigen::Isometry3d> Frames(const codegen::Robot& robot) {
  std::vector<Eigen::Isometry3d> frame{Eigen::Isometry3d::Identity()};
  for (const codegen::Joint& joint : robot.joint) {
    const codegen::JointKinematics& k = joint.kinematics;
    Eigen::Isometry3d next = frame.back();
    next.rotate(Eigen::AngleAxisd(k.alpha_rad, Eigen::Vector3d::UnitX())).translate(Eigen::Vector3d(k.a_m, 0, 0));
    next.rotate(Eigen::AngleAxisd(k.theta_rad, Eigen::Vector3d::UnitZ())).translate(Eigen::Vector3d(0, 0, k.d_m));
    frame.push_back(next);
  }
  return frame;
}

struct Sheet2d {
  double scale, left, bottom;
  // An oblique view from the front right.
  Eigen::Vector2d At(const Eigen::Vector3d& p) const {
    return {left + scale * (p.x() - 0.45 * p.y()), bottom - scale * (p.z() - 0.25 * p.y())};
  }
};

std::string Line(const Eigen::Vector2d& a, const Eigen::Vector2d& b, const char* style) {
  return fmt::format("<path class='{}' d='M{:.1f} {:.1f}L{:.1f} {:.1f}'/>", style, a.x(), a.y(), b.x(), b.y());
}

std::string Word(const Eigen::Vector2d& at, const std::string& text, const char* anchor = "start") {
  return fmt::format("<text class='label' x='{:.1f}' y='{:.1f}' text-anchor='{}'>{}</text>", at.x(), at.y(), anchor,
                     report::Escape(text));
}

std::string DrawFrames(const codegen::Robot& robot) {
  constexpr double kAxis_m = 0.12;
  const auto frame = Frames(robot);
  double reach = 0.5;
  for (const auto& f : frame) reach = std::max(reach, f.translation().cwiseAbs().maxCoeff());
  const Sheet2d sheet{380 / reach / 1.25, 120, 440};
  std::string svg = "<svg viewBox='0 0 760 480' role='img' aria-label='joint frames'>";
  for (std::size_t i = 0; i < frame.size(); ++i) {
    const Eigen::Vector3d o = frame[i].translation();
    if (i > 0) svg += Line(sheet.At(frame[i - 1].translation()), sheet.At(o), "axis");
    constexpr const char* kStyle[] = {"line s1", "line s2", "line s0"};
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::Vector3d tip = o + kAxis_m * reach * frame[i].rotation().col(axis);
      svg += Line(sheet.At(o), sheet.At(tip), kStyle[axis]);
      if (axis == 2) svg += Word(sheet.At(tip), "z" + std::to_string(i));
      if (axis == 0) svg += Word(sheet.At(tip), "x" + std::to_string(i));
    }
  }
  return svg + "</svg>";
}

std::string DrawPlatform() {
  struct Block {
    double x, y, width;
    const char *first, *second;
  };
  constexpr Block kBlock[] = {{10, 90, 130, "trajectory (27)", "qd, qd', qd''"},
                              {190, 20, 170, "inverse dynamics + friction", "set parameters"},
                              {190, 150, 170, "PD control, 1 kHz", "gains of the robot file"},
                              {450, 90, 130, "arm: M, V, G of (1)", "friction (3) or (4)"},
                              {630, 20, 120, "torque noise", "Table 7, 100 Hz"},
                              {630, 150, 120, "encoder, noise", "q, 100 Hz"}};
  std::string svg = "<svg viewBox='0 0 760 230' role='img' aria-label='simulation platform'>";
  for (const Block& b : kBlock) {
    svg += fmt::format("<rect class='axis' x='{}' y='{}' width='{}' height='54' rx='4'/>", b.x, b.y, b.width);
    svg += Word({b.x + b.width / 2, b.y + 23}, b.first, "middle") +
           Word({b.x + b.width / 2, b.y + 41}, b.second, "middle");
  }
  const double arrows[][4] = {{140, 105, 190, 50},  {140, 130, 190, 175}, {360, 50, 450, 105},
                              {360, 175, 450, 130}, {580, 105, 630, 50},  {580, 130, 630, 175}};
  for (const auto& a : arrows)
    svg += Line({a[0], a[1]}, {a[2], a[3]}, "axis") +
           fmt::format("<circle class='axis' cx='{}' cy='{}' r='2.5'/>", a[2], a[3]);
  svg += "<path class='axis' d='M515 144V218H275V204'/>" + Word({395, 214}, "q, q' back to the controller", "middle");
  return svg + "</svg>";
}

report::Plot Positions(const ExcitedBy& e, const std::string& title) {
  const codegen::Signals s = Sampled(e.series);
  report::Plot plot;
  plot.text = {title, "time / s", "position / rad", 760, 320};
  for (Eigen::Index j = 0; j < s.q.cols(); ++j)
    plot.series.push_back(
        {"joint " + std::to_string(j + 1), {s.t.begin(), s.t.end()}, {s.q.col(j).begin(), s.q.col(j).end()}});
  return plot;
}

}  // namespace

void ShowTrajectories(const Settings& settings, const Motions& motions, Findings& out) {
  Sheet sheet{
      "trajectories",
      "condition number of K, (26); ten coefficients a joint (Fourier series (27): L = 5), 0.1 Hz, an offset a joint",
      {"model", "curve", "search", "minimised", "columns", "cond(K)", "printed", "columns unscaled", "rows unweighted",
       "plain SI", "all sd", "friction sd", "largest share of a limit", "search / s", "searches"},
      {},
      {"cond(K): base parameters and friction (for (4) the derivatives by Fc, Fs, qs, beta at the set values), rows "
       "divided by the torque noise of their joint, columns scaled to unit norm, 1000 samples of one period. The "
       "survey does not say what it scales; with 60 standard columns K is singular. Columns unscaled: rows divided, "
       "columns "
       "as they are. Rows unweighted: rows as they are, columns to unit norm. Plain SI: neither. Compare figures of "
       "one "
       "scaling only.",
       "all sd: det(K' R^-1 K)^(-1/2n), the D-optimal figure; friction sd: geometric mean of the standard deviations "
       "of the friction columns, all others unknown, too. Compare them within a model only.",
       "Limits: position, speed, acceleration, torque of the robot file on a 1 ms grid."}};
  const auto add = [&](const ExcitedBy& e, const Cell& printed) {
    constexpr const char* kMinimised[] = {"cond(K)", "all sd", "friction sd"};
    sheet.rows.push_back({LawName(e.law == Law::kGradient ? Law::kStribeck : e.law), excitation::Name(e.family),
                          e.search == excitation::Search::kGenetic ? "genetic" : "gradient",
                          kMinimised[static_cast<int>(e.criterion)], static_cast<double>(e.columns), e.condition,
                          printed, e.raw, e.unweighted, e.plain, e.all_sd, e.friction_sd, e.share, e.seconds,
                          static_cast<double>(e.searches)});
  };
  for (const bool nonlinear : {false, true}) {
    const ExcitedBy& e = nonlinear ? motions.nonlinear : motions.linear;
    const char* const name = nonlinear ? "nonlinear" : "linear";
    add(e, settings.printed.At("condition", name, 0));
    const std::string where = std::string("Section 6.1, ") + (nonlinear ? "(4): " : "(7): ");
    out.goals.push_back({where + "cond(K), rows / sigma, unit columns", e.condition, nonlinear ? 5.0 : 4.6, true});
    out.goals.push_back({where + "largest share of a limit on a 1 ms grid", e.share, 1, true});
  }
  for (const ExcitedBy& e : motions.others) add(e, "-");
  out.sheets.push_back(sheet);
  out.pictures.push_back({"2",
                          "optimised trajectories",
                          "(a) linear model (7); (b) nonlinear model (4).",
                          {Positions(motions.linear, "(a) linear"), Positions(motions.nonlinear, "(b) nonlinear")},
                          ""});
}

void ShowArm(const Settings& settings, Findings& out) {
  out.pictures.push_back({"1",
                          settings.robot.title,
                          "Joint frames at q = 0, modified DH, from the robot file; x orange, y green, z blue.",
                          {},
                          DrawFrames(settings.robot)});
  out.pictures.push_back(
      {"3", "the simulation platform", "What the tables call measured leaves on the right.", {}, DrawPlatform()});
}

}  // namespace armcal::survey

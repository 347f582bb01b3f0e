// judged set - writes logs and truths, and derives what a log's positions can tell.
#pragma once

#include <filesystem>
#include <functional>

#include "tests/judged/arm.hpp"

namespace armcal::judged {

// The logged position derived by a cubic fitted to the samples around each one, `half` on either side.
Motion Derived(const Motion& m, const Eigen::MatrixXd& q, int half);

// What the true model leaves of a torque if its speeds and accelerations come from the logged position: per joint with
// the half width (of those tried) that serves it best. `edge` samples at either end do not count.
Eigen::MatrixXd Rest(const Motion& m, const Eigen::MatrixXd& q, const Eigen::MatrixXd& tau, int edge,
                     const std::function<Eigen::MatrixXd(const Motion& derived)>& predicted);

// Share of samples in which a joint is where, or as fast as, it never was in training: nobody can say what happens
// there.
double Unseen(const Motion& train, const Motion& test);

// Columns t, q, tau, and temp if asked for. Each row stands `hold` times, and the stamps run on evenly in between;
// stamps [samples x hold] replace them if there are any.
void WriteLog(const std::filesystem::path& path, const Motion& m, const Eigen::MatrixXd& q, const Eigen::MatrixXd& tau,
              bool temperature, int hold = 1, const Eigen::VectorXd& stamps = {});
void WriteJson(const std::filesystem::path& path, const nlohmann::json& content);

}  // namespace armcal::judged

// analysis - identifies the declared model: the weighted fit, the bodies that follow, and the table of them.
#pragma once

#include <vector>

#include <nlohmann/json.hpp>

#include "host_sim/diagnose/verdict/figures.hpp"
#include "host_sim/identify/calibration/barrier_fit.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "host_sim/identify/calibration/weighted_fit.hpp"
#include "host_sim/identify/methods/exogeneity.hpp"
#include "host_sim/identify/methods/link_widths.hpp"

namespace armcal::analysis {

inline constexpr const char* kLacksTerm = "the model lacks a term: armcal diagnose";

// Bodies read out with the widths that the logs themselves show, and the table that follows. A link's parameter rests
// on the prior where the logs narrow these widths little. Where a drive would refuse the table, the bodies and the
// friction are fitted once more, within what the drive accepts.
struct IdentifiedBodies {
  calibration::LinkWidths widths;
  calibration::PhysicalReadOut bodies;
  calibration::TableFile table;
  std::vector<std::string> held;  // what the fit gave beyond the ceilings, a sentence for each
  int FromPrior() const;          // so many rows of the table rest mostly on the prior
};
// all: every parameter free; used: those held that the logs hardly determine.
IdentifiedBodies ReadBodies(const codegen::Model& model, const calibration::Fit& all, const calibration::Fit& used,
                            const std::vector<calibration::Dataset>& train);

struct Identified {
  // InputError, before the fit: no body can be as the robot file's prior says.
  Identified(const codegen::Model& identified, const std::vector<calibration::Dataset>& train);
  // Needs a prior. force: parameters may move that the data hardly determine.
  void ReadOut(const std::vector<calibration::Dataset>& train, bool force);

  // Of the standard parameters where they were read out, else of the fit.
  const Eigen::VectorXd& x() const { return has_bodies ? read.bodies.x : all.x; }
  const std::vector<double>& eta() const { return used.eta; }
  nlohmann::ordered_json ToJson() const;
  // The error on a log, and what the JSON says of it: the error as "held_out" or, of a training log, as "on_training";
  // and measured and predicted torque for a page.
  struct OnLog {
    verdict::HeldOutError error;
    nlohmann::ordered_json json;
  };
  OnLog Compare(const calibration::Dataset& log, bool held_out, double band_Hz) const;

  const codegen::Model& model;
  calibration::Fit all, used;
  calibration::Exogeneity exogeneity;
  bool has_bodies = false;
  IdentifiedBodies read;
};

}  // namespace armcal::analysis

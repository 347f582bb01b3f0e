// tool - many diagnoses, one process each on all cores, so that a bad log ends alone; knows no folder layout, no
// search.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/diagnose/verdict/diagnose_summary.hpp"
#include "host_sim/tool/diagnose.hpp"

namespace armcal::tool {

// What is empty is not there: the verdict then says so.
struct DiagnosisCase {
  std::string name;
  std::vector<std::string> train, test;  // test: one
  std::string robot;
};

// NAME.json, .html, .toml and .log of each case go to `out`. one: how each log is read. jobs: at a time; 0: one a core.
verdict::Verdicts DiagnoseAll(const std::vector<DiagnosisCase>& cases, const DiagnoseOptions& one,
                              const std::filesystem::path& out, int jobs);

}  // namespace armcal::tool

// survey - the form of the findings: cells of tables, goals, pictures.
#pragma once

#include <cmath>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "host_sim/data/report/plot.hpp"

namespace armcal::survey {

// A number with the 95 % interval of its mean over draws (NaN: one draw), or words.
struct Cell {
  double value = std::numeric_limits<double>::quiet_NaN();
  double low = std::numeric_limits<double>::quiet_NaN(), high = low;
  std::string words{};

  Cell() = default;
  Cell(double number) : value(number) {}              // NOLINT(google-explicit-constructor)
  Cell(std::string text) : words(std::move(text)) {}  // NOLINT(google-explicit-constructor)
  Cell(const char* text) : words(text) {}             // NOLINT(google-explicit-constructor)
  Cell(double number, double from, double to) : value(number), low(from), high(to) {}
};

struct Sheet {
  std::string number, title;  // "8", "J_e with and without noise, linear methods"
  std::vector<std::string> columns;
  std::vector<std::vector<Cell>> rows;
  std::vector<std::string> notes;  // how to read it, and why it differs from the survey's
};

struct Picture {
  std::string number, title, caption;
  std::vector<report::Plot> plots;
  std::string drawing;  // an <svg> element where it is no plot
};

struct Goal {
  std::string name;
  double value, goal;
  bool at_most;  // met if value <= goal; else if value >= goal
  bool met() const { return at_most ? value <= goal : value >= goal; }
};

// Everything that one run of the survey found.
struct Findings {
  std::vector<Sheet> sheets;
  std::vector<Picture> pictures;
  std::vector<Goal> goals;
};

}  // namespace armcal::survey

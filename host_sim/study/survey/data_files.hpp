// survey - the level limits of Tables 1 to 4 and the survey's printed figures, as read from their files.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace armcal::survey {

struct Limits {
  double A = 0, B = 0;
};

// host_sim/study/survey/levels.toml
struct Levels {
  std::map<std::string, Limits> limit;  // e_T, e_d, e_f, J_e, solution_time_s, delta_J_e
  double follow_rms = 0, settle_s = 0;
  std::vector<double> tau_max_Nm;  // the survey prints none; these reproduce its e_T_Std
  double mass_floor_kg = 0, center_floor_m = 0, inertia_floor_of_trace = 0;

  // 'A' below the first limit, 'B' below the second, else 'C'. NaN gives 'C'.
  char Of(const std::string& index, double value) const;
};
// io::InputError: file, key, what was expected.
Levels ReadLevels(const std::filesystem::path& path);

// host_sim/study/survey/printed.toml: table -> row -> numbers, or words (Table 11).
struct Printed {
  std::map<std::string, std::map<std::string, std::vector<double>>> number;
  std::map<std::string, std::map<std::string, std::vector<std::string>>> words;

  // NaN where the survey has no such figure.
  double At(const std::string& table, const std::string& row, std::size_t place) const;
  std::string WordAt(const std::string& table, const std::string& row, std::size_t place) const;  // "-" likewise
};
Printed ReadPrinted(const std::filesystem::path& path);

}  // namespace armcal::survey

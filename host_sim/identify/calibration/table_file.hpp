// calibration - the parameter table: as a file that people can read, and as the words that the drive takes.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "host_sim/identify/calibration/weighted_fit.hpp"

namespace armcal::calibration {

struct TableRow {
  std::string name, unit, state = "estimated";
  double mean = 0, sd = 0, process_noise = 0;  // sd: prior, of (m, c, I about the centre, rotor) for bodies
  int group = 0;
  double posterior_sd = 0;  // of this identification; 0: not identified
  bool from_prior = false;  // posterior / prior sd above 0.7: the data say little
  double free_mean = 0;     // where the data alone would move it; equals mean where not from_prior
};

struct TableJoint {
  double sigma_Nm = 0, v_min_radps = 0, torque_limit_Nm = 0, torque_scale = 1;
  double gate_sigma = 0;  // of the drive's row gate, in standard deviations; 0: the firmware's own
};

struct TableFile {
  std::string robot, note;
  std::uint32_t schema = 0;
  bool bumpless = false;
  std::uint32_t blend_ms = 0;
  double forgetting[4] = {1, 1, 1, 1};
  std::vector<TableJoint> joint;
  std::vector<TableRow> row;
};

inline constexpr double kFromPrior = 0.7;  // posterior / prior standard deviation above which a value is the prior's

// The model's own numbers: CAD bodies, nominal friction.
TableFile DefaultTable(const codegen::Model& model);

// An identification as a table. `held`: the fit that keeps at the prior those columns which the data hardly determine.
// `all`: the fit that holds nothing. Bodies come from the physical read-out of `held`. noise_density: as NoiseDensity
// has it.
TableFile IdentifiedTable(const codegen::Model& model, const Fit& all, const PhysicalReadOut& bodies,
                          const Eigen::VectorXd& noise_density);

// Friction and effect columns whose posterior / prior ratio is above kFromPrior.
std::vector<int> HardlyDetermined(const codegen::Model& model, const Fit& fit);

// A table is TOML. True: the file is JSON, or begins like it.
bool IsJson(const std::filesystem::path& path);
// Throws io::InputError: file, key, what was expected.
TableFile ReadTable(const std::filesystem::path& path);
void WriteTable(const std::filesystem::path& path, const TableFile& table);

// The layout of armcal/model/parameters.hpp as 16-bit words, and back (names, units come from `like`). A table that
// gives no joint a gate is encoded as version 1, which every drive reads.
std::vector<std::uint16_t> EncodeTable(const TableFile& table);
TableFile DecodeTable(const std::vector<std::uint16_t>& words, const TableFile& like);

// Names of parameters that one of two tables lacks.
struct CarriedOver {
  std::vector<std::string> missing;  // rows that `from` does not have: they keep their value
  std::vector<std::string> unknown;  // rows that `to` does not have
};

// Copies the values of `from` into the layout `to`, by parameter name. Throws io::InputError, which names `source`: a
// table of another robot, another number of joints, another unit, or an unknown row in a table of the same schema. A
// table of another schema was made for another version of the model, so it may hold rows of other effects.
CarriedOver CarryOver(const TableFile& from, TableFile& to, const std::string& source);

}  // namespace armcal::calibration

// logs - holds what was measured on an arm, on the joint side and in SI units.
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace armcal::logs {

struct ChannelMap;

// N samples of n joints. q in rad (m on a prismatic joint), tau in N m (N), measured torque on the joint side.
// The optional blocks are 0 x 0 when the file does not carry them.
struct Log {
  int joints = 0;
  Eigen::VectorXd t;                     // [N] s, strictly rising
  Eigen::MatrixXd q, tau;                // [N x n]
  Eigen::MatrixXd qd, qdd, qref, tauff;  // [N x n] or empty
  Eigen::MatrixXd ext;                   // known external force along +q, N m (N)
  Eigen::MatrixXd temp;                  // degrees Celsius
  Eigen::MatrixXi flags;                 // as the drive sent them
  std::string source;                    // the file's name
  std::vector<int> gaps;                 // k where t[k+1] - t[k] > 1.5 x the median step
  std::vector<std::string> ignored;      // columns of the file that mean nothing here
  std::vector<std::string> notes;        // what reading left out or changed, a line each
  Eigen::VectorXi line;                  // [N] each sample's line in the file; empty if the log was not read from one

  Eigen::Index samples() const { return t.size(); }
  int line_of(Eigen::Index k) const { return line.size() ? line[k] : static_cast<int>(k) + 2; }
  double step_s() const;  // the median sample time; InputError if there are fewer than two samples
};

inline constexpr int kMinSamples = 200;  // below this no statistic of the project means anything

// Rows as they stand in a file or in arrays: the blocks of `log` with N rows each. A number that is missing is NaN.
struct RawLog {
  Log log;                           // joints, source, t and the blocks
  Eigen::MatrixXd flags;             // as numbers; empty if there are none
  Eigen::VectorXi missing;           // [N] 1: some column has no number there
  std::string time_column;           // for messages
  std::vector<std::string> columns;  // the joints' columns of q, then of tau, for messages
  int first_line = 2;                // the number that messages give the first row: in a file, behind the header
};

// The rows that are samples. InputError as ReadLog has it.
Log MakeLog(RawLog raw, int min_samples = kMinSamples);

// Reads CSV or gzip CSV with our names: t, q1..qn, tau1..taun and optionally qd*, qdd*, qref*, tauff*, ext*, temp*,
// flag*, each for all n joints. Other columns are listed in `ignored`. Rows that are no samples are left out, and
// `notes` says which (rows.hpp).
// InputError, one line with file, line, column and what was expected: column missing or twice, not a number, many rows
// without a number, rows of unequal length, time that does not rise, a sample rate below 1 Hz or above 50 kHz, fewer
// than `min_samples` samples.
Log ReadLog(const std::filesystem::path& path, int min_samples = kMinSamples);

// The same for a foreign file whose columns, units and zero points `map` describes.
Log ReadLog(const std::filesystem::path& path, const ChannelMap& map, int min_samples = kMinSamples);

// Writes what the log holds under our names; gzip if the name ends in ".gz". Time with 12 significant digits, the rest
// with 9; kAll: so many that the same numbers are read again. Atomic: a reader sees the old file or the new one.
enum class Digits { kUsual, kAll };
void WriteLog(const std::filesystem::path& path, const Log& log, Digits digits = Digits::kUsual);

}  // namespace armcal::logs

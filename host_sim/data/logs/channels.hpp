// logs - says which column of a foreign log is which quantity.
//
// A map is a TOML file:
//   joints = 6
//   names = ["base", "arm"]      # of the joints, one each, where columns have {joint}
//   messages = ["my/msg/A.msg"]  # definitions for a recording that lacks them; paths from the map's folder
//   [time]
//   column = "t_s"          # name in the log; without [time]: "__time", in s (table.hpp)
//   unit = "s"              # s, ms, us, ns
//   [q]                     # q and tau must be there; also qd qdd qref tauff ext temp flag
//   column = "pos_{}_deg"   # {} stands for 1..n, {0} for 0..n-1, {joint} for names; or a list of n columns
//   unit = "deg"            # one for all joints, or a list of n
//   scale = 1               # one or n, optional; value = unit(scale x column + offset)
//   offset = [0, -90, 90, 0, 0, 0]
//   optional = true         # leave the quantity out when its columns are not in the log
//   matrix = [[1, 0], [-1, 1]]   # coupled motors, of q qd qdd qref tau tauff ext: joints = matrix x columns
// scale and offset are numbers; the unit is that of scale x column + offset. Where there is a matrix, the columns are
// the motors' and this unit is theirs; a row gives one joint. If q_motor = C q, positions and speeds take the inverse
// of C, torques its transpose. A log with two torques maps the other one as well and names the one to use:
//   torque = "tau_link"     # default "tau"
//   [tau_link]              # a torque sensor behind the gear, say; keys as those of [tau]
#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

namespace armcal::logs {

// ours = gain x column + bias, in SI.
struct Channel {
  std::string column;
  double gain = 1;
  double bias = 0;
};

struct Quantity {
  std::string name;            // "q", "tau", "qd", "qdd", "qref", "tauff", "ext", "temp", "flag"
  std::vector<Channel> joint;  // n
  bool optional = false;
  Eigen::MatrixXd matrix = {};  // [n x n] joints = matrix x channels; empty: unit
};

struct ChannelMap {
  int joints = 0;
  Channel time;
  std::vector<Quantity> quantities;
  std::string source;
  std::vector<std::filesystem::path> definitions = {};  // files *.msg
  std::string unused = {};                              // the torque that is not read, of a map with two; or empty
};

// definitions: further files *.msg. InputError with file, key and what was expected.
ChannelMap ReadChannelMap(const std::filesystem::path& path,
                          const std::vector<std::filesystem::path>& definitions = {});

}  // namespace armcal::logs

// drive - the simulated drive: the plant moves, the player moves the set-point, the firmware measures and serves.
#pragma once

#include <atomic>
#include <cstdio>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "codegen/src/robot/robot.hpp"
#include "host_sim/machine/drive/firmware.hpp"
#include "host_sim/machine/drive/player.hpp"
#include "host_sim/machine/plant/arm.hpp"

namespace armcal::drive {

struct DriveOptions {
  std::string scenario, robot, storage, truth_log, serial, address = "127.0.0.1", read_address;
  int port = 0, read_port = 0;
  bool real_time = false;
};

// Gains of the joint controller, one a joint.
struct Gains {
  std::vector<double> kp_Nmprad, kd_Nmsprad;
};

// Those of the robot file; without, such that the lightest pose of each joint crosses over at 0.4 / dead time: two
// ticks and the current loop's lag. Throws io::InputError for a robot whose motors are coupled.
Gains GainsOf(const codegen::Robot& robot, plant::Arm& arm);

// Two threads as on a target: the tick (signal path, feed-forward, trace, push) and the background (link, table,
// estimators). They meet only in lib's ring and mailboxes and in atomics of the player. Without real_time virtual
// time waits for the background to keep up, and stands still while nothing moves. Only a simulator may do that; lib
// never waits.
class SimulatedDrive {
 public:
  // Throws io::InputError: robot, scenario or firmware do not fit each other.
  SimulatedDrive(const DriveOptions& options, std::unique_ptr<Firmware> firmware);
  ~SimulatedDrive();
  SimulatedDrive(const SimulatedDrive&) = delete;

  // Serves until `quit`. on_listen is called once. Throws io::InputError if storage or port cannot be had.
  void Run(const std::atomic<bool>& quit, const std::function<void(const Firmware&)>& on_listen);

 private:
  bool Background();
  void TickLoop(const std::atomic<bool>& quit);
  bool MayAdvance();
  void Tick();
  void WriteTruth(std::uint32_t tick);

  DriveOptions options_;
  codegen::Robot robot_;
  plant::Arm arm_;
  plant::Sensors sensors_;
  Gains gains_;
  Player player_;
  std::unique_ptr<Firmware> firmware_;
  std::atomic<int> grant_{0};
  std::vector<std::int32_t> previous_counts_;
  bool have_previous_ = false;
  SetPoint last_set_;
  int enabled_ticks_ = 0;
  std::FILE* truth_ = nullptr;
};

}  // namespace armcal::drive

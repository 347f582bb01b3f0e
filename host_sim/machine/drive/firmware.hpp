// drive - what the simulated machine and the firmware that was compiled for a model know of each other.
//
// The machine is the same program for every robot. The firmware is compiled for one model: it is linked in, or it is a
// shared object that the program loads. So only plain types pass between them. Whoever changes this file changes
// kFirmwareInterface.
#pragma once

#include <cstdint>
#include <string>

#include "host_sim/client/vendor_registers.hpp"

namespace armcal::drive {

inline constexpr int kFirmwareInterface = 3;

// What the registers of the player do. Context: background.
class PlayedMotion {
 public:
  virtual ~PlayedMotion() = default;
  // q: [points x joints], a point after the other. False while a motion runs.
  virtual bool Load(double step_s, std::uint32_t points, const float* q) = 0;
  virtual void SetSpeed(double share) = 0;
  virtual void Command(client::PlayerCommand command) = 0;
  virtual client::PlayerState state() const = 0;
  virtual client::StopReason reason() const = 0;
  virtual std::uint32_t first_tick() const = 0;
  virtual std::uint32_t last_tick() const = 0;

  bool enabled() const { return state() != client::PlayerState::kDisabled; }
  bool moving() const { return state() == client::PlayerState::kBlending || state() == client::PlayerState::kPlaying; }
};

// One motor axis: q = counts_to_rad (counts - zero_counts), torque = lsb_to_Nm current.
struct AxisScale {
  double counts_to_rad;
  std::int32_t zero_counts;
  double lsb_to_Nm;
};

// Of one axis in one tick.
struct Reading {
  std::int32_t counts;
  std::int16_t current_lsb;
  float temperature_degC;
  bool enabled, saturated;
};

// How the firmware can be reached. Port 0: any free one. serial: a terminal, 115200 baud, address 1; empty: none.
// read_address, read_port: a second listener that serves reading functions alone; empty: none.
struct Access {
  std::string address;
  int port;
  std::string serial, read_address;
  int read_port;
};

// lib's controller behind Modbus.
class Firmware {
 public:
  virtual ~Firmware() = default;

  virtual const char* name() const = 0;
  virtual std::uint32_t schema() const = 0;
  virtual int joints() const = 0;
  virtual AxisScale axis(int joint) const = 0;

  // Opens the storage, boots and listens. Empty, or what is wrong, as a line. Context: background, as the next five.
  virtual std::string Start(const std::string& storage, const Access& access, PlayedMotion& motion) = 0;
  virtual int port() const = 0;
  virtual int read_port() const = 0;  // 0: none
  // Some slices of lib's work. False: nothing was left to do. With `wait` a streaming reader holds the estimators up.
  virtual bool Work(bool wait) = 0;
  // Looks at the sockets and the serial line, for so long at most.
  virtual void Serve(int timeout_ms) = 0;
  // Makes the estimators publish, if samples came since the last time.
  virtual void Publish() = 0;
  virtual std::uint32_t generation() const = 0;  // of the table in force

  // Context: tick. False: readers or estimators are so far behind that virtual time has to wait.
  virtual bool KeepsUp() = 0;
  virtual std::uint32_t tick() const = 0;
  virtual void SetEnabled(bool enabled) = 0;
  // The motion was stopped because a joint was too far from its set-point.
  virtual void ReportTrackingError() = 0;
  // Arrays [joints]. tau_Nm: zero without a table.
  virtual void FeedForward(const double* q, const double* qd, const double* qdd, const double* temperature_degC,
                           double* tau_Nm) = 0;
  // Of the table in force, faded like its torque; 1 without one.
  virtual double torque_scale(int joint) const = 0;
  // readings: [joints]. Ends the tick.
  virtual void Push(const Reading* readings) = 0;
};

}  // namespace armcal::drive

// The firmware of the model that this was compiled for; `delete` ends it. key: [32], with which tables must be signed;
// nullptr: they need not. nullptr: another interface. A program without a firmware of its own has none of this name.
extern "C" armcal::drive::Firmware* MakeArmcalFirmware(int interface, const std::uint8_t* key) __attribute__((weak));

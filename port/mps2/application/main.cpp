// application - the example firmware, as the README shows it.
#include "armcal/armcal.hpp"
#include "board.hpp"           // yours: storage, clock, serial line, axes and what a client may do
#include "selected_model.hpp"  // generated: the model that this program links

using Model = armcal::generated::SelectedModel;
using Filter = armcal::filter::ForgettingFilter<Model>;
static armcal::controller::Controller<Model, Filter> controller(board::Storage(), board::Clock(), {}, board::Rules());
static armcal::link::RtuService modbus(controller.engine(), board::Serial(), board::Clock(), 1, board::kSilence_ms);
static armcal::controller::RawTrace<Model, 16384> trace;  // 32 KB: with six joints a client may be 1.9 s late

extern "C" void TickInterrupt() {  // bounded time; the data change it by a few instructions
  armcal::model::RawSample<Model::kJoints> raw;
  armcal::controller::SetPoint<Model::kJoints> set;
  float tau_Nm[Model::kJoints];
  controller.SetEnabledAxes(board::Measure(raw, set));              // counts, currents and set-point of one instant
  (void)controller.FeedForward(set, raw.temperature_degC, tau_Nm);  // cut to each joint's limit; zero without a table
  board::Command(tau_Nm);                                           // on to the current controllers
  (void)controller.Push(raw);                                       // a sample that finds the ring full is counted
}
extern "C" void SerialInterrupt() { board::OnSerial(); }  // bytes into a ring, nothing else
extern "C" void Application() {                           // all the rest, in bounded slices
  (void)controller.Record(trace);                         // what Push and FeedForward are given, if a client asks
  (void)controller.Boot();                                // if there is no valid table, a register says why
  board::Start(Model::kTickRate_Hz);
  for (;;) {
    modbus.Poll();                           // at most one request
    if (!controller.Step()) board::Sleep();  // estimators, table, registers
  }
}

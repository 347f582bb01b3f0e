// application - the example firmware: three contexts on one board; knows which model and which board.
#include "armcal/link/rtu_service.hpp"
#include "port/mps2/application/drive.hpp"
#include "port/mps2/application/pretend_axes.hpp"
#include "port/mps2/interrupts.hpp"
#include "port/mps2/psram_storage.hpp"
#include "port/mps2/tick_clock.hpp"
#include "port/mps2/uart.hpp"
#include "selected_model.hpp"  // of the model that the target links

namespace {

using Model = armcal::generated::SelectedModel;
namespace board = armcal::port::mps2;

constexpr std::uint8_t kModbusAddress = 1;
constexpr std::uint32_t kBaud = 115200;
constexpr std::uint32_t kSilence_ms = 200;  // an emulated line delivers in portions; 2 ms on a real one

armcal::application::Drive<Model> drive(board::PsramStorage(), board::TickClock());
armcal::application::PretendAxes<Model> axes;
armcal::link::RtuService modbus(drive.engine(), board::Uart1(), board::TickClock(), kModbusAddress, kSilence_ms);

}  // namespace

// Tick: measure, feed forward, push. The torque goes to the current controllers, which this board does not have.
extern "C" void TickInterrupt() {
  armcal::model::RawSample<Model::kJoints> raw;
  armcal::application::SetPoint<Model::kJoints> set;
  float tau_Nm[Model::kJoints];
  axes.Read(board::CountTick(), raw, set);
  // A late estimator and clamped torques are counted inside and served as registers.
  (void)drive.Tick(raw, set, tau_Nm);
}

// Background: Modbus, table, estimator, in slices. The serial interrupt (uart.cpp) only fills a ring.
extern "C" void Application() {
  (void)drive.Boot();  // why there is no table, if so, is served as a register
  board::StartUart1(kBaud);
  board::StartTick(static_cast<std::uint32_t>(Model::kTickRate_Hz));
  for (;;) {
    modbus.Poll();
    if (!drive.Background()) board::Sleep();
  }
}

// application - the emulated board, as the example firmware asks for it. It only pretends to have axes.
#pragma once

#include "selected_model.hpp"

#include "port/mps2/application/pretend_axes.hpp"
#include "port/mps2/interrupts.hpp"
#include "port/mps2/psram_storage.hpp"
#include "port/mps2/tick_clock.hpp"
#include "port/mps2/uart.hpp"

namespace board {

namespace mps2 = armcal::port::mps2;

inline constexpr std::uint32_t kSilence_ms = 200;  // because an emulated line delivers in portions; 2 ms on a real line
inline armcal::application::PretendAxes<armcal::generated::SelectedModel> axes;

#ifdef ARMCAL_SLOW_SECTORS  // of the image armcal_firmware_slow
inline armcal::hardware::Storage Storage() { return mps2::SlowPsramStorage(); }
#else
inline armcal::hardware::Storage Storage() { return mps2::PsramStorage(); }
#endif
inline armcal::hardware::Clock Clock() { return mps2::TickClock(); }
inline armcal::hardware::Serial Serial() { return mps2::Uart1(); }
// Its axes are always enabled and drive nothing.
inline armcal::controller::BoardRules Rules() { return {true, {100, 1000}}; }
inline void OnSerial() { mps2::OnUart1(); }
inline void Sleep() { mps2::Sleep(); }

template <int n>
std::uint32_t Measure(armcal::model::RawSample<n>& raw, armcal::controller::SetPoint<n>& set) {
  return axes.Read(mps2::CountTick(), raw, set);
}
inline void Command(const float*) {}  // this board has no current controllers

inline void Start(float tick_rate_Hz) {
  mps2::StartUart1(115200);
  mps2::StartTick(static_cast<std::uint32_t>(tick_rate_Hz));
}

}  // namespace board

// runner - runs a program on an emulated MPS2 board, by semihosting.
//
// QEMU is started with -semihosting-config enable=on,arg=[input file] and -icount shift=7. An instruction then takes
// 128 ns of virtual time, which is 3.2 ticks of the 25 MHz timer. So the timer tells single instructions apart.
#include "port/mps2/interrupts.hpp"
#include "port/runner/line.hpp"

namespace {

// ARM semihosting: operation numbers and one word or a block of words as argument.
constexpr std::uint32_t kOpen = 0x01, kWriteText = 0x04, kRead = 0x06, kCommandLine = 0x15, kExitExtended = 0x20;
constexpr std::uint32_t kApplicationExit = 0x20026, kOpenBinaryRead = 1;

std::uint32_t Ask(std::uint32_t operation, std::uintptr_t argument) {
  register std::uint32_t r0 __asm("r0") = operation;
  register std::uintptr_t r1 __asm("r1") = argument;
  __asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}
std::uintptr_t AddressOf(const void* what) { return reinterpret_cast<std::uintptr_t>(what); }

// CMSDK timer 0: control, value (counts down), reload.
struct Timer {
  std::uint32_t control, value, reload;
};
volatile Timer& Timer0() { return *reinterpret_cast<volatile Timer*>(0x40000000u); }

struct Tick {
  std::uint32_t control, reload, value;
};
volatile Tick& SysTick() { return *reinterpret_cast<volatile Tick*>(0xE000E010u); }
void (*on_tick)() = nullptr;
volatile std::uint32_t ticks_left = 0;

constexpr std::uint32_t kNotOpen = ~0u;
std::uint32_t input = kNotOpen;

void OpenInput() {
  static char path[256];
  std::uintptr_t line[2] = {AddressOf(path), sizeof path};
  if (Ask(kCommandLine, AddressOf(line)) != 0 || path[0] == '\0') return;
  std::uint32_t length = 0;
  while (path[length] != '\0') ++length;
  const std::uintptr_t file[3] = {AddressOf(path), kOpenBinaryRead, length};
  input = Ask(kOpen, AddressOf(file));
}

[[noreturn]] void Exit(std::uint32_t code) {
  const std::uint32_t block[2] = {kApplicationExit, code};
  for (;;) Ask(kExitExtended, AddressOf(block));
}

}  // namespace

namespace armcal::port::runner {

void Write(const char* text) { Ask(kWriteText, AddressOf(text)); }

std::size_t Read(void* bytes, std::size_t capacity) {
  if (input == kNotOpen) return 0;
  const std::uintptr_t block[3] = {input, AddressOf(bytes), capacity};
  return capacity - Ask(kRead, AddressOf(block));  // it answers how many bytes are missing
}

std::uint32_t Count() { return ~Timer0().value; }
std::uint32_t Spent(std::uint32_t from, std::uint32_t to) { return ((to - from) * 5u + 8u) / 16u; }

void RunContexts(std::uint32_t count, std::uint32_t period, void (*tick)(), bool (*background)()) {
  on_tick = tick;
  ticks_left = count;
  SysTick().reload = period * 16u / 5u;
  SysTick().value = 0;
  SysTick().control = 7;  // core clock, interrupt, enabled
  while (ticks_left != 0) (void)background();
  SysTick().control = 0;
  while (background()) {
  }
}

}  // namespace armcal::port::runner

extern "C" {

void Application() {
  Timer0().reload = ~0u;
  Timer0().value = ~0u;
  Timer0().control = 1;
  OpenInput();
  Exit(static_cast<std::uint32_t>(Program()));
}

// A fault ends the run with 99 and says why: the configurable fault status register.
void Fault() {
  armcal::port::runner::Line("fault: CFSR").Hex(*reinterpret_cast<volatile std::uint32_t*>(0xE000ED28u)).End();
  Exit(99);
}

void TickInterrupt() {
  if (ticks_left == 0) return;
  on_tick();
  ticks_left = ticks_left - 1;
}
void SerialInterrupt() { Fault(); }

}  // extern "C"

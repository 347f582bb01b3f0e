// mps2 - vector table and reset of a Cortex-M4F or M7.
#include <cstdint>

#include "port/mps2/interrupts.hpp"

extern "C" {
extern std::uint32_t stack_top[], data_begin[], data_end[], data_load[], bss_begin[], bss_end[];  // sections.ld
using Function = void (*)();
extern Function init_array_begin[], init_array_end[];
void Reset();
}

namespace {

volatile std::uint32_t& Register(std::uint32_t address) { return *reinterpret_cast<volatile std::uint32_t*>(address); }

constexpr std::uint32_t kCoprocessorAccess = 0xE000ED88, kVectorTable = 0xE000ED08;
constexpr int kVectors = 16 + 32;

}  // namespace

extern "C" {

extern const Function vectors[kVectors];
// The core reads a copy in RAM, because it must not wait for flash that is being erased. The core wants this alignment.
alignas(256) Function vectors_in_use[kVectors];

// GCC must not turn these loops into memcpy and memset, because the data of the firmware are not there yet.
__attribute__((optimize("no-tree-loop-distribute-patterns"), noreturn)) void Reset() {
  Register(kCoprocessorAccess) = Register(kCoprocessorAccess) | (0xFu << 20);  // FPU on, before any float instruction
  __asm volatile("dsb\n isb" ::: "memory");
  const std::uint32_t* from = data_load;
  for (std::uint32_t* to = data_begin; to != data_end; ++to) *to = *from++;
  for (std::uint32_t* to = bss_begin; to != bss_end; ++to) *to = 0;
  for (int k = 0; k < kVectors; ++k) vectors_in_use[k] = vectors[k];
  Register(kVectorTable) = reinterpret_cast<std::uint32_t>(vectors_in_use);
  for (Function* constructor = init_array_begin; constructor != init_array_end; ++constructor) (*constructor)();
  Application();
}

// Entry 0 is the initial stack pointer. An interrupt that nobody serves ends in Fault.
__attribute__((section(".vectors"), used)) const Function vectors[kVectors] = {
    reinterpret_cast<Function>(stack_top),
    Reset,
    Fault,  // NMI
    Fault,  // hard fault
    Fault,  // memory management
    Fault,  // bus
    Fault,  // usage
    nullptr,
    nullptr,
    nullptr,
    nullptr,
    Fault,  // supervisor call
    Fault,  // debug monitor
    nullptr,
    Fault,  // PendSV
    TickInterrupt,
    Fault,            // UART0 receive
    Fault,            // UART0 transmit
    SerialInterrupt,  // UART1 receive
};

}  // extern "C"

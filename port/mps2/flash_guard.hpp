// mps2 - forbids the flash for a while, as an erase does on a controller with one bank of flash.
#pragma once

#include <cstdint>

extern "C" {
// Of the linker script: where lies what was placed in RAM, if anything was; the size of the flash, as this address.
extern std::uint32_t data_begin[], tick_end[], flash_log2_bytes[];
}

namespace armcal::port::mps2 {

// As long as it lives, any access to the flash is a fault; only the fault handler may read it. Does nothing in an image
// whose tick lies in flash. Inlined, so that its caller's place decides where it lies.
class FlashGuard {
 public:
  [[gnu::always_inline]] FlashGuard() {
    if (!TickIsInRam()) return;
    Register(kRegionBase) = kFlash | kThisRegion0;
    Register(kRegionSize) = kNoAccess | (AddressOf(flash_log2_bytes) - 1u) << 1 | kEnable;
    Register(kControl) = kEnable | kRestAsUsual;
    Wait();
  }
  [[gnu::always_inline]] ~FlashGuard() {
    if (!TickIsInRam()) return;
    Register(kControl) = 0;
    Wait();
  }
  FlashGuard(const FlashGuard&) = delete;
  FlashGuard& operator=(const FlashGuard&) = delete;

 private:
  // Of the memory protection unit.
  static constexpr std::uint32_t kControl = 0xE000ED94, kRegionBase = 0xE000ED9C, kRegionSize = 0xE000EDA0;
  static constexpr std::uint32_t kFlash = 0, kThisRegion0 = 1u << 4, kNoAccess = 1u << 28, kEnable = 1,
                                 kRestAsUsual = 4;

  [[gnu::always_inline]] static std::uint32_t AddressOf(const std::uint32_t* symbol) {
    auto address = reinterpret_cast<std::uintptr_t>(symbol);
    __asm volatile("" : "+r"(address));  // a compiler takes it for granted that two symbols have different addresses
    return address;
  }
  [[gnu::always_inline]] static bool TickIsInRam() { return AddressOf(data_begin) != AddressOf(tick_end); }
  [[gnu::always_inline]] static volatile std::uint32_t& Register(std::uint32_t address) {
    return *reinterpret_cast<volatile std::uint32_t*>(address);
  }
  [[gnu::always_inline]] static void Wait() { __asm volatile("dsb\n isb" ::: "memory"); }
};

}  // namespace armcal::port::mps2

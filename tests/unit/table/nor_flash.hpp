// table - a NOR flash whose power can fail at any instant.
#pragma once

#include <cstdint>
#include <map>
#include <random>
#include <vector>

#include "armcal/hardware/storage.hpp"

namespace armcal::test {

struct Geometry {
  std::uint32_t sectors, sector_bytes, unit;
  std::uint8_t erased;
  int busy_program = 0, busy_erase = 0;  // how often each one answers kBusy before it is done
};

// Where the power fails: in which operation (program or erase, counted from 0) and after how many of its bytes. Of the
// next byte, some bits are done.
struct Cut {
  int operation;
  std::uint32_t bytes;
};

class NorFlash {
 public:
  explicit NorFlash(const Geometry& g, std::uint32_t seed = 7)
      : geometry_(g),
        cells_(g.sectors * g.sector_bytes, g.erased),
        written_(cells_.size() / g.unit, false),
        random_(seed) {}

  hardware::Storage storage() {
    return {this, geometry_.sectors, geometry_.sector_bytes, geometry_.unit, geometry_.erased, &Read, &Program, &Erase};
  }

  void CutAt(Cut cut) { cut_ = cut; }
  void PowerUp() {
    dead_ = false;
    asked_ = 0;
    cut_ = {-1, 0};
    operations_ = 0;
  }
  // Planted faults.
  void FailOperation(int operation) { failing_ = operation; }   // answers kStorageFault, does nothing
  void SkipOperation(int operation) { skipping_ = operation; }  // answers kOk, does nothing
  void Fade(std::uint32_t address, int bit) { cells_[address] ^= static_cast<std::uint8_t>(1 << bit); }
  // From now on this bit reads wrong in a share of all readings, until it is erased or programmed.
  void MakeUnstable(std::uint32_t address, int bit, double wrong = 0.5) {
    unstable_[address] = {static_cast<std::uint8_t>(1 << bit), wrong, false};
  }
  // From now on a share of all operations wears a cell out: one bit of its range reads wrong, always or in a share of
  // all readings, and no operation mends it.
  void Wear(double share) { wear_ = share; }

  std::vector<std::uint8_t>& cells() { return cells_; }
  bool IsUnstable(std::uint32_t address) const { return unstable_.count(address) != 0; }
  int operations() const { return operations_; }
  int erases(std::uint32_t sector) const { return sector < erases_.size() ? erases_[sector] : 0; }
  bool dead() const { return dead_; }
  // A unit was programmed twice or not aligned, or a busy flash was asked something else.
  bool misused() const { return misused_; }
  const std::vector<std::uint32_t>& lengths() const { return lengths_; }  // bytes of each operation

 private:
  static core::Status Read(void* self, std::uint32_t address, std::uint8_t* bytes, std::uint32_t count) {
    auto& f = *static_cast<NorFlash*>(self);
    if (f.asked_ > 0) f.misused_ = true;
    if (f.dead_ || address + count > f.cells_.size()) return core::Status::kStorageFault;
    for (std::uint32_t i = 0; i < count; ++i) bytes[i] = f.cells_[address + i];
    for (auto at = f.unstable_.lower_bound(address); at != f.unstable_.end() && at->first < address + count; ++at)
      if (f.Chance() < at->second.wrong) bytes[at->first - address] ^= at->second.bit;
    return core::Status::kOk;
  }

  static core::Status Program(void* self, std::uint32_t address, const std::uint8_t* bytes, std::uint32_t count) {
    auto& f = *static_cast<NorFlash*>(self);
    const std::uint32_t unit = f.geometry_.unit;
    if (f.IsBusy(address, count, f.geometry_.busy_program)) return core::Status::kBusy;
    if (address % unit != 0 || count % unit != 0 || count > 64) f.misused_ = true;
    for (std::uint32_t u = address / unit; u < (address + count) / unit; ++u) {
      f.misused_ = f.misused_ || f.written_[u];
    }
    return f.Operate(address, count, [&](std::uint32_t i) {
      f.written_[(address + i) / unit] = true;
      const std::uint8_t cell = f.cells_[address + i];
      return static_cast<std::uint8_t>(f.geometry_.erased == 0xFF ? cell & bytes[i] : cell | bytes[i]);
    });
  }

  static core::Status Erase(void* self, std::uint32_t sector) {
    auto& f = *static_cast<NorFlash*>(self);
    const std::uint32_t base = sector * f.geometry_.sector_bytes;
    if (f.IsBusy(base, f.geometry_.sector_bytes, f.geometry_.busy_erase)) return core::Status::kBusy;
    if (f.erases_.size() <= sector) f.erases_.resize(sector + 1, 0);
    ++f.erases_[sector];
    return f.Operate(base, f.geometry_.sector_bytes, [&](std::uint32_t i) {
      f.written_[(base + i) / f.geometry_.unit] = false;
      return f.geometry_.erased;
    });
  }

  template <class NewValue>
  core::Status Operate(std::uint32_t base, std::uint32_t count, NewValue new_value) {
    if (dead_) return core::Status::kStorageFault;
    const int operation = operations_++;
    lengths_.push_back(count);
    if (operation == failing_) return core::Status::kStorageFault;
    if (operation == skipping_) return core::Status::kOk;
    const bool cut = operation == cut_.operation;
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint8_t old = cells_[base + i];
      if (cut && i > cut_.bytes) break;
      if (const auto weak = unstable_.find(base + i); weak != unstable_.end() && !weak->second.worn)
        unstable_.erase(weak);
      const std::uint8_t wanted = new_value(i);
      const auto done = static_cast<std::uint8_t>(random_());
      cells_[base + i] = cut && i == cut_.bytes ? static_cast<std::uint8_t>((wanted & done) | (old & ~done)) : wanted;
    }
    if (wear_ > 0.0 && Chance() < wear_) {
      const auto at = base + static_cast<std::uint32_t>(random_() % count);
      unstable_[at] = {static_cast<std::uint8_t>(1 << random_() % 8), random_() % 2 != 0 ? 1.0 : Chance(), true};
    }
    dead_ = cut;
    return cut ? core::Status::kStorageFault : core::Status::kOk;
  }

  bool IsBusy(std::uint32_t base, std::uint32_t count, int calls) {
    if (dead_) return false;
    if (asked_ > 0 && (base != asked_base_ || count != asked_count_)) misused_ = true;
    asked_base_ = base, asked_count_ = count;
    if (asked_ < calls) return ++asked_, true;
    asked_ = 0;
    return false;
  }

  struct Weak {
    std::uint8_t bit;
    double wrong;  // share of readings
    bool worn;     // for good
  };
  double Chance() { return std::uniform_real_distribution<double>(0.0, 1.0)(random_); }

  Geometry geometry_;
  std::vector<std::uint8_t> cells_;
  std::vector<bool> written_;
  std::vector<int> erases_;
  std::vector<std::uint32_t> lengths_;
  std::mt19937 random_;
  std::map<std::uint32_t, Weak> unstable_;
  double wear_ = 0.0;
  Cut cut_{-1, 0};
  int failing_ = -1, skipping_ = -1;
  int operations_ = 0;
  int asked_ = 0;  // how often the present operation has answered kBusy
  std::uint32_t asked_base_ = 0, asked_count_ = 0;
  bool dead_ = false, misused_ = false;
};

}  // namespace armcal::test

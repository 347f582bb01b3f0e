// port_linux - storage in a file that behaves like NOR flash.
#pragma once

#include <cstdint>
#include <string>

#include "armcal/hardware/storage.hpp"

namespace armcal::port_linux {

// Erasing sets bytes to 0xFF, and programming only clears bits. What an operation has written survives if the process
// ends at any instant. Whether it survives a power failure of the machine depends on the file system.
class FileStorage {
 public:
  FileStorage(std::uint32_t sector_count, std::uint32_t sector_bytes, std::uint32_t program_unit);
  ~FileStorage();
  FileStorage(const FileStorage&) = delete;
  FileStorage& operator=(const FileStorage&) = delete;

  // Opens the file, for this object alone until it is destroyed. A file that is missing or too short is filled up with
  // erased bytes. kStorageFault: the file cannot be opened or written. kBusy: another object has it, also after two
  // seconds.
  core::Status Open(const std::string& path);

  // Valid while this object lives. Context: background.
  hardware::Storage storage();

 private:
  static core::Status Read(void* self, std::uint32_t address, std::uint8_t* bytes, std::uint32_t count);
  static core::Status Program(void* self, std::uint32_t address, const std::uint8_t* bytes, std::uint32_t count);
  static core::Status Erase(void* self, std::uint32_t sector);

  std::uint32_t sector_count_, sector_bytes_, program_unit_;
  int file_ = -1;
};

}  // namespace armcal::port_linux

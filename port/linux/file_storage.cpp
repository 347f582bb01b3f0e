// port_linux - a file that plays NOR flash.
#include "port/linux/file_storage.hpp"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <chrono>
#include <thread>
#include <vector>

namespace armcal::port_linux {

using core::Status;

namespace {

constexpr std::uint8_t kErased = 0xFF;
constexpr int kTries = 200;  // a drive that has just been told to end may need some of them
constexpr auto kPause = std::chrono::milliseconds(10);

Status WriteAll(int file, std::uint32_t address, const std::vector<std::uint8_t>& bytes) {
  const ssize_t written = ::pwrite(file, bytes.data(), bytes.size(), static_cast<off_t>(address));
  return written == static_cast<ssize_t>(bytes.size()) ? Status::kOk : Status::kStorageFault;
}

bool IsTaken(int file) {
  for (int k = 0; k < kTries; ++k) {
    if (::flock(file, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return false;
    std::this_thread::sleep_for(kPause);
  }
  return true;
}

}  // namespace

FileStorage::FileStorage(std::uint32_t sector_count, std::uint32_t sector_bytes, std::uint32_t program_unit)
    : sector_count_(sector_count), sector_bytes_(sector_bytes), program_unit_(program_unit) {}

FileStorage::~FileStorage() {
  if (file_ >= 0) ::close(file_);
}

Status FileStorage::Open(const std::string& path) {
  file_ = ::open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0644);
  struct stat info;
  if (file_ < 0 || ::fstat(file_, &info) != 0) return Status::kStorageFault;
  if (IsTaken(file_)) return Status::kBusy;
  const auto wanted = static_cast<std::size_t>(sector_count_) * sector_bytes_;
  const auto there = static_cast<std::size_t>(info.st_size);
  if (there >= wanted) return Status::kOk;
  return WriteAll(file_, static_cast<std::uint32_t>(there), std::vector<std::uint8_t>(wanted - there, kErased));
}

hardware::Storage FileStorage::storage() {
  return {this, sector_count_, sector_bytes_, program_unit_, kErased, &Read, &Program, &Erase};
}

Status FileStorage::Read(void* self, std::uint32_t address, std::uint8_t* bytes, std::uint32_t count) {
  const auto& s = *static_cast<FileStorage*>(self);
  const ssize_t read = ::pread(s.file_, bytes, count, static_cast<off_t>(address));
  return read == static_cast<ssize_t>(count) ? Status::kOk : Status::kStorageFault;
}

Status FileStorage::Program(void* self, std::uint32_t address, const std::uint8_t* bytes, std::uint32_t count) {
  const auto& s = *static_cast<FileStorage*>(self);
  if (address % s.program_unit_ != 0 || count % s.program_unit_ != 0) return Status::kStorageFault;
  std::vector<std::uint8_t> cells(count);
  const Status read = Read(self, address, cells.data(), count);
  if (!core::IsOk(read)) return read;
  for (std::uint32_t i = 0; i < count; ++i) cells[i] &= bytes[i];
  return WriteAll(s.file_, address, cells);
}

Status FileStorage::Erase(void* self, std::uint32_t sector) {
  const auto& s = *static_cast<FileStorage*>(self);
  if (sector >= s.sector_count_) return Status::kStorageFault;
  return WriteAll(s.file_, sector * s.sector_bytes_, std::vector<std::uint8_t>(s.sector_bytes_, kErased));
}

}  // namespace armcal::port_linux

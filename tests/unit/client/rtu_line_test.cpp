// client - RTU over two pseudo-terminals joined back to back, spoken by libmodbus.
#include <gtest/gtest.h>

#include <fcntl.h>
#include <modbus.h>
#include <poll.h>
#include <stdlib.h>
#include <unistd.h>

#include <atomic>
#include <string>
#include <thread>

#include "armcal/link/rtu_service.hpp"
#include "port/linux/steady_clock.hpp"
#include "port/linux/tty_serial.hpp"
#include "tests/unit/link/test_device.hpp"

namespace {

using namespace armcal;

struct Terminal {
  Terminal() : master(::posix_openpt(O_RDWR | O_NOCTTY | O_NONBLOCK)) {
    ::grantpt(master);
    ::unlockpt(master);
    path = ::ptsname(master);
  }
  ~Terminal() { ::close(master); }
  int master;
  std::string path;
};

void Move(int from, int to) {
  char bytes[256];
  const ssize_t count = ::read(from, bytes, sizeof bytes);
  if (count > 0) {
    const ssize_t written = ::write(to, bytes, static_cast<std::size_t>(count));
    EXPECT_EQ(written, count);
  }
}

TEST(RtuLine, Libmodbus_ReadsWritesAndIsRefused) {
  Terminal client, drive_side;
  port_linux::TtySerial serial;
  ASSERT_EQ(serial.Open(drive_side.path, 115200, port_linux::Parity::kNone), core::Status::kOk);
  test::TestDevice drive;
  std::atomic<std::uint32_t> ticks{0};
  link::RtuService service(drive.device.engine(), serial.serial(), port_linux::SteadyClock(ticks), 9, 20);

  modbus_t* modbus = modbus_new_rtu(client.path.c_str(), 115200, 'N', 8, 1);
  ASSERT_NE(modbus, nullptr);
  modbus_set_slave(modbus, 9);
  modbus_set_response_timeout(modbus, 5, 0);
  ASSERT_EQ(modbus_connect(modbus), 0);

  std::atomic<bool> stop{false};
  std::thread line([&] {
    while (!stop) {
      pollfd watched[2] = {{client.master, POLLIN, 0}, {drive_side.master, POLLIN, 0}};
      ::poll(watched, 2, 1);
      Move(client.master, drive_side.master);
      service.Poll();
      Move(drive_side.master, client.master);
    }
  });

  std::uint16_t words[2] = {};
  EXPECT_EQ(modbus_read_input_registers(modbus, 14, 2, words), 2) << modbus_strerror(errno);
  EXPECT_EQ(words[0], 0x1234);
  EXPECT_EQ(words[1], 0x5678);
  const std::uint16_t out[2] = {0xAAAA, 0x5555};
  EXPECT_EQ(modbus_write_registers(modbus, link::reg::kScratch, 2, out), 2);
  EXPECT_EQ(modbus_read_registers(modbus, link::reg::kScratch, 2, words), 2);
  EXPECT_EQ(words[0], 0xAAAA);
  EXPECT_EQ(modbus_read_input_registers(modbus, 0x30, 1, words), -1);
  EXPECT_EQ(errno, EMBXILADD);
  std::uint8_t bits;
  EXPECT_EQ(modbus_read_bits(modbus, 0, 1, &bits), -1);
  EXPECT_EQ(errno, EMBXILFUN) << "an undeclared function is answered, not dropped";

  stop = true;
  line.join();
  modbus_close(modbus);
  modbus_free(modbus);
}

TEST(TtySerial, PathThatIsNoTerminal_IsRefused) {
  port_linux::TtySerial serial;
  EXPECT_EQ(serial.Open("/dev/null"), core::Status::kBadAddress);
  EXPECT_EQ(serial.Open("/dev/does-not-exist"), core::Status::kBadAddress);
  EXPECT_EQ(serial.Open("/dev/null", 12345), core::Status::kOutOfRange);
}

}  // namespace

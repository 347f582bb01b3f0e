// client - libmodbus speaks RTU over two pseudo-terminals that a thread connects.
#include <gtest/gtest.h>

#include <fcntl.h>
#include <modbus.h>
#include <poll.h>
#include <stdlib.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <atomic>
#include <string>
#include <thread>

#include "armcal/link/rtu.hpp"
#include "host_sim/client/table_flash.hpp"
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

// A drive with address 9 at the far end of the line.
class RtuLine : public testing::Test {
 protected:
  void SetUp() override {
    ASSERT_EQ(serial_.Open(drive_side_.path, 115200, port_linux::Parity::kNone), core::Status::kOk);
    line_ = std::thread([this] { Carry(); });
  }
  void TearDown() override {
    stop_ = true;
    if (line_.joinable()) line_.join();
  }
  Terminal client_;
  test::TestDevice drive_;

 private:
  void Carry() {
    while (!stop_) {
      pollfd watched[2] = {{client_.master, POLLIN, 0}, {drive_side_.master, POLLIN, 0}};
      ::poll(watched, 2, 1);
      Move(client_.master, drive_side_.master);
      service_.Poll();
      drive_.device.Step(clock_.Ms());
      Move(drive_side_.master, client_.master);
    }
  }
  Terminal drive_side_;
  port_linux::TtySerial serial_;
  std::atomic<std::uint32_t> ticks_{0};
  const hardware::Clock clock_ = port_linux::SteadyClock(ticks_);
  link::RtuService service_{drive_.device.engine(), serial_.serial(), clock_, 9, 20};
  std::atomic<bool> stop_{false};
  std::thread line_;
};

TEST_F(RtuLine, Libmodbus_ReadsWritesAndIsRefused) {
  modbus_t* modbus = modbus_new_rtu(client_.path.c_str(), 115200, 'N', 8, 1);
  ASSERT_NE(modbus, nullptr);
  modbus_set_slave(modbus, 9);
  modbus_set_response_timeout(modbus, 5, 0);
  ASSERT_EQ(modbus_connect(modbus), 0);

  std::uint16_t words[2] = {};
  EXPECT_EQ(modbus_read_input_registers(modbus, 14, 2, words), 2) << modbus_strerror(errno);
  EXPECT_EQ(words[0], 0x1234);
  EXPECT_EQ(words[1], 0x5678);
  const std::uint16_t out[2] = {0xAAAA, 0x5555};
  EXPECT_EQ(modbus_write_registers(modbus, link::reg::kScratch.address, 2, out), 2);
  EXPECT_EQ(modbus_read_registers(modbus, link::reg::kScratch.address, 2, words), 2);
  EXPECT_EQ(words[0], 0xAAAA);
  EXPECT_EQ(modbus_read_input_registers(modbus, 0x30, 1, words), -1);
  EXPECT_EQ(errno, EMBXILADD);
  std::uint8_t bits;
  EXPECT_EQ(modbus_read_bits(modbus, 0, 1, &bits), -1);
  EXPECT_EQ(errno, EMBXILFUN) << "an undeclared function is answered, not dropped";

  modbus_close(modbus);
  modbus_free(modbus);
}

TEST_F(RtuLine, DriveClient_FlashesATable) {
  client::DriveClient drive(client::SerialLine{client_.path, 115200, 'N'}, 9);
  EXPECT_EQ(drive.ReadIdentity().table_words, test::kTableWords);
  EXPECT_EQ(client::FlashTable(drive, test::MakeTable(1)).store_sequence, 1u);
  EXPECT_EQ(client::ReadActiveTable(drive), test::MakeTable(1));
  EXPECT_THROW(client::FlashTable(drive, test::MakeTable(2, 0x11112222)), client::RefusedError);
  EXPECT_EQ(client::ReadActiveTable(drive), test::MakeTable(1));
}

TEST_F(RtuLine, DriveClient_KeepsTheLineForItselfUntilItGoes) {
  const int line = ::open(client_.path.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
  ASSERT_GE(line, 0);
  const auto exclusive = [&] {
    int on = -1;
    EXPECT_EQ(::ioctl(line, TIOCGEXCL, &on), 0);
    return on;
  };
  {
    client::DriveClient drive(client::SerialLine{client_.path, 115200, 'N'}, 9);
    EXPECT_EQ(exclusive(), 1);
  }
  EXPECT_EQ(exclusive(), 0);
  ::close(line);
}

TEST(SerialLine, ThatIsNotThere_IsALinkError) {
  EXPECT_THROW(client::DriveClient(client::SerialLine{"/dev/does-not-exist"}), client::LinkError);
}

TEST(TtySerial, PathThatIsNoTerminal_IsRefused) {
  port_linux::TtySerial serial;
  EXPECT_EQ(serial.Open("/dev/null"), core::Status::kBadAddress);
  EXPECT_EQ(serial.Open("/dev/does-not-exist"), core::Status::kBadAddress);
  EXPECT_EQ(serial.Open("/dev/null", 12345), core::Status::kOutOfRange);
}

}  // namespace

// end-to-end tests - the public rules of Modbus, asked of a running drive over TCP and over a serial line.
//
// Which registers there are is known from SPEC.md; everything else is known from the public documents alone (see
// modbus_master.hpp). AP: Application Protocol, TCP: Messaging on TCP/IP, SL: over Serial Line. For a run on another
// drive: ARMCAL_MODBUS_TTY names its serial line, ARMCAL_MODBUS_SILENCE_MS the pause that ends a frame there.
#include <fcntl.h>
#include <stdlib.h>
#include <termios.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <functional>

#include "tests/e2e/modbus_master.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests::modbus {
namespace {

// Registers of SPEC.md.
constexpr int kProbe = 0x000E;                         // input, 0x12345678
constexpr int kScratch = 0x0020, kScratchCount = 32;   // holding, any value
constexpr int kCommand = 0x0000, kUnlock = 0x0040;     // holding
constexpr int kStage = 0x1000, kActive = 0x2000;       // holding, hundreds of registers
constexpr int kNoInput = 0x003F, kNoHolding = 0x0042;  // behind the first lies a register, before the other
constexpr int kServed[] = {3, 4, 6, 16, 23, 43};

// How many rules were asked, and how many were broken, of each kind.
struct Count {
  int must = 0, should = 0, must_broken = 0, should_broken = 0;
} count;

class PrintCount : public testing::Environment {
 public:
  void TearDown() override {
    std::printf("%d checks of MUST, %d broken; %d checks of SHOULD, %d broken\n", count.must, count.must_broken,
                count.should, count.should_broken);
  }
};
const auto* const print_count = testing::AddGlobalTestEnvironment(new PrintCount);

void Must(bool kept, const std::string& rule) {
  ++count.must;
  if (kept) return;
  ++count.must_broken;
  ADD_FAILURE() << "MUST: " << rule;
}
void Should(bool kept, const std::string& rule) {
  ++count.should;
  if (kept) return;
  ++count.should_broken;
  ADD_FAILURE() << "SHOULD: " << rule;
}
void MustBe(const Bytes& reply, const Bytes& wanted, const std::string& rule) {
  Must(reply == wanted, rule + ": the reply is " + Hex(reply) + ", expected " + Hex(wanted));
}
// The request is refused with this exception.
void MustRefuse(Line& line, const Bytes& request, int exception, const std::string& rule) {
  MustBe(line.Ask(request), {static_cast<std::uint8_t>(request[0] | 0x80), static_cast<std::uint8_t>(exception)}, rule);
}

std::vector<int> Words(int quantity, int seed) {
  std::vector<int> words;
  for (int k = 0; k < quantity; ++k) words.push_back((seed + k * 40503) & 0xFFFF);
  return words;
}
// A write whose byte count, and so many bytes, follow.
Bytes Filled(Bytes pdu, int bytes) {
  pdu.push_back(static_cast<std::uint8_t>(bytes));
  pdu.insert(pdu.end(), static_cast<std::size_t>(bytes), 0x5A);
  return pdu;
}
Bytes ReplyToRead(int function, const std::vector<int>& words) {
  return Join({static_cast<std::uint8_t>(function), static_cast<std::uint8_t>(2 * words.size())}, words);
}

// A pseudo-terminal whose other end is the drive's line, or the line of another drive.
class Terminal {
 public:
  Terminal() {
    if (const char* const other = std::getenv("ARMCAL_MODBUS_TTY")) {
      file_ = ::open(other, O_RDWR | O_NOCTTY | O_CLOEXEC);
      MakeRaw(file_);
      return;
    }
    file_ = ::posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
    ::grantpt(file_), ::unlockpt(file_);
    path_ = ::ptsname(file_);
    kept_ = ::open(path_.c_str(), O_RDWR | O_NOCTTY | O_CLOEXEC);
    MakeRaw(kept_);
  }
  ~Terminal() { ::close(file_), ::close(kept_); }
  Terminal(const Terminal&) = delete;
  int file() const { return file_; }
  const std::string& path() const { return path_; }

 private:
  static void MakeRaw(int file) {
    termios settings;
    ::tcgetattr(file, &settings);
    ::cfmakeraw(&settings);
    ::tcsetattr(file, TCSANOW, &settings);
  }
  int file_ = -1, kept_ = -1;
  std::string path_;
};

// One drive for all tests of this file, with a TCP port and a serial line; or a serial line to another drive.
struct Drive {
  static constexpr int kSilence_ms = 20;  // as the simulated drive states it

  Drive() : serial(terminal.file(), Silence_ms()) {
    if (!other())
      running = std::make_unique<RunningDrive>(FreshFolder("modbus_rules"), "none",
                                               std::vector<std::string>{"--serial", terminal.path()});
  }
  static bool other() { return std::getenv("ARMCAL_MODBUS_TTY") != nullptr; }
  static int Silence_ms() {
    const char* const given = std::getenv("ARMCAL_MODBUS_SILENCE_MS");
    return given ? std::atoi(given) : kSilence_ms;
  }
  int port() const { return running->port(); }

  Terminal terminal;
  RtuLine serial;
  std::unique_ptr<RunningDrive> running;
};

Drive& TheDrive() {
  static Drive drive;
  return drive;
}
struct EndDrive : testing::Environment {
  void TearDown() override { TheDrive().running.reset(); }
};
const auto* const end_drive = testing::AddGlobalTestEnvironment(new EndDrive);

// What holds for a request, whatever line it comes over.
class Requests : public testing::TestWithParam<const char*> {
 protected:
  void SetUp() override {
    if (std::string(GetParam()) == "serial") return;
    if (Drive::other()) GTEST_SKIP() << "the other drive has a serial line alone";
    tcp_ = std::make_unique<TcpLine>(TheDrive().port());
    ASSERT_TRUE(tcp_->connected());
  }
  void TearDown() override {
    if (IsSkipped()) return;
    // Whatever was asked: the drive is alive, and answers on the same line.
    if (!tcp_) TheDrive().serial.Rest();
    MustBe(Ask(ReadInput(kProbe, 2)), ReplyToRead(4, {0x1234, 0x5678}), "the line goes on after these requests");
  }
  Line& line() { return tcp_ ? static_cast<Line&>(*tcp_) : TheDrive().serial; }
  Bytes Ask(const Bytes& pdu) { return line().Ask(pdu); }

 private:
  std::unique_ptr<TcpLine> tcp_;
};
INSTANTIATE_TEST_SUITE_P(Modbus, Requests, testing::Values("tcp", "serial"),
                         [](const auto& of) { return std::string(of.param); });

TEST_P(Requests, ReadingRegisters) {
  MustBe(Ask(ReadInput(kProbe, 1)), ReplyToRead(4, {0x1234}), "AP 6.4: one register, high byte first");
  for (const int quantity : {2, 10, 25}) {
    const Bytes reply = Ask(ReadInput(0, quantity));
    Must(reply.size() == 2u + 2 * quantity && reply[0] == 4 && reply[1] == 2 * quantity,
         "AP 6.4: byte count 2 N and N registers; " + Hex(reply));
  }
  const Bytes many = Ask(ReadHolding(kActive, 125));
  Must(many.size() == 252 && many[0] == 3 && many[1] == 250, "AP 6.3: 125 registers are read at once");
  const Bytes first = Ask(ReadHolding(kActive + 7, 1));
  Must(first.size() == 4 && WordAt(first, 2) == WordAt(many, 2 + 14), "AP 4.3: each register has one address");
  for (const int function : {3, 4}) {
    const auto read = [&](int at, int quantity) { return Join({static_cast<std::uint8_t>(function)}, {at, quantity}); };
    const int good = function == 3 ? kScratch : kProbe, none = function == 3 ? kNoHolding : kNoInput;
    const std::string name = function == 3 ? "AP 6.3: " : "AP 6.4: ";
    for (const int quantity : {0, 126, 127, 255, 256, 0x7FFF, 0xFFFF})
      MustRefuse(line(), read(good, quantity), 3, name + "quantity " + std::to_string(quantity));
    MustRefuse(line(), read(none, 0), 3, name + "the quantity is judged before the address");
    MustRefuse(line(), read(none, 1), 2, name + "an address that does not exist");
    MustRefuse(line(), read(0xFFFF, 1), 2, name + "the last address");
    MustRefuse(line(), read(0xFFFF, 2), 2, name + "beyond the last address");
    MustRefuse(line(), read(function == 3 ? none - 2 : none - 1, 3), 2, name + "a range of which a part exists");
    if (!line().ends_by_itself()) continue;
    for (const int size : {1, 2, 3, 4}) {
      Bytes cut = read(good, 1);
      cut.resize(static_cast<std::size_t>(size));
      MustRefuse(line(), cut, 3, name + "a request that is too short");
    }
    MustRefuse(line(), Joined(read(good, 1), {0}), 3, name + "a request that is too long");
  }
}

TEST_P(Requests, WritingOneRegister) {
  for (const int value : {0, 0xFFFF, 0xA55A, 1, 0x8000}) {
    MustBe(Ask(WriteOne(kScratch, value)), WriteOne(kScratch, value), "AP 6.6: the reply echoes the request");
    MustBe(Ask(ReadHolding(kScratch, 1)), ReplyToRead(3, {value}), "AP 6.6: the value is there");
  }
  MustRefuse(line(), WriteOne(kNoHolding, 1), 2, "AP 6.6: an address that does not exist");
  MustRefuse(line(), WriteOne(0xFFFF, 1), 2, "AP 6.6: the last address");
  if (!line().ends_by_itself()) return;
  MustRefuse(line(), {6, 0, kScratch, 1}, 3, "AP 6.6: too short");
  MustRefuse(line(), Joined(WriteOne(kScratch, 1), {1}), 3, "AP 6.6: too long");
}

TEST_P(Requests, WritingRegisters) {
  for (const int quantity : {1, 2, 31, kScratchCount}) {
    const std::vector<int> words = Words(quantity, 17 * quantity);
    MustBe(Ask(WriteMany(kScratch, words)), Join({16}, {kScratch, quantity}), "AP 6.12: address and quantity return");
    MustBe(Ask(ReadHolding(kScratch, quantity)), ReplyToRead(3, words), "AP 6.12: the values are there");
  }
  const std::vector<int> before = Words(kScratchCount, 99);
  Ask(WriteMany(kScratch, before));
  const auto unchanged = [&](const std::string& rule) {
    MustBe(Ask(ReadHolding(kScratch, kScratchCount)), ReplyToRead(3, before), rule + ": nothing is written");
  };
  MustRefuse(line(), WriteMany(kNoHolding, {1}), 2, "AP 6.12: an address that does not exist");
  MustRefuse(line(), WriteMany(0xFFFF, {1, 2}), 2, "AP 6.12: beyond the last address");
  MustRefuse(line(), WriteMany(kScratch + kScratchCount - 1, {1, 2}), 2, "AP 6.12: a range of which a part exists");
  unchanged("AP 6.12: a range of which a part exists");
  // Quantity and byte count that do not fit each other. The number of bytes that follow fits the byte count.
  const auto odd = [&](int quantity, int bytes) { return Filled(Join({16}, {kScratch, quantity}), bytes); };
  MustRefuse(line(), odd(0, 0), 3, "AP 6.12: quantity 0");
  MustRefuse(line(), odd(1, 1), 3, "AP 6.12: an odd byte count");
  MustRefuse(line(), odd(1, 4), 3, "AP 6.12: a byte count that is too large");
  MustRefuse(line(), odd(3, 4), 3, "AP 6.12: a byte count that is too small");
  MustRefuse(line(), odd(124, 246), 3, "AP 6.12: quantity 124");
  MustRefuse(line(), odd(0x1001, 2), 3, "AP 6.12: a quantity whose low byte fits");
  unchanged("AP 6.12: a wrong quantity");
  if (!line().ends_by_itself()) return;
  Bytes cut = WriteMany(kScratch, {1, 2});
  cut.pop_back();
  MustRefuse(line(), cut, 3, "AP 6.12: fewer bytes than the byte count says");
  MustRefuse(line(), Joined(WriteMany(kScratch, {1, 2}), {0}), 3, "AP 6.12: more bytes than the byte count says");
  MustRefuse(line(), {16, 0, kScratch}, 3, "AP 6.12: too short");
  unchanged("AP 6.12: a wrong length");
}

// 123 registers that can be written exist only while a table is loaded: see "Flashing a table" in SPEC.md.
TEST_P(Requests, WritingAsManyRegistersAsThereMayBe) {
  const Bytes schema = Ask(ReadInput(6, 2)), size = Ask(ReadInput(19, 1));
  ASSERT_EQ(schema.size(), 6u);
  ASSERT_EQ(Ask(WriteMany(kUnlock, {0x6B6C, 0x6E75})), Join({16}, {kUnlock, 2}));
  const int sequence = 1 + WordAt(Ask(ReadInput(0x4B, 1)), 2);
  ASSERT_EQ(Ask(WriteMany(kCommand, {0, sequence, 0x6E65, 0x706F, WordAt(schema, 2), WordAt(schema, 4), WordAt(size, 2),
                                     0, 0, 0})),
            Join({16}, {kCommand, 10}));
  const std::vector<int> words = Words(123, 5);
  MustBe(Ask(WriteMany(kStage, words)), Join({16}, {kStage, 123}), "AP 6.12: 123 registers are written at once");
  MustBe(Ask(ReadHolding(kStage, 123)), ReplyToRead(3, words), "AP 6.12: all of them are there");
  const std::vector<int> other = Words(121, 7);
  MustBe(Ask(WriteThenRead(kStage, 121, kStage, other)), ReplyToRead(23, other), "AP 6.17: 121 registers are written");
  MustBe(Ask(WriteThenRead(kActive, 125, kStage, {1})).size() == 252 ? Bytes{1} : Bytes{}, {1},
         "AP 6.17: 125 registers are read");
  ASSERT_EQ(Ask(WriteMany(kUnlock, {0, 0})), Join({16}, {kUnlock, 2}));
}

TEST_P(Requests, WritingAndReadingAtOnce) {
  const std::vector<int> words = Words(8, 3);
  MustBe(Ask(WriteThenRead(kScratch, 8, kScratch, words)), ReplyToRead(23, words), "AP 6.17: the write comes first");
  MustBe(Ask(WriteThenRead(kScratch, 2, kScratch + 2, {7, 8})), ReplyToRead(23, {words[0], words[1]}),
         "AP 6.17: other registers may be read");
  const std::vector<int> now = {words[0], words[1], 7, 8};
  const auto unchanged = [&](const std::string& rule) {
    MustBe(Ask(ReadHolding(kScratch, 4)), ReplyToRead(3, now), rule + ": nothing is written");
  };
  for (const int quantity : {0, 126, 0xFFFF})
    MustRefuse(line(), WriteThenRead(kScratch, quantity, kScratch, {1}), 3, "AP 6.17: a wrong quantity to read");
  MustRefuse(line(), WriteThenRead(kNoHolding, 1, kScratch, {1}), 2, "AP 6.17: no such register to read");
  MustRefuse(line(), WriteThenRead(0xFFFF, 2, kScratch, {1}), 2, "AP 6.17: beyond the last address to read");
  MustRefuse(line(), WriteThenRead(kScratch, 1, kNoHolding, {1}), 2, "AP 6.17: no such register to write");
  unchanged("AP 6.17: a wrong range");
  const auto odd = [&](int quantity, int bytes) {
    return Filled(Join({23}, {kScratch, 1, kScratch, quantity}), bytes);
  };
  MustRefuse(line(), odd(0, 0), 3, "AP 6.17: nothing to write");
  MustRefuse(line(), odd(122, 242), 3, "AP 6.17: 122 registers to write");
  MustRefuse(line(), odd(1, 4), 3, "AP 6.17: a byte count that does not fit");
  MustRefuse(line(), odd(1, 1), 3, "AP 6.17: an odd byte count");
  unchanged("AP 6.17: a wrong quantity");
}

struct Identification {
  bool sound = false;
  int conformity = 0;
  std::vector<std::pair<int, std::string>> objects;
};
Identification Parse(const Bytes& reply, int code) {
  Identification id;
  if (reply.size() < 7 || reply[0] != 43 || reply[1] != 14 || reply[2] != code) return id;
  id.conformity = reply[3];
  std::size_t at = 7;
  for (int k = 0; k < reply[6]; ++k) {
    if (at + 2 > reply.size() || at + 2 + reply[at + 1] > reply.size()) return id;
    id.objects.emplace_back(reply[at], std::string(reply.begin() + static_cast<long>(at) + 2,
                                                   reply.begin() + static_cast<long>(at) + 2 + reply[at + 1]));
    at += 2u + reply[at + 1];
  }
  id.sound = at == reply.size() && reply[4] == 0 && reply[5] == 0;
  return id;
}

TEST_P(Requests, Identification) {
  const Identification basic = Parse(Ask(Identify(1, 0)), 1);
  Must(basic.sound, "AP 6.21: the reply's parts fit its length; nothing more follows, and the next object is 0");
  const int level = basic.conformity & 0x7F;
  Must(level >= 1 && level <= 3, "AP 6.21: conformity level");
  Must(basic.objects.size() == 3, "AP 6.21: vendor, product and revision are mandatory");
  for (std::size_t k = 0; k < basic.objects.size(); ++k) {
    const auto& [number, text] = basic.objects[k];
    Must(number == static_cast<int>(k), "AP 6.21: the objects come in their order");
    Must(!text.empty() && std::all_of(text.begin(), text.end(), [](char c) { return c >= 32 && c < 127; }),
         "AP 6.21: the text is ASCII");
    if ((basic.conformity & 0x80) == 0) continue;
    const Identification one = Parse(Ask(Identify(4, number)), 4);
    Must(one.sound && one.objects.size() == 1 && one.objects[0] == basic.objects[k],
         "AP 6.21: individual access gives the same object");
  }
  for (const int code : {2, 3}) {
    const Identification more = Parse(Ask(Identify(code, 0)), code);
    Must(more.sound && more.conformity == basic.conformity && (level >= code || more.objects == basic.objects),
         "AP 6.21: more than the device has is answered with what it has");
  }
  const Identification from = Parse(Ask(Identify(1, 1)), 1);
  Must(from.sound && !from.objects.empty() && from.objects[0].first == 1, "AP 6.21: a stream from object 1 on");
  for (const int object : {3, 0x7F, 0xFF}) {
    const Identification again = Parse(Ask(Identify(1, object)), 1);
    Must(again.sound && again.objects == basic.objects, "AP 6.21: an unknown object restarts the stream");
    if (basic.conformity & 0x80)
      MustRefuse(line(), Identify(4, object), 2, "AP 6.21: individual access to an unknown object");
  }
  for (const int code : {0, 5, 0xFF}) MustRefuse(line(), Identify(code, 0), 3, "AP 6.21: an unknown code");
  if (line().ends_by_itself()) MustRefuse(line(), {43, 13, 0, 0}, 1, "AP 6.19: a MEI type that is not served");
}

TEST_P(Requests, FunctionsThatAreNotServed) {
  for (int function = 1; function < 128; ++function) {
    if (std::find(std::begin(kServed), std::end(kServed), function) != std::end(kServed)) continue;
    // The end of an unknown function's request is silence; all of them would take long.
    if (!line().ends_by_itself() && function % 16 != 1 && function != 5 && function != 15 && function != 22) continue;
    MustRefuse(line(), Join({static_cast<std::uint8_t>(function)}, {0, 1}), 1,
               "AP 7: function " + std::to_string(function) + " is not served");
  }
}

TEST_P(Requests, WhatIsNoFunction_IsNotCarriedOut) {
  for (const int function : {0, 128, 131, 144, 255}) {
    const Bytes reply = Ask(Join({static_cast<std::uint8_t>(function)}, {0, 1}));
    Must(reply.empty() || (reply.size() == 2 && (reply[0] & 0x80) != 0),
         "AP 4.1: function " + std::to_string(function) + " is answered with an exception or not at all");
  }
}

class Tcp : public testing::Test {
 protected:
  void SetUp() override {
    if (Drive::other()) GTEST_SKIP() << "the other drive has a serial line alone";
  }
  void TearDown() override {
    if (IsSkipped()) return;
    TcpLine line(TheDrive().port());
    MustBe(line.Ask(ReadInput(kProbe, 2)), kSound, "TCP: the drive serves a new connection");
  }
  const Bytes kRead = ReadInput(kProbe, 2), kSound = ReplyToRead(4, {0x1234, 0x5678});
};

TEST_F(Tcp, TheHeader_Returns) {
  TcpLine line(TheDrive().port());
  for (const int transaction : {0, 1, 0x1234, 0x8000, 0xFFFF})
    for (const int unit : {0, 1, 17, 247, 255}) {
      line.Send(TcpLine::Frame(transaction, unit, kRead));
      MustBe(line.Receive(), TcpLine::Frame(transaction, unit, kSound), "TCP 3.1.3: the header of a reply");
      line.Send(TcpLine::Frame(transaction, unit, ReadInput(kNoInput, 1)));
      MustBe(line.Receive(), TcpLine::Frame(transaction, unit, {0x84, 2}), "TCP 3.1.3: the header of an exception");
    }
  Must(line.connected(), "TCP 4.2: an exception does not close the connection");
}

TEST_F(Tcp, ARequest_MayComeInParts_AndSeveralInOne) {
  TcpLine line(TheDrive().port());
  for (const std::uint8_t byte : TcpLine::Frame(7, 1, kRead)) line.Send({byte});
  MustBe(line.Receive(), TcpLine::Frame(7, 1, kSound), "TCP 4.4: a request byte by byte");
  Bytes several;
  for (int k = 0; k < 16; ++k) several = Joined(several, TcpLine::Frame(1000 + k, k, ReadInput(0, 1 + k)));
  line.Send(several);
  std::vector<int> told;
  for (int k = 0; k < 16; ++k) {
    const Bytes frame = line.Receive();
    const int which = WordAt(frame, 0) - 1000;
    told.push_back(which);
    Must(which >= 0 && which < 16 && frame.size() == 9u + 2 * (1 + which),
         "TCP 4.2: each of several requests gets its own reply, told by its transaction");
  }
  std::sort(told.begin(), told.end());
  Must(std::unique(told.begin(), told.end()) == told.end(), "TCP 4.2: no request is answered twice");
}

TEST_F(Tcp, FramesThatAreNotModbus_AreNotAnswered) {
  for (const int protocol : {1, 0x0100, 0xFFFF}) {
    TcpLine line(TheDrive().port());
    line.Send(TcpLine::Frame(1, 1, kRead, protocol));
    MustBe(line.Receive(300), {}, "TCP 4.4.2: another protocol is discarded");
  }
  for (const int length : {0, 1, 255, 256, 0xFFFF}) {
    TcpLine line(TheDrive().port());
    line.Send(Joined(Join({}, {1, 0, length}), Joined({1}, kRead)));
    const Bytes reply = line.Receive(300);
    Must(reply.empty() || (reply.size() == 9 && (reply[7] & 0x80) != 0),
         "TCP 3.1.3: a length that no frame has is no request; " + Hex(reply));
  }
}

TEST_F(Tcp, TheLongestFrame_IsUnderstood) {
  TcpLine line(TheDrive().port());
  Bytes longest(253, 0x11);
  longest[0] = 100;  // a function that is not served
  MustBe(line.Ask(longest), {100 | 0x80, 1}, "TCP 3.1.3: 260 bytes are a frame");
}

TEST_F(Tcp, ARequestBeforeTheEndOfTheStream_IsAnswered) {
  TcpLine line(TheDrive().port());
  line.Send(TcpLine::Frame(1, 1, kRead));
  line.EndSending();
  const Bytes reply = line.Receive();
  Should(reply == TcpLine::Frame(1, 1, kSound), "TCP 4.2: a client that sends no more still gets its reply");
}

TEST_F(Tcp, SeveralConnections_AreServedAtOnce) {
  std::vector<std::unique_ptr<TcpLine>> lines;
  for (int k = 0; k < 4; ++k) lines.push_back(std::make_unique<TcpLine>(TheDrive().port(), 2 + k));
  for (int round = 0; round < 3; ++round)
    for (auto& line : lines) Should(line->Ask(kRead) == kSound, "TCP 4.2.1: several connections at once");
}

class Serial : public testing::Test {
 protected:
  void SetUp() override { line().Rest(); }
  void TearDown() override {
    line().Rest();
    MustBe(line().Ask(kRead), kSound, "SL: the next request is answered");
  }
  static RtuLine& line() { return TheDrive().serial; }
  // Nothing is heard for longer than the pause that ends a frame.
  void MustBeSilent(const std::string& rule) {
    MustBe(line().Receive(3 * line().silence_ms()), {}, rule);
    line().Rest();
  }
  const Bytes kRead = ReadInput(kProbe, 2), kSound = ReplyToRead(4, {0x1234, 0x5678});
};

TEST_F(Serial, AReply_CarriesTheAddressAndACrc_LowByteFirst) {
  line().Send(RtuLine::Frame(1, kRead));
  MustBe(line().Receive(), RtuLine::Frame(1, kSound), "SL 2.5.1: the frame of a reply");
}

TEST_F(Serial, RequestsToOthers_AreNotAnswered) {
  for (const int address : {2, 17, 247, 248, 255}) {
    line().Send(RtuLine::Frame(address, kRead));
    MustBeSilent("SL 2.2: address " + std::to_string(address));
  }
}

TEST_F(Serial, ABroadcast_IsCarriedOutAndNotAnswered) {
  line().Ask(WriteOne(kScratch, 1));
  line().Send(RtuLine::Frame(0, WriteOne(kScratch, 0x4321)));
  MustBeSilent("SL 2.1: a broadcast has no reply");
  MustBe(line().Ask(ReadHolding(kScratch, 1)), ReplyToRead(3, {0x4321}), "SL 2.1: all devices accept a broadcast");
  line().Send(RtuLine::Frame(0, WriteMany(kScratch, {5, 6})));
  MustBeSilent("SL 2.1: a broadcast has no reply");
  MustBe(line().Ask(ReadHolding(kScratch, 2)), ReplyToRead(3, {5, 6}), "SL 2.1: all devices accept a broadcast");
  line().Send(RtuLine::Frame(0, WriteOne(kNoHolding, 1)));
  MustBeSilent("SL 2.1: a broadcast that is refused has no reply");
  line().Send(RtuLine::Frame(0, kRead));
  MustBeSilent("SL 2.1: a broadcast that reads has no reply");
}

TEST_F(Serial, ADamagedFrame_IsNotAnswered) {
  const Bytes frame = RtuLine::Frame(1, kRead);
  for (std::size_t byte = 0; byte < frame.size(); ++byte) {
    Bytes damaged = frame;
    damaged[byte] ^= static_cast<std::uint8_t>(1u << byte % 8);
    line().Send(damaged);
    MustBeSilent("SL 2.5.1: a wrong CRC");
  }
  Bytes swapped = frame;
  std::swap(swapped[swapped.size() - 1], swapped[swapped.size() - 2]);
  line().Send(swapped);
  MustBeSilent("SL 2.5.1: a CRC with its high byte first");
}

TEST_F(Serial, ADamagedWrite_IsNotCarriedOut) {
  line().Ask(WriteOne(kScratch, 9));
  Bytes damaged = RtuLine::Frame(1, WriteMany(kScratch, {1, 2}));
  damaged[9] ^= 4;
  line().Send(damaged);
  MustBeSilent("SL 2.5.1: a wrong CRC");
  MustBe(line().Ask(ReadHolding(kScratch, 1)), ReplyToRead(3, {9}), "SL 2.5.1: it is not carried out either");
}

TEST_F(Serial, AFrameThatStops_IsForgottenAfterSilence) {
  const Bytes frame = RtuLine::Frame(1, WriteOne(kScratch, 77));
  line().Ask(WriteOne(kScratch, 1));
  for (const std::size_t there : {1u, 2u, 4u, 7u}) {
    // A busy machine may wake the drive too late to see the silence. A drive that does not look for it fails each time.
    Bytes reply;
    for (int attempt = 0; attempt < 3 && reply != kSound; ++attempt) {
      line().Send({frame.begin(), frame.begin() + static_cast<long>(there)});
      line().Rest();
      reply = line().Ask(kRead);
    }
    MustBe(reply, kSound, "SL 2.5.1: a part of a frame, silence, a request");
    line().Send({frame.begin(), frame.begin() + static_cast<long>(there)});
    line().Rest();
    line().Send({frame.begin() + static_cast<long>(there), frame.end()});
    MustBeSilent("SL 2.5.1: a frame with a pause in it is incomplete");
  }
  MustBe(line().Ask(ReadHolding(kScratch, 1)), ReplyToRead(3, {1}), "SL 2.5.1: it is not carried out");
}

TEST_F(Serial, AFrameThatIsTooLong_IsNotAnswered) {
  Bytes pdu(400, 0x22);
  pdu[0] = 100;
  line().Send(RtuLine::Frame(1, pdu));
  MustBeSilent("SL 2.5.1: a frame has 256 bytes at most");
  Bytes noise(300, 0x55);
  line().Send(noise);
  MustBeSilent("SL 2.5.1: noise");
  Bytes longest(253, 0x22);
  longest[0] = 100;
  MustBe(line().Ask(longest), {100 | 0x80, 1}, "SL 2.5.1: 256 bytes are a frame");
}

TEST_F(Serial, TheReplyOfAnotherDevice_IsNoRequest) {
  line().Ask(WriteOne(kScratch, 1));
  line().Send(RtuLine::Frame(2, WriteOne(kScratch, 0x55)));
  line().Send(RtuLine::Frame(2, WriteOne(kScratch, 0x55)));  // the reply of device 2 echoes its request
  MustBeSilent("SL 2.2: two frames of another device");
  line().Send(RtuLine::Frame(2, ReadHolding(kScratch, 2)));
  line().Send(RtuLine::Frame(2, ReplyToRead(3, {1, 2})));
  MustBeSilent("SL 2.2: two frames of another device");
  MustBe(line().Ask(ReadHolding(kScratch, 1)), ReplyToRead(3, {1}), "SL 2.2: nothing is carried out");
}

}  // namespace
}  // namespace armcal::tests::modbus

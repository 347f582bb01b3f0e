// client - breaks the rules on raw sockets: bad headers, half frames, floods, clients that do not read.
#include <gtest/gtest.h>

#include <arpa/inet.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "tests/unit/client/test_server.hpp"

namespace {

using namespace armcal;
using Bytes = std::vector<std::uint8_t>;

class RawClient {
 public:
  // `from`: the client's own address, 127.0.0.from.
  explicit RawClient(int port, std::uint32_t from = 1) : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in own{};
    own.sin_family = AF_INET;
    own.sin_addr.s_addr = htonl((INADDR_LOOPBACK & 0xFFFFFF00u) | from);
    ::bind(socket_, reinterpret_cast<sockaddr*>(&own), sizeof own);
    sockaddr_in where{};
    where.sin_family = AF_INET;
    where.sin_port = htons(static_cast<std::uint16_t>(port));
    where.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const int on = 1;
    ::setsockopt(socket_, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
    connected_ = ::connect(socket_, reinterpret_cast<sockaddr*>(&where), sizeof where) == 0;
  }
  ~RawClient() { ::close(socket_); }
  RawClient(const RawClient&) = delete;

  bool connected() const { return connected_; }
  void Send(const Bytes& bytes) { ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL); }
  // Bytes that the socket takes without waiting.
  ssize_t SendSome(const Bytes& bytes) {
    return ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }
  void HalfClose() { ::shutdown(socket_, SHUT_WR); }
  void Reset() {
    const linger now = {1, 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_LINGER, &now, sizeof now);
  }

  // Up to `count` bytes; fewer if the server closes (or says nothing for ten seconds).
  Bytes Receive(std::size_t count) {
    Bytes bytes;
    while (bytes.size() < count) {
      pollfd watched = {socket_, POLLIN, 0};
      std::uint8_t part[512];
      if (::poll(&watched, 1, 10000) <= 0) break;
      const ssize_t got = ::recv(socket_, part, std::min(sizeof part, count - bytes.size()), 0);
      if (got <= 0) break;
      bytes.insert(bytes.end(), part, part + got);
    }
    return bytes;
  }
  bool Closed() {
    std::uint8_t byte;
    pollfd watched = {socket_, POLLIN, 0};
    return ::poll(&watched, 1, 10000) > 0 && ::recv(socket_, &byte, 1, 0) <= 0;
  }

 private:
  int socket_;
  bool connected_ = false;
};

const Bytes kProbe = {0, 7, 0, 0, 0, 6, 1, 4, 0, 14, 0, 2};
const Bytes kAnswer = {0, 7, 0, 0, 0, 7, 1, 4, 4, 0x12, 0x34, 0x56, 0x78};

TEST(TcpServer, Requests_SentInOnePieceOrByteByByte_AreAllAnswered) {
  test::TestServer server;
  RawClient client(server.port());
  Bytes three;
  for (int i = 0; i < 3; ++i) three.insert(three.end(), kProbe.begin(), kProbe.end());
  client.Send(three);
  EXPECT_EQ(client.Receive(39).size(), 39u);
  for (const std::uint8_t byte : kProbe) client.Send({byte});
  EXPECT_EQ(client.Receive(13), kAnswer);
}

TEST(TcpServer, MalformedHeader_ClosesThatConnectionOnly) {
  test::TestServer server;
  RawClient good(server.port());
  for (const Bytes& header : {Bytes{0, 1, 0, 1, 0, 6, 1, 4, 0, 14, 0, 2}, Bytes{0, 1, 0, 0, 0, 0, 1, 4},
                              Bytes{0, 1, 0, 0, 0, 1, 1, 4}, Bytes{0, 1, 0, 0, 0, 255, 1, 4},
                              Bytes{0, 1, 0, 0, 255, 255, 1, 4}, Bytes{'G', 'E', 'T', ' ', '/', ' ', 'H', 'T'}}) {
    RawClient bad(server.port());
    bad.Send(header);
    EXPECT_TRUE(bad.Closed());
  }
  good.Send(kProbe);
  EXPECT_EQ(good.Receive(13), kAnswer);
}

TEST(TcpServer, DeclaredLength_DecidesWhereAFrameEnds) {
  test::TestServer server;
  RawClient client(server.port());
  // function 4 with one byte too many: exception 03, and the next request is understood
  client.Send({0, 9, 0, 0, 0, 7, 1, 4, 0, 14, 0, 2, 0xEE});
  EXPECT_EQ(client.Receive(9), (Bytes{0, 9, 0, 0, 0, 3, 1, 0x84, 3}));
  // function 7 has no data, so a server that guesses lengths would go wrong
  client.Send({0, 10, 0, 0, 0, 2, 1, 7});
  EXPECT_EQ(client.Receive(9), (Bytes{0, 10, 0, 0, 0, 3, 1, 0x87, 1}));
  client.Send(kProbe);
  EXPECT_EQ(client.Receive(13), kAnswer);
}

TEST(TcpServer, HalfAFrame_IsClosedAfterTwoSeconds_AndDelaysNobody) {
  test::TestServer server;
  RawClient half(server.port()), good(server.port());
  half.Send({0, 1, 0, 0, 0, 6, 1});
  good.Send(kProbe);
  EXPECT_EQ(good.Receive(13), kAnswer);
  server.Jump(2000);
  EXPECT_TRUE(half.Closed());
  good.Send(kProbe);
  EXPECT_EQ(good.Receive(13), kAnswer);
}

TEST(TcpServer, HalfClose_StillGetsItsReply) {
  test::TestServer server;
  RawClient client(server.port());
  client.Send(kProbe);
  client.HalfClose();
  EXPECT_EQ(client.Receive(13), kAnswer);
  EXPECT_TRUE(client.Closed());
}

Bytes Flood(int requests) {
  const Bytes read = {0, 1, 0, 0, 0, 6, 1, 3, 0x20, 0, 0, 125};
  Bytes flood;
  for (int i = 0; i < requests; ++i) flood.insert(flood.end(), read.begin(), read.end());
  return flood;
}

// The late client sends portions that the server takes whole, until the replies to one of them no longer fit into the
// sockets. From then on the server goes on only when there is room to send.
TEST(TcpServer, ClientThatReadsLate_GetsEveryReply) {
  constexpr std::uint32_t kPortion = 80;
  test::TestServer server;
  RawClient late(server.port());
  auto good = server.Connect();
  const Bytes portion = Flood(kPortion);
  std::uint32_t before = good.ReadValue<link::reg::kRequestCount>(), sent = 0;
  for (bool stuck = false; !stuck && sent < 200 * 1000;) {
    late.Send(portion);
    sent += kPortion;
    stuck = true;
    for (std::uint32_t asked = 1; asked <= 20 && stuck; ++asked)
      stuck = good.ReadValue<link::reg::kRequestCount>() - before - asked < kPortion;
    before = good.ReadValue<link::reg::kRequestCount>();
  }
  const std::size_t reply_bytes = std::size_t{sent} * (9 + 250);
  EXPECT_EQ(late.Receive(reply_bytes).size(), reply_bytes);
}

TEST(TcpServer, ClientThatDoesNotRead_StallsOnlyItself) {
  test::TestServer server;
  RawClient deaf(server.port()), good(server.port());
  const Bytes flood = Flood(2000);
  std::size_t sent = 0;
  for (int round = 0; round < 200; ++round) {
    const ssize_t part = deaf.SendSome(flood);
    if (part > 0) sent += static_cast<std::size_t>(part);
    good.Send(kProbe);
    ASSERT_EQ(good.Receive(13), kAnswer) << "round " << round;
  }
  EXPECT_GT(sent, 24000u);
  EXPECT_TRUE(test::Await([&] {
    server.Jump(1000);
    return server.connections() == 0;
  })) << "the deaf connection is idle, too";
}

TEST(TcpServer, ConnectionBeyondTheSlots_IsTurnedAway_AndSlotsAreReused) {
  test::TestServer server;
  {
    RawClient a(server.port()), b(server.port()), c(server.port()), d(server.port());
    d.Send(kProbe);
    EXPECT_EQ(d.Receive(13), kAnswer);
    RawClient e(server.port());
    EXPECT_TRUE(e.Closed());
    a.Send(kProbe);
    EXPECT_EQ(a.Receive(13), kAnswer);
  }
  for (int i = 0; i < 300; ++i) {
    ASSERT_TRUE(test::Await([&] { return server.connections() < 4; }));
    RawClient client(server.port());
    client.Send(kProbe);
    ASSERT_EQ(client.Receive(13), kAnswer) << i;
    if (i % 2 == 0) client.Reset();
  }
}

bool Answers(RawClient& client) {
  client.Send(kProbe);
  return client.Receive(13) == kAnswer;
}

TEST(TcpServer, AnAddressThatHoldsAllSlots_MakesRoomForAnotherAddress) {
  test::TestServer server;
  RawClient a(server.port()), b(server.port()), c(server.port()), d(server.port());
  for (RawClient* client : {&a, &b, &c, &d}) ASSERT_TRUE(Answers(*client));
  server.Jump(1000);
  for (RawClient* client : {&a, &c, &d}) ASSERT_TRUE(Answers(*client));  // b is silent longest
  RawClient other(server.port(), 2);
  EXPECT_TRUE(Answers(other));
  EXPECT_TRUE(b.Closed());
  for (RawClient* client : {&a, &c, &d}) EXPECT_TRUE(Answers(*client));
  RawClient more(server.port());
  EXPECT_TRUE(more.Closed()) << "three are its share";
  EXPECT_TRUE(Answers(other));
}

TEST(TcpServer, FourAddresses_KeepTheirOneConnection) {
  test::TestServer server;
  RawClient a(server.port(), 1), b(server.port(), 2), c(server.port(), 3), d(server.port(), 4);
  for (RawClient* client : {&a, &b, &c, &d}) ASSERT_TRUE(Answers(*client));
  RawClient fifth(server.port(), 5);
  EXPECT_TRUE(fifth.Closed());
  for (RawClient* client : {&a, &b, &c, &d}) EXPECT_TRUE(Answers(*client));
}

// The writer is silent longest, and keeps its connection all the same.
TEST(TcpServer, TheWritersConnection_IsNeverTheOneThatMakesRoom) {
  test::TestServer server;
  RawClient writer(server.port());
  const Bytes unlock = {0, 1, 0, 0, 0, 11, 1, 16, 0, 0x40, 0, 2, 4, 0x6B, 0x6C, 0x6E, 0x75};
  writer.Send(unlock);
  ASSERT_EQ(writer.Receive(12).size(), 12u);
  server.Jump(1000);
  RawClient b(server.port()), c(server.port()), d(server.port());
  for (RawClient* client : {&b, &c, &d}) ASSERT_TRUE(Answers(*client));
  std::vector<std::unique_ptr<RawClient>> others;
  for (std::uint32_t from = 2; from <= 4; ++from) {
    others.push_back(std::make_unique<RawClient>(server.port(), from));
    ASSERT_TRUE(Answers(*others.back())) << from;
  }
  writer.Send({0, 2, 0, 0, 0, 6, 1, 4, 0, 0x5E, 0, 1});
  EXPECT_EQ(writer.Receive(11), (Bytes{0, 2, 0, 0, 0, 5, 1, 4, 2, 0, 1})) << "still unlocked";
  for (const auto& other : others) EXPECT_TRUE(Answers(*other));
}

TEST(TcpServer, AnUnusedConnection_MakesRoomForTheNextOfItsAddress) {
  test::TestServer server;
  RawClient a(server.port()), b(server.port()), c(server.port()), d(server.port());
  for (RawClient* client : {&a, &b, &c, &d}) ASSERT_TRUE(Answers(*client));
  server.Jump(10000);
  for (RawClient* client : {&b, &c, &d}) ASSERT_TRUE(Answers(*client));
  RawClient e(server.port());
  EXPECT_TRUE(Answers(e));
  EXPECT_TRUE(a.Closed());
}

// A service whose requests are single bytes. It writes down whose request it takes.
struct TakenTurns {
  std::vector<int> slots;

  static void Open(void*, int) {}
  static bool Receive(void* self, int slot, const std::uint8_t*, std::size_t count, std::size_t* used, std::uint8_t*,
                      std::size_t* reply_bytes) {
    *used = count > 0, *reply_bytes = 0;
    if (count > 0) static_cast<TakenTurns*>(self)->slots.push_back(slot);
    return true;
  }
  static bool MidFrame(void*, int) { return false; }
};

TEST(TcpServer, ClientsTakeTurns_HoweverMuchOneHasSent) {
  TakenTurns turns;
  const auto stopped = [](void*) { return std::uint32_t{0}; };
  port_linux::TcpServer server({&turns, 1, &TakenTurns::Open, &TakenTurns::Receive, &TakenTurns::MidFrame},
                               {nullptr, stopped, stopped});
  ASSERT_EQ(server.Listen("127.0.0.1", 0), core::Status::kOk);
  RawClient flooding(server.port()), modest(server.port());
  while (server.connections() < 2) ASSERT_EQ(server.Poll(10), core::Status::kOk);
  flooding.Send(Bytes(100, 7));
  while (turns.slots.empty()) ASSERT_EQ(server.Poll(10), core::Status::kOk);
  modest.Send(Bytes(3, 7));
  while (turns.slots.size() < 103) ASSERT_EQ(server.Poll(10), core::Status::kOk);
  int modest_done = 0, at = 0;
  for (const int slot : turns.slots) {
    ++at;
    modest_done += slot == 1;
    if (modest_done == 3) break;
  }
  EXPECT_LE(at, 10) << "three requests of the modest client came to their turn late";
}

TEST(TcpServer, PortInUse_IsSaidClearly) {
  test::TestServer server;
  port_linux::TcpServer second({}, {nullptr, nullptr, nullptr});
  EXPECT_EQ(second.Listen("127.0.0.1", static_cast<std::uint16_t>(server.port())), core::Status::kBusy);
  EXPECT_NE(second.error().find("in use"), std::string::npos) << second.error();
  EXPECT_EQ(second.Poll(0), core::Status::kWrongOrder);
  EXPECT_EQ(second.Listen("localhost?", 0), core::Status::kOutOfRange);
}

}  // namespace

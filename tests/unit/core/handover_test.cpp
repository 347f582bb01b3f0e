// core - ring and mailbox between two threads: nothing is torn or out of order, and every loss is counted.
#include <gtest/gtest.h>

#include <atomic>
#include <thread>

#include "armcal/core/mailbox.hpp"
#include "armcal/core/sample_ring.hpp"

namespace {

using armcal::core::IsOk;
using armcal::core::Mailbox;
using armcal::core::SampleRing;
using armcal::core::Status;

// So wide that it would be torn if anything could tear it.
struct Wide {
  std::uint32_t copy[16];
};

Wide MakeWide(std::uint32_t value) {
  Wide w;
  for (auto& c : w.copy) c = value;
  return w;
}

bool Whole(const Wide& w) {
  for (const auto c : w.copy)
    if (c != w.copy[0]) return false;
  return true;
}

TEST(SampleRing, WhenFull_RefusesTheNewItemWholeAndCountsIt) {
  SampleRing<int, 4> ring;
  for (int i = 0; i < 4; ++i) EXPECT_EQ(ring.Push(i), Status::kOk);
  EXPECT_EQ(ring.Push(99), Status::kFull);
  EXPECT_EQ(ring.Push(98), Status::kFull);
  EXPECT_EQ(ring.refused(), 2u);
  EXPECT_EQ(ring.size(), 4u);
  int item = -1;
  for (int i = 0; i < 4; ++i) {
    EXPECT_EQ(ring.Pop(item), Status::kOk);
    EXPECT_EQ(item, i);
  }
  EXPECT_EQ(ring.Pop(item), Status::kEmpty);
  EXPECT_EQ(item, 3);
}

TEST(SampleRing, BetweenTwoThreads_KeepsOrderAndAccountsForEveryItem) {
  constexpr std::uint32_t kItems = 300000;
  static SampleRing<Wide, 64> ring;
  std::atomic<bool> done{false};
  std::uint32_t accepted = 0;
  std::thread producer([&] {
    for (std::uint32_t i = 1; i <= kItems; ++i) accepted += IsOk(ring.Push(MakeWide(i)));
    done = true;
  });
  std::uint32_t received = 0, last = 0;
  bool sound = true;
  for (Wide w; !done || ring.size() != 0;) {
    if (!IsOk(ring.Pop(w))) {
      std::this_thread::yield();
      continue;
    }
    sound = sound && Whole(w) && w.copy[0] > last;
    last = w.copy[0];
    ++received;
  }
  producer.join();
  EXPECT_TRUE(sound);
  EXPECT_EQ(received, accepted);
  EXPECT_EQ(accepted + ring.refused(), kItems);
}

TEST(Mailbox, Emptied_SaysThatThereIsNothingNew) {
  Mailbox<int> box;
  int value = 7;
  EXPECT_FALSE(box.Take(value));
  EXPECT_EQ(value, 7);
  box.Post(1);
  box.Post(2);
  EXPECT_TRUE(box.Take(value));
  EXPECT_EQ(value, 2);
  EXPECT_FALSE(box.Take(value));
}

TEST(Mailbox, FilledInPlace_LeavesWhatTheReaderHolds) {
  Mailbox<int> box;
  box.Post(1);
  ASSERT_TRUE(box.Refresh());
  for (int i = 2; i < 6; ++i) {
    box.draft() = i;
    EXPECT_EQ(box.latest(), 1);
    box.Publish();
  }
  EXPECT_EQ(box.latest(), 1);
  ASSERT_TRUE(box.Refresh());
  EXPECT_EQ(box.latest(), 5);
}

TEST(Mailbox, BetweenTwoThreads_NeverTearsNeverGoesBackAndEndsWithTheLatest) {
  constexpr std::uint32_t kPosts = 300000;
  static Mailbox<Wide> box;
  std::atomic<bool> done{false};
  std::thread writer([&] {
    for (std::uint32_t i = 1; i <= kPosts; ++i) box.Post(MakeWide(i));
    done = true;
  });
  std::uint32_t last = 0;
  bool sound = true;
  for (bool finished = false; !finished;) {
    finished = done;  // read before the last Take, so that the last value is not missed
    Wide w;
    if (!box.Take(w)) continue;
    sound = sound && Whole(w) && w.copy[0] > last;
    last = w.copy[0];
  }
  writer.join();
  EXPECT_TRUE(sound);
  EXPECT_EQ(last, kPosts);
}

}  // namespace

// fuzz - gives every target its corpus, and the same inputs with a few bytes changed. Long runs: tests/fuzz/fuzz.sh.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <random>
#include <vector>

#include "tests/fuzz/targets.hpp"

namespace {

using namespace armcal;
constexpr int kChanged = 200;  // of each input

TEST(Fuzz, Corpus_AndItsNeighbours_BreakNothing) {
  for (const fuzz::Target& target : fuzz::kTargets) {
    std::mt19937 random(5);
    int inputs = 0;
    for (const auto& entry : std::filesystem::directory_iterator(std::string("tests/fuzz/corpus/") + target.name)) {
      std::ifstream in(entry.path(), std::ios::binary);
      const std::vector<std::uint8_t> bytes{std::istreambuf_iterator<char>(in), {}};
      target.run(bytes.data(), bytes.size());
      ++inputs;
      for (int k = 0; k < kChanged && !bytes.empty(); ++k) {
        std::vector<std::uint8_t> changed = bytes;
        for (unsigned places = 1 + random() % 4; places > 0; --places)
          changed[random() % changed.size()] = static_cast<std::uint8_t>(random());
        if (random() % 8 == 0) changed.resize(random() % changed.size());
        target.run(changed.data(), changed.size());
      }
    }
    EXPECT_GE(inputs, 2) << target.name;
  }
}

}  // namespace

// end-to-end tests - a user's own arm on its simulated drive, from the URDF to a verdict with no editing between.
#pragma once

#include <fstream>

#include "tests/e2e/own_arms.hpp"

namespace armcal::tests {

// Compiled drives go to a folder of the test, not to the user's cache.
class OwnDrive : public testing::Test {
 protected:
  OwnDrive() : folder_(FreshFolder(testing::UnitTest::GetInstance()->current_test_info()->name())) {
    setenv("XDG_CACHE_HOME", Path("cache").c_str(), 1);
  }
  ~OwnDrive() override { unsetenv("XDG_CACHE_HOME"), unsetenv("CXX"); }

  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  std::string Robot() const { return Path("own.toml"); }

  void Imported(const ImportedArm& arm) {
    std::ofstream(Path("arm.urdf")) << arm.urdf;
    const Outcome o = Tool({"import", Path("arm.urdf"), "-o", Robot()});
    ASSERT_EQ(o.code, 0) << o.err << o.out;
  }
  // What every true arm here has: bodies, friction, rotors and torque constants of its own.
  std::string Scenario(const std::string& name, int seed, const std::string& effect = "") {
    std::ofstream(Path(name)) << "title = \"" << name << "\"\ntruth_seed = " << seed << "\nnoise_seed = " << seed + 1
                              << "\ncommand = \"ramp\"\n[truth]\nunstated_share = 0.04\n"
                              << effect;
    return Path(name);
  }
  void Excited() {
    for (const auto& [purpose, seed] : {std::pair{"train", "1"}, {"test", "2"}}) {
      const Outcome o = Tool({"excite", "--robot", Robot(), "--purpose", purpose, "--seed", seed, "--starts", "6",
                              "--search-seconds", "60", "--out", Path(std::string(purpose) + ".csv")});
      ASSERT_EQ(o.code, 0) << o.err << o.out;
    }
  }
  void Recorded(const RunningDrive& drive, const std::string& motion) {
    const Outcome o = Tool({"record", "--connect", drive.address(), "--robot", Robot(), "--trajectory",
                            Path(motion + ".csv"), "--out", Path(motion + "_log.csv.gz")});
    ASSERT_EQ(o.code, 0) << o.err << o.out;
  }

  fs::path folder_;
};

}  // namespace armcal::tests

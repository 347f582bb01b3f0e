// end-to-end tests - read a running drive with a Modbus master that is not ours, as SPEC.md says.
#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

TEST(Mbpoll, ReadsTheFloatProbeAndTheIdentity) {
  if (RunProgram({"mbpoll", "-V"}).code == 127) GTEST_SKIP() << "mbpoll is not installed (Debian package mbpoll)";
  const RunningDrive drive(FreshFolder("mbpoll"));
  const std::string port = std::to_string(drive.port());
  const Outcome probe = RunProgram({"mbpoll", "-m", "tcp", "-a", "1", "-0", "-B", "-t", "3:float", "-r", "12", "-c",
                                    "1", "-1", "-p", port, "127.0.0.1"});
  EXPECT_EQ(probe.code, 0) << probe.err;
  EXPECT_NE(probe.out.find("123457"), std::string::npos) << probe.out;
  const Outcome identity = RunProgram(
      {"mbpoll", "-m", "tcp", "-a", "1", "-0", "-t", "3:hex", "-r", "0", "-c", "12", "-1", "-p", port, "127.0.0.1"});
  EXPECT_EQ(identity.code, 0) << identity.err;
  for (const char* word : {"0x4152", "0x4D43"})  // "ARMC", high word first
    EXPECT_NE(identity.out.find(word), std::string::npos) << identity.out;
}

}  // namespace
}  // namespace armcal::tests

// codegen tests - a generator that was built without a URDF reader says which package it wants.
#include <gtest/gtest.h>

#include "codegen/src/io/input_error.hpp"
#include "codegen/src/robot/urdf.hpp"

namespace armcal::codegen {
namespace {

TEST(WithoutUrdfdom, AUrdf_IsRefusedInOneLineThatNamesThePackage) {
  try {
    ReadUrdf({"arms/my_arm.urdf", "", {}});
    FAIL() << "accepted";
  } catch (const io::InputError& e) {
    const std::string line = e.what();
    EXPECT_EQ(line.rfind("arms/my_arm.urdf: ", 0), 0u) << line;
    EXPECT_NE(line.find("liburdfdom-dev"), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace armcal::codegen

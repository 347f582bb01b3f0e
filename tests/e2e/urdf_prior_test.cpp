// end-to-end tests - an arm whose URDF holds placeholders for friction and no word of rotors: all of it is found.
#include <fmt/core.h>
#include <unistd.h>

#include <fstream>

#include "tests/e2e/urdf_arm.hpp"

namespace armcal::tests {
namespace {

const std::vector<TrueDrive> kDrive = {{1.2, 2.0, 0.6, 0.2}, {1.0, 1.8, 0.6, 0.2}, {0.8, 1.5, 0.5, 0.2},
                                       {0.7, 1.2, 0.5, 0.2}, {0.4, 0.5, 0.2, 0.1}, {0.35, 0.4, 0.2, 0.1},
                                       {0.3, 0.3, 0.1, 0.1}};

class UrdfPrior : public testing::Test {
 protected:
  // The declared URDF with this <dynamics>, its robot file, and two logs of the true arm.
  void Make(const std::string& name, const std::string& dynamics, const std::vector<TrueDrive>& drive = kDrive) {
    folder_ = FreshFolder("urdf_prior_" + name);
    std::vector<UrdfJoint> joints = SevenJoints();
    std::ofstream(Path("arm.urdf")) << SevenAxisUrdf(joints, dynamics);
    std::ofstream toml(Path("arm.toml"));
    toml << "name = \"seven\"\nsource = \"test\"\ngravity_mps2 = [0.0, 0.0, -9.81]\nurdf = \"arm.urdf\"\n";
    for (std::size_t j = 0; j < joints.size(); ++j)
      toml << "[[joint]]\nname = \"joint" << j + 1
           << "\"\nacceleration_limit_radps2 = 10.0\ntorque_noise_Nm = " << kDrive[j].noise_Nm
           << "\nv_min_radps = 0.02\n";
    toml.close();
    for (std::size_t j = 0; j < joints.size(); ++j) joints[j].mass *= j % 2 ? 1.15 : 0.88;
    std::vector<std::string> names;
    for (std::size_t j = 0; j < joints.size(); ++j) names.push_back("joint" + std::to_string(j + 1));
    const UrdfArm arm(SevenAxisUrdf(joints, ""), names, joints, drive);
    logs::WriteLog(Path("train.csv"), arm.Run(60, 125, 3));
    logs::WriteLog(Path("test.csv"), arm.Run(30, 125, 4));
  }
  std::string Path(const std::string& name) const { return (folder_ / name).string(); }
  fs::path folder_;
};

double Column(const nlohmann::json& json, const std::string& name) {
  for (const auto& row : json.at("columns"))
    if (row.at("name") == name) return row.at("value");
  ADD_FAILURE() << "no column " << name;
  return 0;
}

TEST_F(UrdfPrior, OfPlaceholders_DoesNotHoldFrictionAndRotors) {
  for (const std::string dynamics :
       {"<dynamics damping=\"0.003\" friction=\"0\"/>", "", "<dynamics damping=\"0.5\" friction=\"0.01\"/>"}) {
    SCOPED_TRACE(dynamics);
    Make("identify", dynamics);
    const Outcome o = Tool({"identify", "--robot", Path("arm.toml"), "--train", Path("train.csv"), "--test",
                            Path("test.csv"), "--json", Path("fit.json")});
    ASSERT_EQ(o.code, 0) << o.err << o.out;
    const nlohmann::json fit = ReadJson(Path("fit.json"));
    for (int j = 0; j < 7; ++j) {
      const TrueDrive& d = kDrive[static_cast<std::size_t>(j)];
      const std::string number = std::to_string(j + 1);
      EXPECT_NEAR(Column(fit, "Fv" + number), d.viscous_Nmsprad, 0.02 * d.viscous_Nmsprad);
      EXPECT_NEAR(Column(fit, "Fc" + number), d.coulomb_Nm, 0.03 * d.coulomb_Nm);
      // The rotors of the first two joints are in sums with the links.
      if (j >= 2) {
        EXPECT_NEAR(Column(fit, "Ia" + number), d.rotor_kgm2, 0.05 * d.rotor_kgm2);
      }
      EXPECT_LE(fit["held_out"]["rms_moving"][j].get<double>(), 1.05 * d.noise_Nm) << "joint " << number;
    }
    EXPECT_TRUE(fit.at("physical").get<bool>());
  }
}

TEST_F(UrdfPrior, OfPlaceholders_MakesNoEffect) {
  Make("diagnose", "<dynamics damping=\"0.003\" friction=\"0\"/>");
  const Outcome o = Tool({"diagnose", "--robot", Path("arm.toml"), "--train", Path("train.csv"), "--test",
                          Path("test.csv"), "--json", Path("verdict.json")});
  ASSERT_EQ(o.code, 0) << o.err << o.out;
  EXPECT_EQ(ReadJson(Path("verdict.json")).at("verdict"), "none") << o.out;
}

// The gears carry the links and not the rotors, which the URDF does not state. A rotor that counts as load makes other
// terms of the load beside the true one.
TEST_F(UrdfPrior, LoadFrictionBesideUnstatedRotors_IsAllThatIsNamed) {
  for (const std::size_t joint : {0, 2}) {
    std::vector<TrueDrive> drive = kDrive;
    drive[joint].load_friction = 0.08;
    Make("load_friction", "<dynamics damping=\"0.003\" friction=\"0\"/>", drive);
    const Outcome o = Tool({"diagnose", "--robot", Path("arm.toml"), "--train", Path("train.csv"), "--test",
                            Path("test.csv"), "--json", Path("verdict.json")});
    ASSERT_EQ(o.code, 0) << o.err << o.out;
    const nlohmann::json terms = ReadJson(Path("verdict.json")).at("terms");
    ASSERT_EQ(terms.size(), 1u) << o.out;
    EXPECT_EQ(terms[0].at("kind"), "load_friction");
    EXPECT_EQ(terms[0].at("joint"), joint + 1);
    EXPECT_TRUE(terms[0].at("confirmed").get<bool>());
    EXPECT_NEAR(terms[0].at("parameters").at(fmt::format("load_friction.mu{}", joint + 1)).get<double>(), 0.08, 0.004);
  }
}

}  // namespace
}  // namespace armcal::tests

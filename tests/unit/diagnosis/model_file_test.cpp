// diagnosis tests - write the new model file of every record: the generator accepts it, and it holds what was found.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "codegen/src/generator/emit.hpp"
#include "codegen/src/io/input_error.hpp"
#include "host_sim/diagnose/diagnosis/diagnose.hpp"

namespace armcal::diagnosis {
namespace {

namespace fs = std::filesystem;

const codegen::Catalogue& Records() {
  static const codegen::Catalogue records = codegen::ReadCatalogue("codegen/effects");
  return records;
}

bool CanBeFound(const codegen::EffectRecord& r) { return !r.friction_law && r.search.how != codegen::SearchWay::kNone; }

std::string Text(const fs::path& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

int Count(const std::string& text, const std::string& part) {
  int count = 0;
  for (auto at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++count;
  return count;
}

class NewModelFile : public testing::Test {
 protected:
  NewModelFile() : folder_(fs::temp_directory_path() / ("armcal_model_file_" + std::to_string(getpid()))) {
    fs::create_directories(folder_);
  }
  ~NewModelFile() override { fs::remove_all(folder_); }

  // As a diagnosis would say it: each amplitude another share of its prior deviation, inside its bounds.
  Term Found(const codegen::EffectRecord& record, const codegen::Robot& robot, std::vector<int> joints) {
    const codegen::EffectInstance made =
        codegen::Instantiate(graph_, record, robot, joints, codegen::QuantitiesAsInputs(graph_));
    Term t;
    t.record = &record;
    t.joints = std::move(joints);
    t.columns = made.columns, t.unknowns = made.unknowns;
    const auto columns = static_cast<Eigen::Index>(made.columns.size());
    t.amplitude.resize(columns), t.sd.setConstant(columns, 0.25);
    for (Eigen::Index c = 0; c < columns; ++c)
      t.amplitude[c] = made.columns[c].sd * (0.125 + 0.0625 * static_cast<double>(c));
    for (const auto& u : made.unknowns) t.eta.push_back(u.initial + 0.125 * (u.upper - u.initial));
    t.eta_sd.setConstant(static_cast<Eigen::Index>(t.eta.size()), 0.5);
    t.score = 99;
    return t;
  }
  Term Found(const std::string& record, const codegen::Model& declared, int use = 0) {
    const codegen::EffectRecord& r = Records().at(record);
    const auto sets = codegen::JointSets(r, declared.joints());
    return Found(r, declared.robot(), sets[static_cast<std::size_t>(use) % sets.size()]);
  }
  static Finding Of(std::vector<Term> terms, const codegen::Model& declared) {
    Finding finding;
    finding.terms = std::move(terms);
    finding.x = Eigen::VectorXd::LinSpaced(declared.columns() + declared.joints(), 1, 2);
    return finding;
  }
  // The file as the tool writes it, elsewhere than the declared one; read and generated. Throws where that is refused.
  codegen::Model Generated(const codegen::Model& declared, const Finding& finding) {
    file_ = folder_ / "new" / "model.toml";
    fs::create_directories(file_.parent_path());
    std::ofstream(file_) << ModelFile(declared, Records(), finding, "Train: a.csv (sha256 0123456789abcdef)").text;
    codegen::Model next(codegen::ReadRobot(file_), Records());
    EXPECT_GT(codegen::Emit(next).text.at("model.hpp").size(), 1000u);
    return next;
  }
  static const codegen::TableParameter* Entry(const codegen::Model& model, const std::string& name) {
    const auto at =
        std::find_if(model.table().begin(), model.table().end(), [&](const auto& p) { return p.name == name; });
    return at == model.table().end() ? nullptr : &*at;
  }

  fs::path folder_, file_;
  codegen::Graph graph_;
};

TEST_F(NewModelFile, OfEveryRecord_IsGenerated_WithItsValuesOrWithARemedy) {
  const codegen::Model declared(codegen::ReadRobot("codegen/robots/two_link.toml"), Records());
  int held = 0, left_out = 0;
  for (const auto& [name, record] : Records()) {
    if (!CanBeFound(record)) continue;
    SCOPED_TRACE(name);
    const Finding finding = Of({Found(name, declared)}, declared);
    const Term& t = finding.terms[0];
    const codegen::Model next = Generated(declared, finding);
    const std::string text = Text(file_);
    EXPECT_EQ(Count(text, "codegen/effects/" + name + ".toml. Train: a.csv (sha256 0123456789abcdef)"), 1);
    // The term's own table, and the friction of each of its joints, if the term does not take its place.
    const int joints = static_cast<int>(t.joints.size()), friction = record.replaces.empty() ? joints : 0;
    EXPECT_EQ(Count(text, "\n[[effect]]"), record.on_target ? 1 + friction : 0);
    EXPECT_EQ(codegen::Schema(next) != codegen::Schema(declared), record.on_target);
    for (const auto& c : t.columns) EXPECT_EQ(Count(text, "# " + c.name + " = "), c.fixed_amplitude ? 0 : 1) << c.name;
    EXPECT_EQ(Count(text, " +- 0.25 ") + Count(text, " +- 0.5 "), Count(text, " +- "));
    if (!record.on_target) {
      ++left_out;
      EXPECT_EQ(Count(text, record.remedy), 1);
      continue;
    }
    ++held;
    for (std::size_t c = 0; c < t.columns.size(); ++c) {
      const auto* entry = Entry(next, t.columns[c].name);
      ASSERT_NE(entry, nullptr) << t.columns[c].name;
      const double mean = t.columns[c].fixed_amplitude ? t.columns[c].amplitude : t.amplitude[c];
      if (record.replaces.empty()) {
        EXPECT_NEAR(entry->mean, mean, 1e-8 * std::abs(mean));
      }
      EXPECT_EQ(entry->state, t.columns[c].fixed_amplitude || t.record->search.at_turns ? "fixed" : "estimated");
    }
    for (std::size_t k = 0; k < t.eta.size(); ++k) {
      const auto* entry = Entry(next, t.unknowns[k].name);
      ASSERT_NE(entry, nullptr) << t.unknowns[k].name;
      EXPECT_NEAR(entry->mean, t.eta[k], 1e-8 * std::abs(t.eta[k]));
    }
  }
  EXPECT_GT(held, 30);
  EXPECT_GE(left_out, 8);
}

// The judge can see: the same record as a table of the model is refused.
TEST_F(NewModelFile, ASensorAsAnEffectTable_IsWhatTheGeneratorRefuses) {
  const codegen::Model declared(codegen::ReadRobot("codegen/robots/two_link.toml"), Records());
  for (const auto& [name, record] : Records()) {
    if (record.on_target) continue;
    codegen::EffectRecord misdeclared = record;
    misdeclared.on_target = true;
    Finding finding = Of({Found(name, declared)}, declared);
    finding.terms[0].record = &misdeclared;
    EXPECT_THROW(Generated(declared, finding), io::InputError) << name;
  }
}

TEST_F(NewModelFile, OfManyTermsAtOnce_IsGenerated) {
  const codegen::Model declared(codegen::ReadRobot("codegen/robots/er20_like.toml"), Records());
  std::vector<Term> terms;
  int law = 0, use = 0;
  for (const auto& [name, record] : Records())
    if (CanBeFound(record)) terms.push_back(Found(name, declared, record.replaces.empty() ? use++ : law++));
  const codegen::Model next = Generated(declared, Of(std::move(terms), declared));
  EXPECT_GT(next.columns(), declared.columns() + 100);
}

TEST_F(NewModelFile, LeavesOutWhatTheHeldOutLogRefuted) {
  const codegen::Model declared(codegen::ReadRobot("codegen/robots/two_link.toml"), Records());
  Finding finding = Of({Found("stribeck", declared), Found("time_delay", declared)}, declared);
  for (Term& t : finding.terms) t.confirmed = false;
  (void)Generated(declared, finding);
  EXPECT_EQ(Text(file_), Text(declared.robot().path));
}

// Two frequencies, or two parts of a range, of one record on one joint are two terms: neither takes the other's place.
TEST_F(NewModelFile, ARecordUsedTwiceOnAJoint_HasColumnsForBoth) {
  const codegen::Model declared(codegen::ReadRobot("codegen/robots/two_link.toml"), Records());
  for (const std::string name : {"torque_ripple", "curve_friction"}) {
    Finding finding = Of({Found(name, declared), Found(name, declared)}, declared);
    finding.terms[1].amplitude *= 3;
    finding.terms[1].eta.back() *= 0.5;
    const codegen::Model next = Generated(declared, finding);
    const auto& t = finding.terms[0];
    EXPECT_EQ(next.columns(), declared.columns() + 2 * t.amplitude.size()) << name;
    const std::string key = t.columns[0].name.substr(name.size());
    const auto *first = Entry(next, name + key), *second = Entry(next, name + "_2" + key);
    ASSERT_TRUE(first && second) << name;
    EXPECT_NEAR(second->mean, 3 * first->mean, 1e-8 * std::abs(second->mean));
  }
}

// What the robot file has on standby is switched on: the schema stays, so that a table is enough.
TEST_F(NewModelFile, OfAStandbyEffect_NeedsATableOnly) {
  for (const std::string name : {"torque_offset", "torque_ripple", "curve_friction"}) {
    fs::path path = folder_ / "standby.toml";
    std::ofstream(path) << Text("codegen/robots/two_link.toml") << "\n[[effect]]\nname = \"" << name
                        << "\"\njoints = [1, 2]\nstate = \"standby\"\n";
    const codegen::Model declared(codegen::ReadRobot(path), Records());
    const Finding finding = Of({Found(name, declared, 1)}, declared);
    const codegen::Model next = Generated(declared, finding);
    EXPECT_EQ(codegen::Schema(next), codegen::Schema(declared)) << name;
    EXPECT_EQ(Entry(next, finding.terms[0].columns[0].name)->state, "estimated") << name;
    EXPECT_NEAR(Entry(next, finding.terms[0].columns[0].name)->mean, finding.terms[0].amplitude[0], 1e-6) << name;
  }
}

// A law that is found beside the declared one takes its place, and its work.
TEST_F(NewModelFile, OfALawThatReplaces_HasTheDeclaredFrictionAdded) {
  const codegen::Model declared(codegen::ReadRobot("codegen/robots/two_link.toml"), Records());
  const Finding finding = Of({Found("presliding_dahl", declared, 1)}, declared);
  const codegen::Model next = Generated(declared, finding);
  for (const std::string key : {"Fc", "Fv"}) {
    double sum = 0;
    for (int c = 0; c < declared.columns(); ++c)
      if (declared.column_name(c) == key + "2") sum = finding.x[c];
    const Term& t = finding.terms[0];
    for (std::size_t c = 0; c < t.columns.size(); ++c)
      if (t.columns[c].key == key) sum += t.amplitude[static_cast<Eigen::Index>(c)];
    EXPECT_NEAR(Entry(next, "presliding_dahl." + key + "2")->mean, sum, 1e-8 * sum);
    EXPECT_EQ(Entry(next, key + "2"), nullptr);
  }
}

// Friction that was fitted beside a term is written with it. Where the sum would push at full speed, the term starts
// from zero: at 3.49 rad/s this one takes 0.6 (3.49)^3 = 25.5 N m off about 1 + 1.2 * 3.49 N m, and 3 N m may push.
TEST_F(NewModelFile, OfFrictionThatWouldPushBeyondTheLogs_StartsFromZero) {
  const codegen::Model declared(codegen::ReadRobot("codegen/robots/two_link.toml"), Records());
  for (const double amplitude : {0.6, -0.05, -0.6}) {
    Finding finding = Of({Found("viscous_cubic", declared)}, declared);
    Term& t = finding.terms[0];
    ASSERT_EQ(t.joints, std::vector<int>{0});
    ASSERT_EQ(t.amplitude.size(), 1);
    t.amplitude[0] = amplitude;
    const codegen::Model next = Generated(declared, finding);
    const bool pushes = amplitude == -0.6;
    EXPECT_EQ(Entry(next, t.columns[0].name)->mean, pushes ? 0 : amplitude);
    EXPECT_EQ(ModelFile(declared, Records(), finding, "").from_zero, pushes ? std::vector<int>{0} : std::vector<int>{});
    EXPECT_EQ(Count(Text(file_), "So it starts from zero"), pushes ? 1 : 0);
    for (int c = 0; c < 2; ++c) EXPECT_NEAR(Entry(next, declared.column_name(c))->mean, finding.x[c], 1e-8);
    EXPECT_EQ(Entry(next, "Fc2")->mean, Entry(declared, "Fc2")->mean) << "a joint without a term";
  }
}

TEST_F(NewModelFile, OfARobotFromUrdf_FindsItsUrdfAndItsMeshesFromElsewhere) {
  std::ofstream(folder_ / "arm.urdf") << R"(<robot name="arm"><link name="base"/><link name="l1"><inertial>
    <origin xyz="0.2 0 0"/><mass value="2"/><inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><mesh filename="package://desc/l1.stl"/></geometry></collision>
    <collision><geometry><mesh filename="package://more/l1.stl"/></geometry></collision>
    </link><joint name="r1" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" effort="50" velocity="3"/></joint></robot>)";
  for (const char* package : {"a", "b"}) {
    fs::create_directories(folder_ / package);
    std::ofstream(folder_ / package / "l1.stl") << "solid";
  }
  for (const char* packages :
       {"packages = { desc = \"a\", more = \"b\" }\n", "[packages]\ndesc = \"a\"\n\"more\" = 'b' # c\n"}) {
    std::ofstream(folder_ / "arm.toml") << R"(name = "arm"
source = "test"
gravity_mps2 = [0.0, 0.0, -9.81]
urdf = "arm.urdf"  # beside this file
)" << packages << R"([[joint]]
name = "r1"
acceleration_limit_radps2 = 1.0
torque_noise_Nm = 1.0
v_min_radps = 0.01
coulomb_Nm = 2.0
viscous_Nmsprad = 1.0
)";
    const codegen::Model declared(codegen::ReadRobot(folder_ / "arm.toml"), Records());
    const codegen::Model next = Generated(declared, Of({Found("stribeck", declared)}, declared));
    ASSERT_EQ(next.robot().shape.size(), 2U);
    EXPECT_EQ(next.robot().shape[0].file, folder_ / "a/l1.stl") << packages;
    EXPECT_EQ(next.robot().shape[1].file, folder_ / "b/l1.stl") << packages;
    // Where the folder is known, the files may move together.
    const std::string near =
        ModelFile(declared, Records(), Of({Found("stribeck", declared)}, declared), "", folder_ / "new").text;
    EXPECT_NE(near.find("urdf = \"../arm.urdf\"  # beside this file"), near.npos) << near;
    EXPECT_NE(near.find("\"../b\""), near.npos) << near;
  }
}

}  // namespace
}  // namespace armcal::diagnosis

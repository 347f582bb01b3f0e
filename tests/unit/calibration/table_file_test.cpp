// calibration tests - text, words and names of a table file keep every value, and foreign files are refused.
#include <gtest/gtest.h>

#include "armcal/estimator/adopted_table.hpp"
#include "codegen/generated/er20_like/model.hpp"
#include "host_sim/identify/calibration/table_file.hpp"
#include "tests/unit/calibration/synthetic_arm.hpp"
#include "tests/unit/files/temporary_folder.hpp"

namespace armcal::calibration {
namespace {

using files::test::ErrorOf;
using files::test::TemporaryFolder;
using tests::Er20Model;

TableFile Changed() {
  TableFile t = DefaultTable(Er20Model());
  t.note = "for a test";
  t.bumpless = true, t.blend_ms = 250;
  t.forgetting[1] = 0.9995;
  t.joint[2] = {1.25, 0.03, 900, 1.02};
  t.row[70].mean = 12.345678, t.row[70].sd = 1.5, t.row[70].process_noise = 1e-7;
  t.row[70].state = "considered", t.row[70].group = 3;
  t.row[71].posterior_sd = 0.25, t.row[71].from_prior = true, t.row[71].free_mean = 7.5;
  return t;
}

void ExpectSame(const TableFile& a, const TableFile& b, double relative) {
  EXPECT_EQ(a.schema, b.schema);
  EXPECT_EQ(a.bumpless, b.bumpless);
  EXPECT_EQ(a.blend_ms, b.blend_ms);
  for (int g = 0; g < 4; ++g) EXPECT_NEAR(a.forgetting[g], b.forgetting[g], relative);
  ASSERT_EQ(a.joint.size(), b.joint.size());
  for (std::size_t j = 0; j < a.joint.size(); ++j) {
    EXPECT_NEAR(a.joint[j].sigma_Nm, b.joint[j].sigma_Nm, relative * a.joint[j].sigma_Nm);
    EXPECT_NEAR(a.joint[j].v_min_radps, b.joint[j].v_min_radps, relative * a.joint[j].v_min_radps);
    EXPECT_NEAR(a.joint[j].torque_limit_Nm, b.joint[j].torque_limit_Nm, relative * a.joint[j].torque_limit_Nm);
    EXPECT_NEAR(a.joint[j].torque_scale, b.joint[j].torque_scale, relative);
  }
  ASSERT_EQ(a.row.size(), b.row.size());
  for (std::size_t k = 0; k < a.row.size(); ++k) {
    EXPECT_EQ(a.row[k].name, b.row[k].name);
    EXPECT_EQ(a.row[k].unit, b.row[k].unit);
    EXPECT_EQ(a.row[k].state, b.row[k].state) << a.row[k].name;
    EXPECT_EQ(a.row[k].group, b.row[k].group) << a.row[k].name;
    EXPECT_NEAR(a.row[k].mean, b.row[k].mean, relative * std::abs(a.row[k].mean)) << a.row[k].name;
    EXPECT_NEAR(a.row[k].sd, b.row[k].sd, relative * a.row[k].sd) << a.row[k].name;
    EXPECT_NEAR(a.row[k].process_noise, b.row[k].process_noise, relative * a.row[k].process_noise);
  }
}

TEST(TableFile, WrittenAndRead_IsTheSameTable) {
  const TemporaryFolder folder;
  const TableFile t = Changed();
  WriteTable(folder / "t.toml", t);
  const TableFile read = ReadTable(folder / "t.toml");
  ExpectSame(t, read, 1e-8);  // nine digits are written
  EXPECT_EQ(read.robot, "er20_like");
  EXPECT_EQ(read.note, "for a test");
  EXPECT_TRUE(read.row[71].from_prior);
  EXPECT_DOUBLE_EQ(read.row[71].free_mean, 7.5);
  EXPECT_EQ(EncodeTable(read), EncodeTable(t));  // nine digits name a float exactly
}

TEST(TableFile, EncodedAndDecoded_IsTheSameTableInFloat) {
  const TableFile t = Changed();
  const auto words = EncodeTable(t);
  const TableFile back = DecodeTable(words, DefaultTable(Er20Model()));
  ExpectSame(t, back, 1e-7);  // half a unit of float's last place is 6e-8
  EXPECT_EQ(EncodeTable(back), words);
}

// Layout version 1 is version 2 without what follows the parameters.
TEST(TableFile, TheDefaultWords_AreThoseOfTheGeneratedModel) {
  using Table = estimator::Table<generated::Er20Like>;
  std::vector<std::uint16_t> expected(Table::kWords);
  model::Encode(estimator::DefaultTable<generated::Er20Like>(), expected.data());
  EXPECT_EQ(expected[2], 2);
  expected[2] = 1;
  expected.resize(Table::kFirstWords);
  EXPECT_EQ(EncodeTable(DefaultTable(Er20Model())), expected);
}

TEST(TableFile, AGateOfAJoint_IsKeptInTheFileAndReachesTheFirmware) {
  TableFile t = Changed();
  t.joint[3].gate_sigma = 7.5;
  const auto path = std::filesystem::temp_directory_path() / "armcal_gate_table.toml";
  WriteTable(path, t);
  const TableFile read = ReadTable(path);
  std::filesystem::remove(path);
  const auto words = EncodeTable(read);
  ASSERT_EQ(words.size(), std::size_t{estimator::Table<generated::Er20Like>::kWords});
  estimator::Table<generated::Er20Like> decoded;
  ASSERT_EQ(model::Decode(words.data(), generated::Er20Like::kSchema, decoded), core::Status::kOk);
  for (int j = 0; j < 6; ++j) EXPECT_EQ(decoded.joint[j].gate_sigma, j == 3 ? 7.5f : 0.0f);
  EXPECT_EQ(DecodeTable(words, DefaultTable(Er20Model())).joint[3].gate_sigma, 7.5);
  EXPECT_EQ(decoded.parameter[70].mean, 12.345678f) << "the rest is where version 1 has it";
}

TEST(TableFile, TheHostsWords_AreWhatTheFirmwareDecodes) {
  const TableFile t = Changed();
  const auto words = EncodeTable(t);
  estimator::Table<generated::Er20Like> decoded;
  ASSERT_EQ(model::Decode(words.data(), generated::Er20Like::kSchema, decoded), core::Status::kOk);
  EXPECT_EQ(decoded.parameter[70].mean, 12.345678f);
  EXPECT_EQ(decoded.parameter[70].state, model::ParameterState::kConsidered);
  EXPECT_EQ(decoded.parameter[70].group, 3);
  EXPECT_EQ(decoded.joint[2].torque_scale, 1.02f);
  EXPECT_EQ(decoded.flags, model::kFlagBumpless);
  EXPECT_EQ(decoded.blend_ms, 250u);
}

// Current times the nominal torque constant reads 1.25 times the torque. The drive multiplies by torque_scale.
TEST(TableFile, OfADriveThatReadsAQuarterTooMuch_ScalesByFourFifths) {
  const codegen::Model& model = Er20Model();
  const int size = model.columns() + model.joints();
  Fit fit;
  fit.x = Eigen::VectorXd::Zero(size), fit.sd = Eigen::VectorXd::Ones(size), fit.prior_sd = fit.sd;
  fit.sigma = Eigen::VectorXd::Ones(model.joints());
  PhysicalReadOut read;
  read.bodies = Eigen::VectorXd::Zero(model.body_parameters()), read.bodies_sd = read.bodies;
  read.x = fit.x;
  read.x[model.columns() + 1] = 0.25;
  const double sample_s = model.robot().sample_ticks / model.robot().tick_rate_Hz;
  const TableFile t =
      IdentifiedTable(model, fit, read, Eigen::VectorXd::Constant(model.joints(), 2 * std::sqrt(sample_s)));
  EXPECT_DOUBLE_EQ(t.joint[1].torque_scale, 0.8);
  EXPECT_DOUBLE_EQ(t.joint[0].torque_scale, 1);
  EXPECT_DOUBLE_EQ(t.joint[1].sigma_Nm, 2);
}

TEST(TableFile, AnotherSchemaOrSize_IsRefused) {
  auto words = EncodeTable(DefaultTable(Er20Model()));
  words.pop_back();
  EXPECT_NE(ErrorOf([&] { (void)DecodeTable(words, DefaultTable(Er20Model())); }), "");
  words = EncodeTable(DefaultTable(Er20Model()));
  words[1] ^= 1;
  EXPECT_NE(ErrorOf([&] { (void)DecodeTable(words, DefaultTable(Er20Model())); }), "");
}

TEST(TableFile, CarriedOver_ByNameIntoAnotherLayout) {
  const TableFile from = Changed();
  TableFile to = DefaultTable(Er20Model());
  std::rotate(to.row.begin() + 66, to.row.begin() + 70, to.row.end());  // another order
  TableRow added = to.row.back();
  added.name = "stribeck.dFs2", added.mean = 4.5;
  to.row.push_back(added);
  EXPECT_EQ(CarryOver(from, to, "t.toml").missing, std::vector<std::string>{"stribeck.dFs2"});
  for (const TableRow& r : to.row) {
    const auto same =
        std::find_if(from.row.begin(), from.row.end(), [&](const TableRow& f) { return f.name == r.name; });
    EXPECT_EQ(r.mean, same == from.row.end() ? 4.5 : same->mean) << r.name;
  }
  EXPECT_EQ(to.joint[2].torque_limit_Nm, 900);
}

TEST(TableFile, ThatDoesNotFitTheModel_IsNotCarriedOver) {
  const auto error = [](auto change) {
    TableFile from = Changed(), to = DefaultTable(Er20Model());
    change(from);
    return ErrorOf([&] { CarryOver(from, to, "t.toml"); });
  };
  EXPECT_EQ(error([](TableFile&) {}), "");
  EXPECT_EQ(error([](TableFile& t) { t.row.erase(t.row.begin(), t.row.begin() + 60); }), "") << "a part is a table";
  EXPECT_EQ(error([](TableFile& t) { t.row[66].unit = ""; }), "") << "a unit may be left out";
  EXPECT_NE(error([](TableFile& t) {
              t.robot = "ur10";
            }).find("t.toml: is a table of robot ur10, expected one of robot er20_like"),
            std::string::npos);
  EXPECT_NE(error([](TableFile& t) { t.joint.pop_back(); }).find("t.toml: 5 joints, expected 6"), std::string::npos);
  EXPECT_NE(error([](TableFile& t) {
              t.row[66].name = "FC1";
            }).find("FC1: robot er20_like has no such parameter; the nearest is Fc1"),
            std::string::npos);
  EXPECT_NE(error([](TableFile& t) { t.row[66].unit = "N*mm"; }).find("Fc1: unit is N*mm, expected N*m"),
            std::string::npos);
}

// A table of another version of the model may hold effects that this one lacks.
TEST(TableFile, OfAnotherSchema_LeavesOutWhatTheModelLacksAndNamesIt) {
  TableFile from = Changed(), to = DefaultTable(Er20Model());
  from.schema ^= 1;
  from.row[66].name = "stribeck.dFs1";
  from.row[66].unit = "";
  const CarriedOver carried = CarryOver(from, to, "t.toml");
  EXPECT_EQ(carried.unknown, std::vector<std::string>{"stribeck.dFs1"});
  EXPECT_EQ(carried.missing, std::vector<std::string>{"Fc1"});
  EXPECT_EQ(to.row[70].mean, from.row[70].mean);
  EXPECT_EQ(to.schema, from.schema ^ 1);
}

TEST(TableFile, BadFiles_AreRefusedNamingFileAndKey) {
  const TemporaryFolder folder;
  WriteTable(folder / "good.toml", DefaultTable(Er20Model()));
  std::ifstream in(folder / "good.toml");
  const std::string good((std::istreambuf_iterator<char>(in)), std::istreambuf_iterator<char>());
  const auto with = [&](const std::string& from, const std::string& to) {
    std::string text = good;
    const auto at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return text.replace(at, from.size(), to);
  };
  struct Case {
    std::string text, key;
  };
  const std::vector<Case> cases{{with("schema = ", "schema = -"), "schema"},
                                {with("schema = ", "schema = 9999999"), "schema"},
                                {with("sigma_Nm = ", "sigma_Nm = -"), "sigma_Nm"},
                                {with("state = \"estimated\"", "state = \"guessed\""), "state"},
                                {with("group = 0", "group = 4"), "group"},
                                {with("group = 0", "group = 0.5"), "group"},
                                {with("blend_ms = ", "blend_ms = 0.5 #"), "blend_ms"},
                                {with("name = \"mx1\"", "name = \"m1\""), "m1 is there twice"},
                                {with("blend_ms = ", "blend_s = "), "blend_s"},
                                {with("forgetting = [", "forgetting = [1.0, "), "forgetting"},
                                {with("mean = ", "mean = \"heavy\" #"), "mean"},
                                {"robot = \"er20_like\"\nschema = 1\nforgetting = [1.0, 1.0, 1.0, 1.0]\n", "parameter"},
                                {"this is = = no TOML", ""}};
  for (const Case& c : cases) {
    const auto path = folder.Write("bad.toml", c.text);
    const std::string error = ErrorOf([&] { (void)ReadTable(path); });
    EXPECT_NE(error.find("bad.toml"), std::string::npos) << c.key << ": " << error;
    EXPECT_NE(error.find(c.key), std::string::npos) << error;
    EXPECT_EQ(error.find('\n'), std::string::npos) << error;
  }
  EXPECT_NE(ErrorOf([&] { (void)ReadTable(folder / "absent.toml"); }).find("absent.toml"), std::string::npos);
}

}  // namespace
}  // namespace armcal::calibration

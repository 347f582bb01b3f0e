// end-to-end tests - make the mistakes of a new user: each ends in its exit code and one line with cause and remedy.
#include <algorithm>
#include <cmath>
#include <fstream>
#include <functional>
#include <set>
#include <sstream>

#include "host_sim/data/files/files.hpp"
#include "tests/e2e/tool.hpp"

namespace armcal::tests {
namespace {

constexpr int kBadInput = 2, kLink = 3;

// A log that is good but for what `change` does to its cells. Row 0 is the header; column 0 is t.
using Cells = std::vector<std::vector<std::string>>;
std::string LogText(int rows, const std::function<void(Cells&)>& change = {}, char separator = ',') {
  Cells cells(1, {"t"});
  for (const char* name : {"q", "tau"})
    for (int j = 1; j <= 6; ++j) cells[0].push_back(name + std::to_string(j));
  for (int k = 0; k < rows; ++k) {
    cells.push_back({std::to_string(0.008 * k)});
    for (int j = 0; j < 12; ++j)  // 1.9 rad/s at most: within the arm's limits
      cells.back().push_back(std::to_string((j < 6 ? 0.3 : 1) * std::sin(0.05 * k + j)));
  }
  if (change) change(cells);
  std::string text;
  for (const auto& row : cells)
    for (std::size_t c = 0; c < row.size(); ++c) (text += row[c]) += c + 1 < row.size() ? separator : '\n';
  return text;
}

// The cells of `columns` times `factor`.
std::function<void(Cells&)> Scaled(std::size_t first, std::size_t last, double factor) {
  return [=](Cells& cells) {
    for (std::size_t k = 1; k < cells.size(); ++k)
      for (std::size_t c = first; c <= last; ++c) cells[k][c] = std::to_string(factor * std::stod(cells[k][c]));
  };
}

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  const auto at = text.find(from);
  EXPECT_NE(at, text.npos) << from;
  return at == text.npos ? text : text.replace(at, from.size(), to);
}

// The words of a command line and of a message that has to hold them all. "{}" is the folder of the files.
struct Mistake {
  std::string command;
  std::vector<std::string> cause, remedy;
  int code = kBadInput;
};

class Mistakes : public testing::Test {
 protected:
  Mistakes() {
    fs::create_directories(folder_ / "folder");
    Logs();
    Robots();
    Maps();
    Write("empty.json", "{}");
    Write("table.toml",
          "robot = \"er20_like\"\nschema = 1\nforgetting = [1, 1, 1, 1]\n[[joint]]\nsigma_Nm = 1\nv_min_radps = "
          "0.01\ntorque_limit_Nm = 100\ntorque_scale = 1\n[[parameter]]\nname = \"Fc1\"\nmean = 1\nsd = 1\nstate = "
          "\"fixed\"\n");
    Write("group.toml", ReadText(folder_ / "table.toml") + "group = 1.5\n");
    Write("broken.json", "{ not json");
    Write("path.csv", "t,q1\n0,0\n1,1\n");
    const std::string scenario =
        "title = \"x\"\nrobot = \"er20_like\"\ntruth_seed = 1\nnoise_seed = 1\n[[effect]]\nkind = \"torque_offset\"\n"
        "joint = 7\ntorque_Nm = 1\n";
    Write("joint_7.toml", scenario);
    Write("witchcraft.toml", Replaced(scenario, "torque_offset", "witchcraft"));
  }

  void Write(const std::string& name, const std::string& text) const {
    std::ofstream(folder_ / name, std::ios::binary) << text;
  }

  void Logs() const {
    Write("good.csv", LogText(400));  // 125 Hz, 3.2 s
    Write("held_out.csv", LogText(420));
    Write("empty.csv", "");
    Write("no_header.csv", LogText(400, [](Cells& c) { c.erase(c.begin()); }));
    Write("header.csv", LogText(0));
    Write("short.csv", LogText(50));
    Write("ragged.csv", LogText(400, [](Cells& c) { c[200].pop_back(); }));
    Write("text.csv", LogText(400, [](Cells& c) { c[200][3] = "fast"; }));
    Write("dates.csv", LogText(400, [](Cells& c) { c[1][0] = "2024-05-01T12:00:00"; }));
    Write("semicolons.csv", LogText(400, {}, ';'));
    Write("tabs.csv", LogText(400, {}, '\t'));
    Write("degrees.csv", LogText(400, Scaled(1, 6, 57.3)));
    Write("milliseconds.csv", LogText(400, Scaled(0, 0, 1000)));
    Write("no_torque.csv", LogText(400, [](Cells& c) {
            for (auto& row : c) row.resize(7);
          }));
    Write("one_torque.csv", LogText(400, [](Cells& c) { c[0][7] = "torque1"; }));
    Write("twice.csv", LogText(400, [](Cells& c) { c[0][2] = "q1"; }));
    Write("other_names.csv", LogText(400, [](Cells& c) {
            for (std::size_t k = 1; k < c[0].size(); ++k) c[0][k] = "Axis " + std::to_string(k);
          }));
    Write("five.csv", LogText(400, [](Cells& c) {
            for (auto& row : c) row.erase(row.begin() + 12), row.erase(row.begin() + 6);
          }));
    Write("nan.csv", LogText(400, [](Cells& c) {
            for (int k = 100; k < 200; ++k) c[k][3] = "nan";
          }));
    Write("back.csv", LogText(400, [](Cells& c) {
            for (int k = 100; k < 200; k += 10) std::swap(c[k][0], c[k + 1][0]);
          }));
    Write("repeated.csv", LogText(400, [](Cells& c) {
            for (int k = 100; k < 200; k += 10) c[k][0] = c[k + 1][0];
          }));
    Write("book.xlsx", std::string("PK\x03\x04\x14\0\x06\0,\n\x01,\x02\n", 14));
    files::WriteWholeFile(folder_ / "whole.csv.gz", LogText(400));
    const std::string gzip = ReadText(folder_ / "whole.csv.gz");
    Write("cut.csv.gz", gzip.substr(0, gzip.size() / 2));
    Write("cut.mcap", std::string("\x89MCAP0\r\n\x01\x20\0\0\0\0\0\0\0abc", 20));
  }

  void Robots() const {
    const std::string good = ReadText("codegen/robots/er20_like.toml"), mass = "mass_kg = 32.0";
    Write("typo.toml", Replaced(good, mass, "mas_kg = 32.0"));
    Write("comma.toml", Replaced(good, mass, "mass_kg = 32,0"));
    Write("type.toml", Replaced(good, mass, "mass_kg = true"));
    Write("no_gravity.toml", Replaced(good, "gravity_mps2", "# gravity_mps2"));
    Write("effect.toml", good + "\n[[effect]]\nname = \"stribek\"\njoints = [1]\n");
    Write("empty.toml", "");
    Write("arm.urdf", "<robot name=\"a\"><link name=\"b\"/></robot>");
    Write("robot.toml", good);
  }

  void Maps() const {
    const std::string good =
        "joints = 6\ntime = { column = \"t\", unit = \"s\" }\nq = { column = \"q{}\", unit = \"rad\" }\ntau = { column "
        "= \"tau{}\", unit = \"N*m\" }\n";
    Write("map.toml", good);
    Write("map_column.toml", Replaced(good, "\"q{}\"", "\"pos_{}\""));
    Write("map_unit.toml", Replaced(good, "\"rad\"", "\"degrees\""));
    Write("map_key.toml", Replaced(good, "q = { column", "q = { colum"));
    Write("map_quantity.toml", good + "velocity = { column = \"v{}\", unit = \"rad/s\" }\n");
    Write("map_no_q.toml", Replaced(good, "q = {", "qref = {"));
    Write("map_bracket.toml", Replaced(good, "\"rad\" }", "\"rad\""));
  }

  // Every file, so that nothing is left by a command that failed. The flash memory of a simulated drive may stay.
  std::set<std::string> Files() const {
    std::set<std::string> out;
    for (const auto& e : fs::recursive_directory_iterator(folder_))
      if (e.path().extension() != ".nor") out.insert(e.path().string());
    return out;
  }

  std::string InFolder(std::string text) const {
    for (std::size_t at; (at = text.find("{}")) != text.npos;) text.replace(at, 2, folder_.string());
    for (std::size_t at; (at = text.find("CLOSED")) != text.npos;) text.replace(at, 6, closed_.address());
    for (std::size_t at; (at = text.find("TAKEN")) != text.npos;) text.replace(at, 5, std::to_string(taken_.port()));
    return text;
  }

  void Make(const Mistake& mistake) const {
    SCOPED_TRACE("armcal " + mistake.command);
    std::vector<std::string> words;
    std::istringstream command(InFolder(mistake.command));
    for (std::string word; command >> word;) words.push_back(word);
    const Outcome o = Tool(words);
    EXPECT_EQ(o.code, mistake.code);
    EXPECT_EQ(o.out, "");
    EXPECT_EQ(std::count(o.err.begin(), o.err.end(), '\n'), 1) << o.err;
    EXPECT_TRUE(o.err.starts_with("armcal")) << o.err;
    for (const auto& [what, named] : {std::pair{"cause", mistake.cause}, std::pair{"remedy", mistake.remedy}})
      for (const std::string& word : named)
        EXPECT_NE(o.err.find(InFolder(word)), std::string::npos) << what << ": " << word << "\n" << o.err;
    std::printf("%s", o.err.c_str());
  }

  void MakeAll(const std::vector<Mistake>& mistakes) const {
    const std::set<std::string> before = Files();
    for (const Mistake& mistake : mistakes) Make(mistake);
    EXPECT_EQ(Files(), before);
  }

  const fs::path folder_ = FreshFolder("mistakes");
  const TakenPort closed_{false}, taken_{true};  // refuses connections; is in use
};

TEST_F(Mistakes, OnTheCommandLine) {
  MakeAll({
      {"", {"expected a verb"}, {"armcal --help"}},
      {"exite", {"no verb exite"}, {"nearest is excite"}},
      {"identity --robot er20_like", {"no verb identity"}, {"nearest is identify"}},
      {"zzzzzzzz", {"no verb zzzzzzzz"}, {"--help lists them"}},
      {"--verson", {"no option --verson"}, {"nearest is --version"}},
      {"identify --robt er20_like --train {}/good.csv", {"identify", "no option --robt"}, {"nearest is --robot"}},
      {"excite --robot er20_like --out {}/x.csv --sed=3", {"excite", "no option --sed"}, {"nearest is --seed"}},
      {"choose --robot er20_like --axis 3", {"choose", "no option --axis"}, {"--help lists them"}},
      {"identify --train {}/good.csv", {"--robot is required"}, {"armcal identify --help"}},
      {"identify er20_like {}/good.csv", {"--robot is required"}, {"armcal identify --help"}},
      {"identify --robot", {"--robot"}, {"expected a value"}},
      {"identify --robot er20_like", {"--train"}, {"expected log(s)"}},
      {"identify --robot er20_like --train {}/good.csv --method magic", {"\"magic\""}, {"one of", "extended_kalman"}},
      {"diagnose --robot er20_like --train {}/good.csv", {"--test"}, {"expected --robot, --train and --test"}},
      {"diagnose --robot er20_like --train {}/good.csv --test {}/good.csv", {"--test {}/good.csv"}, {"another log"}},
      {"diagnose --robot er20_like --train {}/good.csv --test {}/good.csv --db {}/d.sqlite --date 2026-13-45",
       {"--date", "2026-13-45"},
       {"2026-03-01"}},
      {"evaluate --robot er20_like", {"logs is required"}, {"armcal evaluate --help"}},
      {"convert {}/good.csv --out {}/x.csv", {"--channels is required"}, {"armcal convert --help"}},
      {"excite --robot er20_like --out {}/x.csv --search-seconds -3", {"--search-seconds -3"}, {"a number from 0 to"}},
      {"excite --robot er20_like --out {}/x.csv --search-seconds ten",
       {"--search-seconds ten"},
       {"a number from 0 to"}},
      {"excite --robot er20_like --out {}/x.csv --search-seconds nan",
       {"--search-seconds nan"},
       {"a number from 0 to"}},
      {"excite --robot er20_like --out {}/x.csv --harmonics nan", {"--harmonics nan"}, {"an integer from 1 to 20"}},
      {"excite --robot er20_like --out {}/x.csv --purpose training", {"--purpose training"}, {"train or test"}},
      {"excite --robot er20_like --out {}/x.csv --harmonics 2.5", {"--harmonics 2.5"}, {"an integer from 1 to 20"}},
      {"excite --robot er20_like --out {}/x.csv --seed abc", {"--seed abc"}, {"expected a number"}},
      {"excite --robot er20_like --out {}/x.csv --separate stribek", {"no effect stribek"}, {"nearest is stribeck"}},
      {"excite --robot er20_like --out {}/x.csv --separate magic", {"no effect magic"}, {"docs/effects.md"}},
      {"excite --robot er20_like --out {}/x.csv --separate stribeck:0", {"stribeck:0"}, {"joints", "1 to 6"}},
      {"excite --robot er20_like --out {}/x.csv --separate stribeck:7", {"stribeck:7"}, {"joints", "1 to 6"}},
      {"excite --robot er20_like --out {}/x.csv --found {}/empty.json", {"--found"}, {"requires --separate"}},
      {"replay --robot er20_like --segment 0 {}/good.csv", {"--segment 0"}, {"a number above 0"}},
      {"replay --robot er20_like --segment nan {}/good.csv", {"--segment nan"}, {"a number above 0"}},
      {"export --robot er20_like --format xml --out {}/x", {"--format xml"}, {"urdf, sdf, mjcf, yaml or c"}},
      {"export --robot er20_like --format urdf --out {}/x", {"names no URDF"}, {"expected --into FILE"}},
      {"estimate --robot er20_like", {"estimate"}, {"either --connect or --log"}},
      {"simulate --port 99999", {"--port 99999"}, {"an integer from 0 to 65535"}},
  });
}

TEST_F(Mistakes, WithALog) {
  std::vector<Mistake> mistakes;
  const auto log = [&mistakes](const std::string& name, const std::vector<std::string>& cause,
                               const std::vector<std::string>& remedy, const std::string& more = "") {
    mistakes.push_back(
        {"identify --robot er20_like --train {}/" + name + " --json {}/x.json --table-out {}/x.toml" + more, cause,
         remedy});
    mistakes.back().cause.push_back("{}/" + name);
  };
  log("absent.csv", {"no such file"}, {"check the path"});
  log("folder", {"no CSV file"}, {"armcal channels"});
  log("empty.csv", {"is empty"}, {"expected a header line with column names"});
  log("no_header.csv", {":1:", "'0.000000' is a number"}, {"expected a header line with column names"});
  log("header.csv", {"has 0 samples"}, {"at least 200"});
  log("short.csv", {"has 50 samples"}, {"at least 200"});
  log("ragged.csv", {":201: has 12 fields"}, {"expected 13"});
  log("text.csv", {":201: column 'q3': 'fast'"}, {"expected a number"});
  log("dates.csv", {":2: column 't': '2024-05-01T12:00:00'"}, {"expected a number"});
  log("semicolons.csv", {"separated by ';'"}, {"expected ','"});
  log("tabs.csv", {"separated by tabs"}, {"expected ','"});
  log("book.xlsx", {"is no text"}, {"expected a CSV file"});
  log("degrees.csv", {"joint 1", "looks like degrees"}, {"rad"});
  log("milliseconds.csv", {"column 't'", "time step is 8 s"}, {"looks like ms"});
  log("no_torque.csv", {"no column 'tau1'", "armcal record plays it"}, {"expected t, q1..qn, tau1..taun"});
  log("one_torque.csv", {"no column 'tau1'"}, {"expected t, q1..qn, tau1..taun"});
  log("other_names.csv", {"no column 'q1'"}, {"channel map: --channels"});
  log("twice.csv", {"column 'q1' appears twice"}, {"expected a name for each column"});
  log("five.csv", {"5 joints"}, {"expected 6 (robot er20_like)"});
  log("nan.csv", {"q3"}, {"expected"});
  log("back.csv", {"time"}, {"expected"});
  log("repeated.csv", {"time"}, {"expected"});
  log("cut.csv.gz", {"damaged or cut short"}, {"copy or record it again"});
  log("cut.mcap", {"no CSV file"}, {"channel map (--channels)"});
  log("cut.mcap", {"is cut short"}, {"copy or record it again"}, " --channels {}/map.toml");
  log("empty.json", {"no column 'q1'"}, {"expected t, q1..qn, tau1..taun"});
  log("good.csv", {"no column 'pos_1'", "map_column.toml"}, {"it does not name q1, q2"},
      " --channels {}/map_column.toml");
  log("good.csv", {"cut-off 63 Hz"}, {"below half the sample rate, 62.5 Hz"}, " --cutoff 63");
  log("good.csv", {"cut-off 1 Hz"}, {"expected above"}, " --cutoff 1");
  MakeAll(mistakes);
}

// The cut-off is read by one place for identify and diagnose, and both read logs alike.
TEST_F(Mistakes, InOtherVerbsThatReadLogs) {
  const std::string diagnose =
      "diagnose --robot er20_like --test {}/held_out.csv --json {}/x.json --report {}/x.html --model-out {}/x.toml ";
  std::vector<Mistake> mistakes = {
      {diagnose + "--train {}/short.csv", {"short.csv: has 50 samples"}, {"at least 200"}},
      {diagnose + "--train {}/good.csv --cutoff 63", {"cut-off 63 Hz"}, {"below half the sample rate, 62.5 Hz"}},
      {diagnose + "--train {}/good.csv --gain-tolerance 10", {"--gain-tolerance 10"}, {"a number from 1e-06 to 0.9"}},
      {"diagnose --batch {}/absent --robot er20_like --out {}/x", {"{}/absent"}, {"expected a folder of logs"}},
      {"diagnose --batch {}/folder --robot er20_like --out {}/x", {"{}/folder"}, {"expected NAME.train.csv"}},
      {"estimate --robot er20_like --log {}/short.csv --json {}/x.json", {"short.csv: has 50"}, {"at least 200"}},
      {"replay --robot er20_like {}/good.csv --cutoff 20", {"--cutoff"}, {"expected --refine LOG"}},
      {"replay --robot er20_like {}/good.csv --tries 3", {"--tries"}, {"requires --refine"}},
      {diagnose + "--train {}/good.csv --part 1/2", {"--part"}, {"expected --batch"}},
      {"identify --robot er20_like --train {}/good.csv --method kalman --force", {"--force"}, {"expected no --method"}},
      {"identify --robot er20_like --with {}/good.csv --without {}/good.csv --band 20", {"--band"}, {"expected no"}},
      {"replay --robot er20_like {}/absent.csv", {"absent.csv: no such file"}, {"check the path"}},
      {"channels {}/folder", {"folder", "without files .mcap or .db3"}, {"expected a log or a bag's folder"}},
      {"channels {}/cut.mcap", {"cut.mcap: is cut short"}, {"copy or record it again"}},
      {"channels {}/good.csv --out {}/map.toml", {"map.toml: is there already"}, {"--overwrite"}},
      {"report {}/absent.json --out {}/x.html", {"absent.json: no such file"}, {"check the path"}},
      {"report {}/empty.json --out {}/x.html", {"empty.json"}, {"expected the JSON of armcal diagnose"}},
      {"report {}/broken.json --out {}/x.html", {"broken.json"}, {"expected the JSON of armcal diagnose"}},
  };
  for (const std::string cutoff : {"0", "-20", "nan", "inf", "20Hz", "high"})
    mistakes.push_back({"identify --robot er20_like --train {}/good.csv --cutoff " + cutoff,
                        {"--cutoff " + cutoff},
                        {"expected a frequency above 0 Hz"}});
  for (const std::string band : {"-20", "nan", "1e-300"})
    mistakes.push_back({"evaluate --robot er20_like {}/good.csv --band " + band,
                        {"--band " + band},
                        {"expected a frequency above 0 Hz"}});
  MakeAll(mistakes);
}

TEST_F(Mistakes, WithAFileOfTheRobotTheTableOrTheChannels) {
  std::vector<Mistake> mistakes;
  const auto robot = [&mistakes](const std::string& name, const std::vector<std::string>& cause,
                                 const std::vector<std::string>& remedy) {
    mistakes.push_back({"identify --robot " + name + " --train {}/good.csv --json {}/x.json", cause, remedy});
  };
  robot("er20", {"robot er20: no such file or name"}, {"one of emps, er20_like"});
  robot("{}/absent.toml", {"absent.toml: no such file or name"}, {"expected a file or one of emps"});
  robot("{}/folder", {"robot {}/folder"}, {"expected a file"});
  robot("{}/typo.toml", {"typo.toml: joint[2].link.mas_kg: unknown key"}, {"nearest is mass_kg"});
  robot("{}/comma.toml", {"comma.toml: line", "wrong TOML in key-value pair"}, {"expected '=', saw ','"});
  robot("{}/type.toml", {"type.toml: joint[2].link.mass_kg"}, {"expected a"});
  robot("{}/no_gravity.toml", {"no_gravity.toml: gravity_mps2: missing"}, {"expected 3 numbers"});
  robot("{}/effect.toml", {"effect.toml: no effect stribek"}, {"nearest is stribeck"});
  robot("{}/empty.toml", {"empty.toml: nothing in it"}, {"expected a robot file"});
  robot("{}/arm.urdf", {"arm.urdf: is a URDF"}, {"armcal import {}/arm.urdf"});
  robot("{}/map.toml", {"map.toml: is a channel map"}, {"expected a robot file", "--channels"});
  robot("{}/joint_7.toml", {"joint_7.toml: is a scenario"}, {"expected a robot file", "--scenario"});
  robot("{}/empty.json", {"empty.json: line 1, column 1: wrong TOML"}, {"expected keys"});
  robot("{}/good.csv", {"good.csv: line 1", "wrong TOML"}, {"expected '='"});

  const auto table = [&mistakes](const std::string& name, const std::vector<std::string>& cause,
                                 const std::vector<std::string>& remedy) {
    mistakes.push_back(
        {"evaluate --robot er20_like --table {}/" + name + " {}/good.csv --json {}/x.json", cause, remedy});
  };
  table("absent.toml", {"absent.toml: no such file"}, {"check the path"});
  table("robot.toml", {"robot.toml: is a robot file"}, {"expected a parameter table", "--robot"});
  table("map.toml", {"map.toml: is a channel map"}, {"expected a parameter table", "--channels"});
  table("empty.json", {"empty.json"}, {"expected the JSON that armcal identify --json writes, or a table"});
  table("broken.json", {"broken.json"}, {"expected the JSON that armcal identify --json writes, or a table"});

  const auto map = [&mistakes](const std::string& name, const std::vector<std::string>& cause,
                               const std::vector<std::string>& remedy) {
    mistakes.push_back({"convert {}/good.csv --channels {}/" + name + " --out {}/x.csv", cause, remedy});
    mistakes.back().cause.push_back(name);
  };
  map("absent.toml", {"no such file"}, {"check the path"});
  map("map_column.toml", {"good.csv:1: no column 'pos_1'"}, {"it does not name q1, q2"});
  map("map_unit.toml", {"q.unit: 'degrees' is no unit"}, {"expected rad, deg"});
  map("map_key.toml", {"q.colum: unknown key"}, {"expected column, unit"});
  map("map_quantity.toml", {"velocity: unknown key"}, {"expected joints, names"});
  map("map_no_q.toml", {"q: missing"}, {"expected a table, as in { column = ", "unit = \"rad\""});
  map("map_bracket.toml", {"line 3", "wrong TOML in inline table"}, {"expected"});
  map("robot.toml", {"is a robot file"}, {"expected a channel map", "--robot"});

  mistakes.insert(mistakes.end(),
                  {{"import {}/absent.urdf --out {}/x.toml", {"absent.urdf: no such file"}, {"check the path"}},
                   {"import {}/robot.toml --out {}/x.toml", {"robot.toml"}, {"expected a URDF"}},
                   {"import {}/arm.urdf --out {}/x.toml", {"link \"b\""}, {"expected at least one movable joint"}},
                   {"import {}/arm.urdf --out {}/robot.toml", {"robot.toml: is there already"}, {"--overwrite"}},
                   {"generate --robot {}/arm.urdf --out {}/x", {"is a URDF"}, {"armcal import"}}});
  MakeAll(mistakes);
}

TEST_F(Mistakes, WhereToWrite) {
  const std::string convert = "convert {}/good.csv --channels {}/map.toml --out ";
  const std::string record = "record --connect CLOSED --robot er20_like --seconds 3 --out ";
  MakeAll({
      {record + "{}/folder", {"{}/folder: cannot be written: Is a directory"}, {"choose another place"}},
      {record + "{}/x.csv --samples {}/good.csv/x.csv", {"x.csv: cannot be written: Not a directory"}, {"choose"}},
      {"backup {}/folder --connect CLOSED", {"{}/folder: cannot be written: Is a directory"}, {"another place"}},
      {convert + "{}/folder", {"{}/folder: cannot be written"}, {"choose another place"}},
      {"survey --report {}/folder", {"{}/folder: cannot be written: Is a directory"}, {"choose another place"}},
      {"bench --robot er20_like --json {}/good.csv/x.json", {"x.json: cannot be written: Not a directory"}, {"choose"}},
      {convert + "{}/good.csv/x.csv", {"x.csv: cannot be written: Not a directory"}, {"choose another place"}},
      {convert + "/proc/armcal.csv", {"/proc/armcal.csv: cannot be written"}, {"choose another place"}},
      {"generate --robot er20_like --out {}/good.csv", {"good.csv: this folder cannot be made"}, {"another place"}},
      {"demo --out /proc/armcal", {"/proc/armcal: this folder cannot be made"}, {"choose another place"}},
      {"simulate --scenario none --port 0 --storage /proc/armcal/x.nor", {"/proc/armcal"}, {"another place"}},
      {"simulate --scenario none --port 0 --storage {}/folder", {"{}/folder"}, {"a file that can be written"}},
  });
}

// Nothing is asked of a drive before.
TEST_F(Mistakes, OneFileForTwoOptions) {
  const std::string flash = "flash --connect CLOSED --robot er20_like --table {}/robot.toml --json ";
  fs::create_symlink(folder_ / "robot.toml", folder_ / "link.toml");
  MakeAll({
      {"record --connect CLOSED --robot er20_like --seconds 3 --out {}/x.csv --samples {}/x.csv",
       {"--out and --samples both name {}/x.csv"},
       {"choose another place"}},
      {"backup {}/x.json --connect CLOSED --json {}/folder/../x.json",
       {"--json", "file", "both name"},
       {"another place"}},
      {"restore {}/empty.json --connect CLOSED --json {}/empty.json",
       {"--json", "file", "both name"},
       {"another place"}},
      {flash + "{}/robot.toml", {"--json and --table both name {}/robot.toml"}, {"choose another place"}},
      {flash + "{}/link.toml", {"--json and --table both name {}/link.toml"}, {"choose another place"}},
      {flash + "{}/x --db {}/x --arm a", {"--json and --db both name {}/x"}, {"choose another place"}},
      {"identify --robot er20_like --train {}/held_out.csv {}/good.csv --table-out {}/good.csv",
       {"--table-out", "--train", "both name {}/good.csv"},
       {"choose another place"}},
      {"generate --robot {}/robot.toml --out {}/x --json {}/x", {"--out and --json both name {}/x"}, {"another place"}},
  });
}

TEST_F(Mistakes, WithADriveOrASimulatedOne) {
  const std::string simulate = "simulate --port 0 --storage {}/x.nor --scenario ";
  MakeAll({
      {simulate + "ripples", {"scenario ripples"}, {"one of any", "ripple"}},
      {simulate + "none --robot er20", {"robot er20"}, {"one of emps, er20_like"}},
      {simulate + "{}/robot.toml", {"robot.toml: is a robot file"}, {"expected a scenario", "--robot"}},
      {simulate + "{}/witchcraft.toml", {"effect[1].kind"}, {"expected one of", "torque_offset"}},
      {simulate + "{}/joint_7.toml", {"joint_7.toml", "joint"}, {"a joint from 1 to 6"}},
      {"simulate --scenario none --port TAKEN --storage {}/x.nor",
       {"TAKEN", "already in use"},
       {"choose another --port"}},
      {"demo --out {}/x --scenario nope", {"scenario nope"}, {"expected a file or one of any"}},
      {"record --connect CLOSED --robot er20_like --out {}/x.csv", {"record"}, {"--trajectory or --seconds"}},
      {"record --connect CLOSED --robot er20_like --seconds -3 --out {}/x.csv", {"--seconds -3"}, {"from 1 to"}},
      {"record --connect CLOSED --robot er20_like --seconds nan --out {}/x.csv", {"--seconds nan"}, {"from 1 to"}},
      {"record --connect CLOSED --robot er20_like --seconds 3 --out {}/x.csv",
       {"CLOSED: cannot connect"},
       {"is a drive running there"},
       kLink},
      {"estimate --connect CLOSED --robot er20_like", {"CLOSED: cannot connect"}, {"is a drive running there"}, kLink},
      {"flash --connect CLOSED --robot er20_like --table {}/robot.toml", {"is a robot file"}, {"a parameter table"}},
      {"flash --connect CLOSED --robot er20_like --table {}/empty.json",
       {"empty.json: is JSON"},
       {"expected a parameter table", "armcal restore takes a backup"}},
      {"verify --connect CLOSED --robot er20_like --table {}/absent.toml",
       {"absent.toml: no such"},
       {"check the path"}},
      {"flash --connect CLOSED --robot two_link --table {}/table.toml",
       {"table.toml: is a table of robot er20_like", "expected one of robot two_link"},
       {"give --robot er20_like"}},
      {"verify --connect CLOSED --robot two_link --table {}/table.toml",
       {"table of robot er20_like"},
       {"give --robot"}},
      {"flash --connect CLOSED --robot er20_like --table {}/group.toml", {"group"}, {"an integer from 0 to 3"}},
      {"health --connect nowhere", {"--connect nowhere"}, {"HOST:PORT"}},
      {"health --connect [::1]:1", {"::1:1: cannot connect"}, {"is a drive running there"}, kLink},
      {"scan /dev/does-not-exist --to 248", {"--to 248"}, {"a unit from 1 to 247"}},
      {"scan /dev/does-not-exist:9600:X", {"scan /dev/does-not-exist:9600:X"}, {"DEVICE[:BAUD[:PARITY]]"}},
      {"scan /dev/does-not-exist:9600:N --to 2",
       {"/dev/does-not-exist, unit 2: cannot connect"},
       {"plugged in"},
       kLink},
      {"scan 127.0.0.1 --from 502", {"scan 127.0.0.1"}, {"expected --from and --to"}},
      {"scan 127.0.0.1:502 --from 1 --to 2", {"scan 127.0.0.1:502: has a port"}, {"a host alone"}},
      {"scan 127.0.0.1:0", {"scan 127.0.0.1:0"}, {"a port from 1 to 65535"}},
      {"health --connect 127.0.0.1:99999", {"127.0.0.1:99999"}, {"HOST:PORT"}},
      {"health --connect no-such-host.invalid:502", {"cannot find this host"}, {"check the name"}, kLink},
      {"health --connect /dev/does-not-exist", {"/dev/does-not-exist: cannot connect"}, {"plugged in"}, kLink},
      {"get no_such --connect CLOSED", {"no_such: no such register"}, {"armcal map lists them"}},
      {"set learning_hold 2 --connect CLOSED", {"learning_hold: 2"}, {"expected 0 to 1"}},
      {"restore {}/absent.json --connect CLOSED", {"absent.json: no such file"}, {"check the path"}},
  });
}

}  // namespace
}  // namespace armcal::tests

// survey - Table 12 held out, with a truth drawn among all laws: does `armcal choose` find the law that a joint has?
#include <algorithm>
#include <map>

#include "host_sim/identify/choice/block_errors.hpp"
#include "host_sim/identify/choice/choose.hpp"
#include "host_sim/study/survey/law_draw.hpp"
#include "host_sim/study/survey/tables.hpp"

namespace armcal::survey {

using Eigen::VectorXd;

namespace {

constexpr double kNormal95 = 1.96;
constexpr double kPower = kNormal95 + 1.28;  // standard deviations that a test of 5 % sees in 90 % of trials
constexpr double kNarrow = 0.02;             // half width of the interval of two errors that count as equal

struct Case {
  std::string truth;
  bool right = false;    // the true law was chosen
  bool equal = false;    // another one, whose error on the test is proven to be as small
  bool powered = false;  // the test tells the true law from all others
  bool differ = false;   // the training stretches tell some laws apart
};

std::vector<Case> ChooseOn(const Settings& settings, const LawDraw& draw) {
  const codegen::Model plain(settings.robot, settings.records);
  const std::vector<calibration::Dataset> train{calibration::Prepare(plain, draw.train)};
  const calibration::Dataset test = calibration::Prepare(plain, draw.test);
  choice::ChooseSettings how;
  how.stop = settings.stop;
  const choice::Choice choice = choice::Choose(settings.robot, settings.records, train, how);
  std::vector<Case> out;
  for (std::size_t j = 0; j < choice.joint.size(); ++j) {
    Case one;
    one.truth = draw.law[j].equation.empty() ? draw.law[j].name : draw.law[j].equation + " " + draw.law[j].name;
    one.differ = choice.joint[j].differ;
    const std::vector<VectorXd> squares = choice::TestLaws(choice.laws, settings.robot, settings.records, train, test,
                                                           static_cast<int>(j), settings.stop);
    const auto truth =
        static_cast<std::size_t>(std::find_if(choice.laws.begin(), choice.laws.end(),
                                              [&](const auto& l) { return l.name == draw.law[j].name; }) -
                                 choice.laws.begin());
    const std::size_t chosen = choice.joint[j].chosen;
    one.right = chosen == truth;
    one.powered = squares[truth].size() > 0;
    for (std::size_t law = 0; law < squares.size(); ++law) {
      if (law == truth || squares[law].size() == 0 || squares[truth].size() == 0) continue;
      const choice::Ratio ratio = choice::Compare(squares[law], squares[truth]);
      const double half = 0.5 * (ratio.high - ratio.low);
      one.powered = one.powered && ratio.value > kPower / kNormal95 * half;
      if (law == chosen) one.equal = ratio.low <= 0 && ratio.high >= 0 && half < kNarrow;
    }
    out.push_back(one);
  }
  return out;
}

}  // namespace

void ShowChoice(const Settings& settings, const Motions& motions, Findings& out) {
  std::vector<std::vector<Case>> found(static_cast<std::size_t>(settings.draws));
  ForEachDraw(settings, "choice", settings.draws, [&](int d) {
    found[static_cast<std::size_t>(d)] =
        ChooseOn(settings, DrawLaws(settings, motions, settings.seed * 7907 + static_cast<std::uint64_t>(d)));
  });
  if (settings.Stopped()) return;
  struct Sum {
    double cases = 0, right = 0, equal = 0, powered = 0, powered_right = 0, alike = 0;
  };
  std::map<std::string, Sum> of_law;
  Sum all;
  for (const auto& arm : found)
    for (const Case& one : arm)
      for (Sum* sum : {&all, &of_law[one.truth]}) {
        ++sum->cases, sum->right += one.right, sum->equal += !one.right && one.equal;
        sum->powered += one.powered, sum->powered_right += one.powered && one.right, sum->alike += !one.differ;
      }
  Sheet sheet{
      "choice",
      "which friction law armcal choose takes, logs of the plant (40 s)",
      {"law of the joint", "joints", "chosen", "another one, as good", "the test tells it from all others",
       "of these chosen", "laws do not differ"},
      {},
      {"Each joint has one of seven laws with drawn parameters. The choice is made on the training log; the test "
       "is another motion.",
       "As good: the 95 % interval of the ratio of the two errors on the test holds 1 and is narrower than +- 2 %. "
       "Told from all others: a test of 5 % would see the difference to each in 90 % of trials."}};
  for (const auto& [name, sum] : of_law)
    sheet.rows.push_back({name, sum.cases, sum.right, sum.equal, sum.powered, sum.powered_right, sum.alike});
  sheet.rows.push_back({"all", all.cases, all.right, all.equal, all.powered, all.powered_right, all.alike});
  const std::string where = "Table choice (Table 12 held out, truth drawn among all laws): ";
  out.goals.push_back({where + "share right, or as good", (all.right + all.equal) / all.cases, 0.95, false});
  out.goals.push_back({where + "share chosen of those that the test tells apart",
                       all.powered > 0 ? all.powered_right / all.powered : 1, 0.90, false});
  out.goals.push_back({where + "share where the laws do not differ", all.alike / all.cases, 0.20, true});
  out.sheets.push_back(sheet);
}

}  // namespace armcal::survey

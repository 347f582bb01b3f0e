// verdict - makes charts of the curves that a JSON holds.
#include "host_sim/diagnose/verdict/curve_charts.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "host_sim/diagnose/verdict/json_values.hpp"

namespace armcal::verdict {

using nlohmann::ordered_json;

namespace {

constexpr int kMeasuredColour = 6;

std::string UnitOf(const ordered_json& json, int joint) {
  return json.at("torque_units").at(static_cast<std::size_t>(joint) - 1);
}

// One panel a joint. fill: gives it its labels and series.
template <class Fill>
report::Live PanelsOf(const ordered_json& json, const std::vector<int>& shown, const Fill& fill) {
  report::Live live;
  for (const ordered_json& curves : json.at("curves")) {
    const int joint = curves.at("joint");
    const std::string title = JointTitle(json, joint);
    report::Panel panel{title};
    panel.plot.text.title = title;
    panel.shown = std::find(shown.begin(), shown.end(), joint) != shown.end();
    fill(panel.plot, curves, UnitOf(json, joint));
    live.panels.push_back(panel);
  }
  return live;
}

}  // namespace

report::Live TorqueCharts(const ordered_json& json, const std::vector<ShownPrediction>& predictions,
                          const std::vector<int>& shown) {
  report::Live live = PanelsOf(json, shown, [&](report::Plot& plot, const ordered_json& curves, const auto& unit) {
    plot.text.x_label = "time / s", plot.text.y_label = (unit == "N" ? "force / " : "torque / ") + unit;
    const std::vector<double> t = Numbers(curves.at("t"));
    plot.series.push_back({"measured", t, Numbers(curves.at("measured")), report::Style::kLine, kMeasuredColour});
    for (const ShownPrediction& p : predictions)
      plot.series.push_back({p.predicted, t, Numbers(curves.at(p.key)), p.style, p.colour});
  });
  live.difference = "measured minus predicted";
  return live;
}

report::Live SpectrumCharts(const ordered_json& json, const std::vector<ShownPrediction>& predictions,
                            const std::vector<int>& shown) {
  return PanelsOf(json, shown, [&](report::Plot& plot, const ordered_json& curves, const auto& unit) {
    plot.text.x_label = "frequency / Hz", plot.text.y_label = "amplitude density / " + unit + "/√Hz";
    plot.logarithmic_x = plot.logarithmic_y = true;
    const ordered_json& spectrum = curves.at("spectrum");
    const std::vector<double> f_Hz = Numbers(spectrum.at("Hz"));
    plot.series.push_back({"measured", f_Hz, Numbers(spectrum.at("measured")), report::Style::kLine, kMeasuredColour});
    for (const ShownPrediction& p : predictions)
      plot.series.push_back({p.left, f_Hz, Numbers(spectrum.at(p.key)), p.style, p.colour});
    if (curves.contains("looked_at_to_Hz") && curves["looked_at_to_Hz"].is_number())
      plot.shades.push_back({curves["looked_at_to_Hz"].get<double>(), "not looked at"});
  });
}

}  // namespace armcal::verdict

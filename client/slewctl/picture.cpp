#include "client/slewctl/picture.hpp"

#include <nlohmann/json.hpp>
#include <numbers>
#include <vector>

#include "client/slewctl/connection.hpp"
#include "client/slewctl/gnuplot.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

constexpr double kDegPerRad = 180 / std::numbers::pi;

struct Quantity {
  const char* channel;
  const char* label;
  const char* color;
  double factor;
};

// Drawn in degrees, where the run has them; the torque only where nothing fires.
constexpr Quantity kQuantities[] = {{"error_rad", "error, deg", "#1f4e9c", kDegPerRad},
                                    {"rate_rad_s", "rate, deg/s", "#2e7d32", kDegPerRad},
                                    {"switching_function_rad", "s, deg", "#6a1b9a", kDegPerRad}};
constexpr Quantity kTorque = {"torque_N_m", "torque, N m", "#b71c1c", 1};
// A data block of gnuplot's and how it is drawn.
struct Panel {
  std::string name;
  std::string label;
  std::string points;
  std::string style;
};

void add_panel(std::vector<Panel>& panels, const json& series, const Quantity& quantity) {
  const json& t_s = series.at("t_s");
  const auto column = series.at("columns").find(quantity.channel);
  if (column == series.at("columns").end()) return;
  Panel panel{quantity.channel, quantity.label, "",
              "lines lw 2 lc rgb '" + std::string(quantity.color) + "'"};
  for (std::size_t i = 0; i < t_s.size(); ++i)
    panel.points += in_full(t_s[i]) + ' ' + in_full(quantity.factor * column->at(i).get<double>()) + '\n';
  panels.push_back(std::move(panel));
}

// The modes of one event channel, from the first to the last that the result tells, or to the end.
Panel firing_panel(const json& events, const std::string& channel, double end_s) {
  Panel panel{channel, channel, "0 0\n", "steps lw 1 lc rgb '#b71c1c'"};
  int mode = 0;
  for (const json& event : events.at("list")) {
    if (event.at("channel") != channel) continue;
    mode = event.at("mode");
    panel.points += in_full(event.at("t_s")) + ' ' + std::to_string(mode) + '\n';
  }
  if (events.at("reported") == events.at("total"))
    panel.points += in_full(end_s) + ' ' + std::to_string(mode) + '\n';
  else
    panel.label += ", first " + std::to_string(events.at("reported").get<long>()) + " of " +
                   std::to_string(events.at("total").get<long>());
  return panel;
}

std::string script(const json& result, const json& series, const std::string& title,
                   const std::string& file) {
  const double end_s = series.at("t_s").back();
  std::vector<Panel> panels;
  for (const Quantity& quantity : kQuantities) add_panel(panels, series, quantity);
  const std::size_t quantities = panels.size();
  for (const json& channel : result.at("events").at("channels"))
    if (channel.get<std::string>().starts_with("thruster"))
      panels.push_back(firing_panel(result.at("events"), channel, end_s));
  if (panels.size() == quantities) add_panel(panels, series, kTorque);

  std::string text = terminal_for(file) + "set encoding utf8\nset grid\nunset key\n";
  for (const Panel& panel : panels) text += "$" + panel.name + " << EOD\n" + panel.points + "EOD\n";
  text += "set lmargin 10\nset rmargin 3\nset xrange [0:" + in_full(end_s) + "]\n";
  text += "set autoscale y\nset offsets 0, 0, graph 0.05, graph 0.05\n";
  text += "set multiplot layout " + std::to_string(panels.size()) + ",1 title " + quoted(title) + "\n";
  for (const Panel& panel : panels)
    text += "set ylabel " + quoted(panel.label) + "\nset xlabel " +
            (&panel == &panels.back() ? "'t, s'" : "''") + "\nplot $" + panel.name + " with " + panel.style +
            "\n";
  return text + "unset multiplot\n";
}

}  // namespace

void draw_run(const json& result, const json& series, const std::string& title, const std::string& file) {
  check_picture_name(file);
  if (series.at("t_s").size() < 2) throw Stop{kRunFailed, "there are not enough samples to draw"};
  run_gnuplot(script(result, series, title, file), file);
}

}  // namespace slew::ctl

#include "client/slewctl/design_picture.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <nlohmann/json.hpp>
#include <vector>

#include "client/slewctl/connection.hpp"
#include "client/slewctl/gnuplot.hpp"
#include "client/slewctl/phase_plane_picture.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

constexpr const char* kLine = "#1f4e9c";
constexpr const char* kMark = "#b71c1c";
constexpr const char* kCrossing = "#2e7d32";

std::string rounded(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g", value);
  return text;
}

// A data block and how it is drawn.
struct Layer {
  std::string name;
  std::string points;
  std::string style;
};

// A layer without points is left out: gnuplot 5.4 does not survive labels without any.
std::string plot(const std::vector<Layer>& layers, const std::string& more = "") {
  std::string blocks, command;
  for (const Layer& layer : layers) {
    if (layer.points.empty()) continue;
    blocks += "$" + layer.name + " << EOD\n" + layer.points + "EOD\n";
    command += (command.empty() ? "plot $" : ", $") + layer.name + ' ' + layer.style;
  }
  return blocks + command + more + "\n";
}

std::string colour(const char* rgb) {
  return std::string(" lc rgb '") + rgb + "' ";
}

// [real, imaginary] pairs, one a line.
std::string points_of(const json& roots) {
  std::string points;
  for (const json& root : roots) points += in_full(root.at(0)) + ' ' + in_full(root.at(1)) + '\n';
  return points;
}

// Branches as lines; what is far outside the picture is left out.
std::string branches_of(const json& branches, double radius) {
  std::string points;
  for (const json& branch : branches) {
    for (const json& root : branch) {
      const double re = root.at(0), im = root.at(1);
      points += std::hypot(re, im) < 4 * radius ? in_full(re) + ' ' + in_full(im) + '\n' : "\n";
    }
    points += '\n';
  }
  return points;
}

// Where branches cross the imaginary axis, with the gain.
std::string crossings_of(const json& ranges) {
  std::string points;
  const auto add = [&](const json& gain, const json& frequency) {
    if (!gain.is_number() || !frequency.is_number()) return;
    for (const double sign : {1.0, -1.0})
      points += "0 " + in_full(sign * frequency.get<double>()) + " \"k0 = " + rounded(gain) + "\"\n";
  };
  for (const json& range : ranges) {
    add(range.at("from"), range.at("from_crossing_rad_s"));
    add(range.at("to"), range.at("to_crossing_rad_s"));
  }
  return points;
}

std::string range_in_words(const json& ranges) {
  if (ranges.empty()) return "stable for no k0";
  std::string text;
  for (const json& range : ranges)
    text += (text.empty() ? "stable for " : ", ") +
            (range.at("to").is_null() ? "k0 > " + rounded(range.at("from"))
                                      : rounded(range.at("from")) + " < k0 < " + rounded(range.at("to")));
  return text;
}

std::string curve(const json& bode, const char* what) {
  std::string points;
  const json& frequencies = bode.at("frequency_rad_s");
  for (std::size_t i = 0; i < frequencies.size(); ++i) {
    const json& value = bode.at(what).at(i);
    points += value.is_number() ? in_full(frequencies[i]) + ' ' + in_full(value) + '\n' : "\n";
  }
  return points;
}

// Every phase crossover on the curve of the magnitude.
std::string magnitude_points(const json& crossovers) {
  std::string points;
  for (const json& one : crossovers)
    points +=
        in_full(one.at("frequency_rad_s")) + ' ' + in_full(-one.at("gain_margin_dB").get<double>()) + '\n';
  return points;
}

// Every gain crossover on the curve of the phase, which may be whole turns away from its margin.
std::string phase_points(const json& crossovers, const json& bode) {
  std::string points;
  const auto frequencies = bode.at("frequency_rad_s").get<std::vector<double>>();
  for (const json& one : crossovers) {
    const double frequency = one.at("frequency_rad_s");
    const auto above = std::lower_bound(frequencies.begin(), frequencies.end(), frequency);
    if (above == frequencies.end()) continue;
    const double near = bode.at("phase_deg").at(static_cast<std::size_t>(above - frequencies.begin()));
    const double phase = one.at("phase_margin_deg").get<double>() - 180;
    points += in_full(frequency) + ' ' + in_full(near + std::remainder(phase - near, 360)) + '\n';
  }
  return points;
}

std::string margin_in_words(const json& crossovers, const char* margin, const std::string& what,
                            const std::string& unit) {
  if (crossovers.empty()) return what + " unlimited";
  const auto nearest =
      std::min_element(crossovers.begin(), crossovers.end(), [&](const json& a, const json& b) {
        return std::abs(a.at(margin).get<double>()) < std::abs(b.at(margin).get<double>());
      });
  return what + ' ' + rounded(nearest->at(margin)) + ' ' + unit + " at " +
         rounded(nearest->at("frequency_rad_s")) + " rad/s";
}

std::string locus_panel(const json& description) {
  const json& design = description.at("design");
  const json& locus = design.at("root_locus");
  const json& ranges = description.at("loop_gain_stability_range");
  const double radius = design.at("radius_rad_s");
  const std::string crossings = crossings_of(ranges);
  std::string text =
      "set title " + quoted("root locus over the loop gain k0: " + range_in_words(ranges)) + "\n";
  text += "set xrange [" + in_full(-radius) + ":" + in_full(0.6 * radius) + "]\nset yrange [" +
          in_full(-radius) + ":" + in_full(radius) + "]\nset zeroaxis lt 1 lc rgb '#888888'\n";
  text += "set xlabel 'Re s, rad/s'\nset ylabel 'Im s, rad/s'\n";
  return text +
         plot({{"branches", branches_of(locus.at("branches_rad_s"), radius),
                "with lines lw 2" + colour(kLine) + "title 'closed-loop poles'"},
               {"poles", points_of(locus.at("poles_rad_s")),
                "with points pt 2 ps 2 lw 2 lc rgb 'black' title 'poles of the loop (k0 = 0)'"},
               {"zeros", points_of(locus.at("zeros_rad_s")),
                "with points pt 6 ps 2 lw 2 lc rgb 'black' title 'zeros of the loop'"},
               {"closed", points_of(description.at("closed_loop").at("poles_rad_s")),
                "with points pt 7 ps 1.2" + colour(kMark) + "title 'closed-loop poles at k0 = " +
                    rounded(description.at("law").at("loop_gain")) + "'"},
               {"crossings", crossings,
                "using 1:2 with points pt 5 ps 0.9" + colour(kCrossing) + "title 'on the imaginary axis'"},
               {"labels", crossings, "using 1:2:3 with labels left offset 1,0.6 notitle"}});
}

std::string bode_panels(const json& description, const std::string& upper, const std::string& lower) {
  const json& bode = description.at("design").at("bode");
  const json& gains = description.at("margins").at("gain_crossovers");
  const json& phases = description.at("margins").at("phase_crossovers");
  const json& frequencies = bode.at("frequency_rad_s");
  const std::string line = "with lines lw 2" + colour(kLine) + "notitle";
  const std::string points = "with points pt 7" + colour(kMark);
  const std::string dashed = " with lines dt 2" + colour("#888888") + "notitle";
  std::string text =
      "unset xrange\nunset yrange\nunset zeroaxis\nset autoscale y\n"
      "set offsets 0, 0, graph 0.05, graph 0.05\nset logscale x\nset format x '%g'\n";
  text += "set xrange [" + in_full(frequencies.front()) + ":" + in_full(frequencies.back()) + "]\n";
  text += upper + "set title " +
          quoted("loop k0 L(j omega): " + margin_in_words(phases, "gain_margin_dB", "gain margin", "dB")) +
          "\nset xlabel ''\nset ylabel 'magnitude, dB'\n";
  text += plot({{"magnitude", curve(bode, "magnitude_dB"), line},
                {"gain_margins", magnitude_points(phases), points + "title 'where the phase is -180 deg'"}},
               ", 0" + dashed);
  text += lower + "set title " + quoted(margin_in_words(gains, "phase_margin_deg", "phase margin", "deg")) +
          "\nset xlabel 'omega, rad/s'\nset ylabel 'phase, deg'\nset ytics 45\n";
  text += plot({{"phase", curve(bode, "phase_deg"), line},
                {"phase_margins", phase_points(gains, bode), points + "title 'where the magnitude is 0 dB'"}},
               ", -180" + dashed);
  return text;
}

std::string linear_script(const json& description, const std::string& title, const std::string& file) {
  const bool is_text = file == "-";
  std::string text = terminal_for(file, 1500, 850) + "set encoding utf8\nset grid\nset key below\n";
  if (is_text)
    return text + "set multiplot layout 3,1 title " + quoted(title) + "\n" + locus_panel(description) +
           bode_panels(description, "", "") + "unset multiplot\n";
  text += "set multiplot title " + quoted(title) + " font ',14'\n";
  text += "set size ratio -1\nset origin 0,0\nset size 0.46,0.95\nset bmargin 8\n" + locus_panel(description);
  text += "set size noratio\nset lmargin 10\nset rmargin 3\n";
  text += bode_panels(description, "set origin 0.48,0.48\nset size 0.52,0.47\nset bmargin 5\n",
                      "set origin 0.48,0\nset size 0.52,0.48\nset bmargin 6\n");
  return text + "unset multiplot\n";
}

// Duty cycle over the demand, and, where pulses come again and again, how long they are.
std::string modulator_script(const json& description, const std::string& title, const std::string& file) {
  const json& design = description.at("design");
  const std::string unit = design.at("unit");
  std::string duty, on;
  for (const json& point : design.at("curve")) {
    const std::string demand = in_full(point.at("demand")) + ' ';
    duty += demand + in_full(point.at("duty_cycle")) + '\n';
    const json on_time = point.value("on_time_s", json());
    if (on_time.is_number() && on_time > 0) on += demand + in_full(1000 * on_time.get<double>()) + '\n';
  }
  const json saturation = design.value("saturation", json());
  std::string caption = "dead band " + rounded(design.at("dead_band")) + ' ' + unit;
  if (saturation.is_number()) caption += ", saturation " + rounded(saturation) + ' ' + unit;
  if (const json least = design.value("minimum_on_time_s", json()); least.is_number())
    caption += ", shortest pulse " + rounded(1000 * least.get<double>()) + " ms";
  std::string text =
      terminal_for(file, 1000, 850) + "set encoding utf8\nset grid\nunset key\nset lmargin 10\n";
  text += "set multiplot layout " + std::string(on.empty() ? "1" : "2") + ",1 title " + quoted(title) + "\n";
  text += "set xrange [0:" + in_full(design.at("curve").back().at("demand")) + "]\nset yrange [0:1.05]\n";
  text += "set title " + ctl::quoted(caption) + "\nset ylabel 'duty cycle'\nset xlabel " +
          quoted("demand, " + unit) + "\n";
  text += plot({{"duty", duty, "with lines lw 2" + colour(kLine)}},
               ", x/" + in_full(design.at("level")) + " with lines dt 2" + colour("#888888"));
  if (!on.empty())
    text += "unset title\nset autoscale y\nset logscale y\nset ylabel 'pulse, ms'\n" +
            plot({{"on", on, "with lines lw 2" + colour(kMark)}});
  return text + "unset multiplot\n";
}

// The damped response of the whole structure, and of the models in its place.
std::string structure_script(const json& description, const std::string& title, const std::string& file) {
  const json& design = description.at("design");
  std::string whole, flown, model;
  for (const json& point : design.at("curve")) {
    const std::string frequency = in_full(point.at("frequency_rad_s")) + ' ';
    whole += frequency + in_full(point.at("whole_m_N")) + '\n';
    flown += frequency + in_full(point.at("flown_m_N")) + '\n';
    model += frequency + in_full(point.at("design_m_N")) + '\n';
  }
  std::vector<Layer> layers{
      {"whole", whole, "with lines lw 2" + colour("#9e9e9e") + "title 'whole structure'"},
      {"flown", flown, "with lines lw 2" + colour(kLine) + "title 'flown'"}};
  if (design.at("has_design"))
    layers.push_back({"model", model, "with lines dt 2 lw 2" + colour(kMark) + "title 'designed on'"});
  return terminal_for(file, 1000, 700) + "set encoding utf8\nset grid\nset logscale xy\nset title " +
         quoted(title) + "\nset xlabel 'frequency, rad/s'\nset ylabel 'receptance, m/N or rad/N m'\n" +
         plot(layers);
}

std::string script_of(const json& description, const std::string& title, const std::string& file) {
  const json& design = description.at("design");
  if (design.at("type") == "none")
    throw Stop{kRefused, "nothing to draw: " + design.at("sentence").get<std::string>()};
  if (design.at("type") == "linear") return linear_script(description, title, file);
  if (design.at("type") == "structure") return structure_script(description, title, file);
  if (design.at("type") == "modulator") return modulator_script(description, title, file);
  return phase_plane_script(description, title, file);
}

}  // namespace

void draw_design(const json& description, const std::string& title, const std::string& file) {
  check_picture_name(file);
  run_gnuplot(script_of(description, title, file), file);
}

}  // namespace slew::ctl

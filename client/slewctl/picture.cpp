#include "client/slewctl/picture.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>
#include <vector>

#include "client/slewctl/connection.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

struct Quantity {
  const char* channel;
  const char* label;
  const char* color;
};

// Drawn in degrees, where the run has them.
constexpr Quantity kQuantities[] = {{"error_rad", "error, deg", "#1f4e9c"},
                                    {"rate_rad_s", "rate, deg/s", "#2e7d32"},
                                    {"switching_function_rad", "s, deg", "#6a1b9a"}};
constexpr double kDegPerRad = 180 / std::numbers::pi;

// A data block of gnuplot's and how it is drawn.
struct Panel {
  std::string name;
  std::string label;
  std::string points;
  std::string style;
};

// In gnuplot's single quotes nothing is special but the quote itself.
std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20) continue;
    result += c;
    if (c == '\'') result += '\'';
  }
  return result + "'";
}

std::string terminal_for(const std::string& file) {
  if (file == "-") {
    winsize window{};
    ioctl(STDOUT_FILENO, TIOCGWINSZ, &window);
    const int columns = window.ws_col > 20 ? window.ws_col - 1 : 100;
    return "set terminal dumb size " + std::to_string(std::min(columns, 160)) + ",60\n";
  }
  const bool is_png = file.ends_with(".png");
  return std::string("set terminal ") + (is_png ? "pngcairo size 1000,1000" : "svg size 1000,1000 dynamic") +
         " noenhanced font 'sans,11'\nset output " + quoted(file) + "\n";
}

std::string in_full(double value) {
  std::ostringstream text;
  text.precision(12);
  text << value;
  return text.str();
}

std::vector<Panel> quantity_panels(const json& series) {
  std::vector<Panel> panels;
  const json& t_s = series.at("t_s");
  for (const Quantity& quantity : kQuantities) {
    const auto column = series.at("columns").find(quantity.channel);
    if (column == series.at("columns").end()) continue;
    Panel panel{quantity.channel, quantity.label, "",
                "lines lw 2 lc rgb '" + std::string(quantity.color) + "'"};
    for (std::size_t i = 0; i < t_s.size(); ++i)
      panel.points += in_full(t_s[i]) + ' ' + in_full(kDegPerRad * column->at(i).get<double>()) + '\n';
    panels.push_back(std::move(panel));
  }
  return panels;
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
  std::vector<Panel> panels = quantity_panels(series);
  for (const json& channel : result.at("events").at("channels"))
    if (channel.get<std::string>().starts_with("thruster"))
      panels.push_back(firing_panel(result.at("events"), channel, end_s));

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

// Starts gnuplot without a shell and feeds it the script.
int gnuplot(const std::string& text) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return 126;
  const pid_t pid = fork();
  if (pid == 0) {
    dup2(ends[0], STDIN_FILENO);
    // Labels are UTF-8, whatever the terminal's locale.
    setenv("LC_ALL", "C.UTF-8", 1);
    execlp("gnuplot", "gnuplot", "-", static_cast<char*>(nullptr));
    _exit(127);
  }
  close(ends[0]);
  signal(SIGPIPE, SIG_IGN);
  for (std::size_t done = 0; pid > 0 && done < text.size();) {
    const ssize_t count = write(ends[1], text.data() + done, text.size() - done);
    if (count <= 0) break;
    done += static_cast<std::size_t>(count);
  }
  close(ends[1]);
  int status = 0;
  if (pid < 0 || waitpid(pid, &status, 0) != pid) return 126;
  return WIFEXITED(status) ? WEXITSTATUS(status) : 126;
}

}  // namespace

void check_picture_name(const std::string& file) {
  if (file != "-" && !file.ends_with(".png") && !file.ends_with(".svg"))
    throw Stop{kRefused,
               "a picture's name ends in .png or .svg (or is - for the terminal), not \"" + file + "\""};
}

void draw_run(const json& result, const json& series, const std::string& title, const std::string& file) {
  check_picture_name(file);
  if (series.at("t_s").size() < 2) throw Stop{kRunFailed, "there are not enough samples to draw"};
  const int code = gnuplot(script(result, series, title, file));
  if (code == 127) throw Stop{kRunFailed, "gnuplot is not installed (deploy/install-packages)"};
  if (code != 0) throw Stop{kRunFailed, "gnuplot could not draw " + file};
}

}  // namespace slew::ctl

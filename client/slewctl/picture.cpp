#include "client/slewctl/picture.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <numbers>
#include <sstream>

#include "client/slewctl/connection.hpp"

namespace slew::ctl {
namespace {

using nlohmann::json;

struct Panel {
  const char* channel;
  const char* label;
  double factor;
  const char* style;
  const char* color;
};

constexpr double kDegPerRad = 180 / std::numbers::pi;
constexpr Panel kPanels[] = {{"error_rad", "error, deg", kDegPerRad, "lines lw 2", "#1f4e9c"},
                             {"rate_rad_s", "rate, deg/s", kDegPerRad, "lines lw 2", "#2e7d32"},
                             {"switching_function_rad", "s, deg", kDegPerRad, "lines lw 2", "#6a1b9a"},
                             {"torque_N_m", "torque, N m", 1, "steps lw 1", "#b71c1c"}};

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

std::string script(const json& series, const std::string& title, const std::string& file) {
  std::ostringstream text;
  text.precision(12);
  const auto& t_s = series.at("t_s");
  const json& columns = series.at("columns");
  text << terminal_for(file);
  text << "set encoding utf8\nset grid\nunset key\n";
  std::size_t panels = 0;
  for (const Panel& panel : kPanels)
    if (columns.contains(panel.channel)) {
      text << "$" << panel.channel << " << EOD\n";
      const json& values = columns.at(panel.channel);
      for (std::size_t i = 0; i < t_s.size(); ++i)
        text << t_s[i].get<double>() << ' ' << panel.factor * values[i].get<double>() << '\n';
      text << "EOD\n";
      ++panels;
    }
  text << "set multiplot layout " << panels << ",1 title " << quoted(title) << "\n";
  for (const Panel& panel : kPanels)
    if (columns.contains(panel.channel)) {
      text << "set ylabel " << quoted(panel.label) << "\nset xlabel " << (--panels == 0 ? "'t, s'" : "''")
           << "\n"
           << "set autoscale y\nset offsets 0, 0, graph 0.05, graph 0.05\nplot $" << panel.channel << " with "
           << panel.style << " lc rgb '" << panel.color << "'\n";
    }
  text << "unset multiplot\n";
  return text.str();
}

// Starts gnuplot without a shell and feeds it the script.
int gnuplot(const std::string& text) {
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return 126;
  const pid_t pid = fork();
  if (pid == 0) {
    dup2(ends[0], STDIN_FILENO);
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

void draw_series(const json& series, const std::string& title, const std::string& file) {
  check_picture_name(file);
  if (series.at("t_s").size() < 2) throw Stop{kRunFailed, "there are not enough samples to draw"};
  const int code = gnuplot(script(series, title, file));
  if (code == 127) throw Stop{kRunFailed, "gnuplot is not installed (deploy/install-packages)"};
  if (code != 0) throw Stop{kRunFailed, "gnuplot could not draw " + file};
}

}  // namespace slew::ctl

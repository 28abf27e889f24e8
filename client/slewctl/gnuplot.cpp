#include "client/slewctl/gnuplot.hpp"

#include <fcntl.h>
#include <signal.h>
#include <sys/ioctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <sstream>

#include "client/slewctl/connection.hpp"

namespace slew::ctl {
namespace {

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

std::string quoted(const std::string& text) {
  std::string result = "'";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20) continue;
    result += c;
    if (c == '\'') result += '\'';
  }
  return result + "'";
}

std::string terminal_for(const std::string& file, int width, int height) {
  if (file == "-") {
    winsize window{};
    ioctl(STDOUT_FILENO, TIOCGWINSZ, &window);
    const int columns = window.ws_col > 20 ? window.ws_col - 1 : 100;
    return "set terminal dumb size " + std::to_string(std::min(columns, 160)) + ",60\n";
  }
  const bool is_png = file.ends_with(".png");
  const std::string size = std::to_string(width) + "," + std::to_string(height);
  return std::string("set terminal ") + (is_png ? "pngcairo size " + size : "svg size " + size + " dynamic") +
         " noenhanced font 'sans,11'\nset output " + quoted(file) + "\n";
}

std::string in_full(double value) {
  std::ostringstream text;
  text.precision(12);
  text << value;
  return text.str();
}

void check_picture_name(const std::string& file) {
  if (file != "-" && !file.ends_with(".png") && !file.ends_with(".svg"))
    throw Stop{kRefused,
               "a picture's name ends in .png or .svg (or is - for the terminal), not \"" + file + "\""};
}

void run_gnuplot(const std::string& script, const std::string& file) {
  // gnuplot itself would then draw on standard output.
  if (file != "-" && !std::ofstream(file, std::ios::app)) throw Stop{kRunFailed, "cannot write " + file};
  const int code = gnuplot(script);
  if (code == 127) throw Stop{kRunFailed, "gnuplot is not installed (deploy/install-packages)"};
  if (code != 0) throw Stop{kRunFailed, "gnuplot could not draw " + file};
}

}  // namespace slew::ctl

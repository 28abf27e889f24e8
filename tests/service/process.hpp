// Programs under test: started, fed, read, signalled and waited for by their process id.
#pragma once

#include <sys/types.h>

#include <chrono>
#include <filesystem>
#include <string>
#include <vector>

namespace slew::test {

/// A child process; killed when the owner goes, unless it has been waited for.
class Process {
 public:
  Process() = default;
  /// Output goes to the file, or nowhere when the path is empty.
  Process(const std::vector<std::string>& arguments, const std::filesystem::path& output);
  Process(Process&& other) noexcept;
  Process& operator=(Process&& other) noexcept;
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;
  ~Process();

  void signal(int number) const;
  bool is_running();
  /// The exit code, or 128 + signal; kills it and gives 128 + SIGKILL when the time runs out.
  int wait(std::chrono::milliseconds timeout);
  pid_t pid() const { return pid_; }

 private:
  pid_t pid_ = -1;
  int exit_code_ = -1;
  bool collect(bool block);
};

struct Finished {
  int exit_code;
  std::string output;  ///< standard output
  std::string errors;  ///< standard error
};

/// Runs a program to its end. Input is given on standard input.
Finished run(const std::vector<std::string>& arguments, const std::string& input = "",
             std::chrono::milliseconds timeout = std::chrono::minutes(2));

/// A directory of one's own, removed with everything in it.
class TemporaryDirectory {
 public:
  TemporaryDirectory();
  TemporaryDirectory(const TemporaryDirectory&) = delete;
  TemporaryDirectory& operator=(const TemporaryDirectory&) = delete;
  ~TemporaryDirectory();
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace slew::test

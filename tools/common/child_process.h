// SPDX-License-Identifier: Apache-2.0
// A program of the system whose output is read through a pipe. No shell is involved.
#pragma once

#include <sys/types.h>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace farpoint::tools {

class ChildProcess {
 public:
  // Starts arguments[0], looked up in PATH; its standard input is empty. Ends ignoring SIGCHLD. Throws
  // InputError where the program is not installed, naming `package`.
  ChildProcess(std::vector<std::string> arguments, const std::string& package);
  // Ends it where it still runs.
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  // Reads its standard output until the buffer is full or the output ends; returns the bytes read.
  [[nodiscard]] std::size_t read(std::span<char> buffer);
  // Waits for its end; returns the exit status, -1 after a signal or where others took the status.
  [[nodiscard]] int wait();
  // The last line of the first 64 KiB that it wrote to standard error; empty: none.
  [[nodiscard]] std::string complaint() const;

 private:
  pid_t pid_ = -1;
  int output_fd_ = -1, error_fd_ = -1;
};

}  // namespace farpoint::tools

// SPDX-License-Identifier: Apache-2.0
// A progress bar on standard error; silent unless that is a terminal.
#pragma once

#include <cstddef>
#include <string>

namespace farpoint::tools {

class Progress {
 public:
  Progress(std::string label, std::size_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  void advance(std::size_t done);

 private:
  std::string label_;
  std::size_t total_;
  int shown_percent_ = -1;
  bool terminal_;
};

}  // namespace farpoint::tools

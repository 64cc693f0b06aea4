// SPDX-License-Identifier: Apache-2.0
// Command line of lcm-spy with Farpoint's types. Debian's own script fails with Java after 11, since it
// selects a removed garbage collector.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace farpoint::tools {

// Files found on the machine; an empty path was not found.
struct SpyParts {
  std::filesystem::path java;
  std::filesystem::path types_jar;     // Farpoint's, made by the build
  std::filesystem::path lcm_jar;       // lcm-spy itself
  std::filesystem::path jchart2d_jar;  // its plotting library
  bool has_display = false;
};

// Searches java by JAVA_HOME and PATH, Farpoint's jar in share/farpoint beside the folder of `program`, the
// others in `jar_folders`.
[[nodiscard]] SpyParts find_spy_parts(const std::filesystem::path& program,
                                      const std::vector<std::filesystem::path>& jar_folders);

// Returns program and arguments. Throws RunError naming the first missing part and the command that installs
// it.
[[nodiscard]] std::vector<std::string> spy_command_line(const SpyParts& parts, const std::string& url);

}  // namespace farpoint::tools

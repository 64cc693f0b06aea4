// How lcm-spy is started with Farpoint's types. Debian's own script starts no Java after 11: it names a
// garbage collector that is gone.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace farpoint::tools {

// What a machine has; an empty path is what was not found.
struct SpyParts {
  std::filesystem::path java;
  std::filesystem::path types_jar;     // Farpoint's, made by the build
  std::filesystem::path lcm_jar;       // lcm-spy itself
  std::filesystem::path jchart2d_jar;  // what it draws with
  bool has_display = false;
};

// Looks where they are: java by JAVA_HOME and PATH, Farpoint's jar in share/farpoint beside the folder of
// `program`, the others in `jar_folders`.
[[nodiscard]] SpyParts find_spy_parts(const std::filesystem::path& program,
                                      const std::vector<std::filesystem::path>& jar_folders);

// Program and arguments. Throws RunError naming the first part that is missing and what would bring it.
[[nodiscard]] std::vector<std::string> spy_command_line(const SpyParts& parts, const std::string& url);

}  // namespace farpoint::tools

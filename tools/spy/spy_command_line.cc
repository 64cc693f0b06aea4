// SPDX-License-Identifier: Apache-2.0
#include "tools/spy/spy_command_line.h"

#include <unistd.h>

#include <cstdlib>
#include <sstream>

#include "tools/common/errors.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

std::string environment(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

bool is_program(const fs::path& file) {
  std::error_code error;
  return fs::is_regular_file(file, error) && access(file.c_str(), X_OK) == 0;
}

fs::path find_java() {
  if (const std::string home = environment("JAVA_HOME"); !home.empty() && is_program(home + "/bin/java"))
    return home + "/bin/java";
  std::istringstream folders(environment("PATH"));
  for (std::string folder; std::getline(folders, folder, ':');)
    if (!folder.empty() && is_program(folder + "/java")) return folder + "/java";
  return {};
}

fs::path find_jar(const std::vector<fs::path>& folders, const std::string& name) {
  std::error_code error;
  for (const fs::path& folder : folders)
    if (fs::is_regular_file(folder / name, error)) return folder / name;
  return {};
}

void require(const fs::path& part, const std::string& name, const std::string& cure) {
  if (part.empty()) throw RunError("spy: no " + name + " here, expected " + cure);
}

}  // namespace

SpyParts find_spy_parts(const fs::path& program, const std::vector<fs::path>& jar_folders) {
  SpyParts parts;
  parts.java = find_java();
  parts.types_jar = find_jar({program.parent_path().parent_path() / "share/farpoint"}, "farpoint_types.jar");
  parts.lcm_jar = find_jar(jar_folders, "lcm.jar");
  parts.jchart2d_jar = find_jar(jar_folders, "jchart2d.jar");
  parts.has_display = !environment("DISPLAY").empty();
  return parts;
}

std::vector<std::string> spy_command_line(const SpyParts& parts, const std::string& url) {
  require(parts.java, "java", "a Java runtime (tools/deps --spy; Debian: default-jre)");
  require(
      parts.types_jar, "farpoint_types.jar",
      "a build made where javac and LCM's Java library were (tools/deps --spy, then build), or --jar FILE "
      "(/usr/share/farpoint/make_types_jar of the package makes one)");
  require(parts.lcm_jar, "lcm.jar", "LCM's Java library (tools/deps --spy; Debian: liblcm-java)");
  require(parts.jchart2d_jar, "jchart2d.jar",
          "the charts it draws (tools/deps --spy; Debian: libjchart2d-java)");
  if (!parts.has_display)
    throw RunError(
        "spy: no display (DISPLAY is not set), expected a desktop or ssh -X; farpoint top needs none");
  return {parts.java.string(),
          "-Djava.net.preferIPv4Stack=true",
          "-Xms64m",
          "-Xmx256m",
          "-cp",
          parts.types_jar.string() + ":" + parts.lcm_jar.string() + ":" + parts.jchart2d_jar.string(),
          "lcm.spy.Spy",
          "--lcm-url=" + url};
}

}  // namespace farpoint::tools

// SPDX-License-Identifier: Apache-2.0
#include "tools/spy/spy_command_line.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "tests/support/paths.h"
#include "tests/tools/tool_support.h"
#include "tools/common/errors.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

// An environment variable as a test wants it, until its end.
class Environment {
 public:
  Environment(const char* name, const std::string& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    setenv(name, value.c_str(), 1);
  }
  ~Environment() { before_.empty() ? unsetenv(name_) : setenv(name_, before_.c_str(), 1); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* name_;
  std::string before_;
};

void put_program(const fs::path& file) {
  put(file, "#!/bin/sh\n");
  fs::permissions(file, fs::perms::owner_all);
}

SpyParts all_parts() {
  return {"/j/bin/java", "/f/farpoint_types.jar", "/s/lcm.jar", "/s/jchart2d.jar", true};
}

std::string complaint(const SpyParts& parts) {
  try {
    (void)spy_command_line(parts, "udpm://239.255.76.67:7667?ttl=0");
  } catch (const RunError& error) {
    return error.what();
  }
  return "";
}

TEST(Spy, TheCommandLineHasAllJarsAndTheUrl) {
  const auto line = spy_command_line(all_parts(), "udpm://239.255.76.67:7667?ttl=0");
  EXPECT_EQ(line.front(), "/j/bin/java");
  const auto path = std::find(line.begin(), line.end(), "-cp");
  ASSERT_NE(path, line.end());
  EXPECT_EQ(*(path + 1), "/f/farpoint_types.jar:/s/lcm.jar:/s/jchart2d.jar");
  EXPECT_EQ(*(path + 2), "lcm.spy.Spy");
  EXPECT_EQ(line.back(), "--lcm-url=udpm://239.255.76.67:7667?ttl=0");
  // Java from 14 on does not start with what Debian's script says.
  EXPECT_EQ(std::count(line.begin(), line.end(), "-Xincgc"), 0);
}

TEST(Spy, WhatIsMissingIsNamedWithItsCure) {
  EXPECT_EQ(complaint(all_parts()), "");
  SpyParts parts = all_parts();
  parts.has_display = false;
  EXPECT_NE(complaint(parts).find("no display (DISPLAY is not set), expected a desktop"), std::string::npos);
  parts.jchart2d_jar = "";
  EXPECT_NE(complaint(parts).find("no jchart2d.jar here, expected"), std::string::npos);
  parts.lcm_jar = "";
  EXPECT_NE(complaint(parts).find("no lcm.jar here, expected"), std::string::npos);
  parts.types_jar = "";
  EXPECT_NE(complaint(parts).find("no farpoint_types.jar here, expected"), std::string::npos);
  parts.java = "";
  EXPECT_NE(complaint(parts).find("no java here, expected a Java runtime (tools/deps --spy"),
            std::string::npos);
}

TEST(Spy, PartsAreFoundWhereTheyLie) {
  const ScratchFolder root;
  const Environment home("JAVA_HOME", (root / "home").string());
  const Environment path("PATH", (root / "none").string() + "::" + (root / "path").string());
  const Environment display("DISPLAY", "");
  const fs::path program = root / "usr/bin/farpoint";
  const std::vector<fs::path> folders = {root / "first", root / "second"};

  SpyParts parts = find_spy_parts(program, folders);
  EXPECT_EQ(parts.java, "");
  EXPECT_EQ(parts.types_jar, "");
  EXPECT_EQ(parts.lcm_jar, "");
  EXPECT_FALSE(parts.has_display);

  put(root / "none/java", "no program");
  put_program(root / "path/java");
  put(root / "usr/share/farpoint/farpoint_types.jar", "");
  put(root / "first/jchart2d.jar", "");
  put(root / "second/jchart2d.jar", "");
  put(root / "second/lcm.jar", "");
  const Environment screen("DISPLAY", ":7");
  parts = find_spy_parts(program, folders);
  EXPECT_EQ(parts.java, root / "path/java");
  EXPECT_EQ(parts.types_jar, root / "usr/share/farpoint/farpoint_types.jar");
  EXPECT_EQ(parts.lcm_jar, root / "second/lcm.jar");
  EXPECT_EQ(parts.jchart2d_jar, root / "first/jchart2d.jar");
  EXPECT_TRUE(parts.has_display);

  put_program(root / "home/bin/java");
  EXPECT_EQ(find_spy_parts(program, folders).java, root / "home/bin/java");
}

TEST(Spy, TheProgramSaysWhatIsMissing) {
  const ProgramResult jar = run_farpoint_program("spy --jar /nonexistent/types.jar");
  EXPECT_EQ(jar.status, 2);
  EXPECT_EQ(jar.err,
            "farpoint: spy: --jar /nonexistent/types.jar: no such file, expected a jar of LCM types\n");
  const ScratchFolder root;
  const std::string empty = "env -u JAVA_HOME -u DISPLAY PATH=" + root.path().string() + " ";
  const ProgramResult java = run_shell(empty + test::binary_dir() + "/bin/farpoint spy");
  EXPECT_EQ(java.status, 1);
  EXPECT_EQ(java.err.rfind("farpoint: spy: no java here, expected a Java runtime", 0), 0U) << java.err;
  EXPECT_EQ(std::count(java.err.begin(), java.err.end(), '\n'), 1);
}

}  // namespace
}  // namespace farpoint::tools

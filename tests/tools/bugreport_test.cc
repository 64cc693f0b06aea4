// SPDX-License-Identifier: Apache-2.0
#include "tools/bugreport/bugreport.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <sstream>
#include <thread>

#include "daemon/system/control_socket.h"
#include "tests/support/paths.h"
#include "tests/tools/tool_support.h"

namespace farpoint::tools {
namespace {

namespace fs = std::filesystem;

class Bugreport : public testing::Test {
 protected:
  Bugreport() {
    put(config(), "camera:\n  calibration: " + (root_ / "camera.yaml").string() + "\nlog:\n  file: " +
                      (root_ / "farpointd.log").string() + "\ncontrol:\n  socket: " + socket() + "\n");
    put(root_ / "camera.yaml", get(test::source_dir() + "/config/cameras/tum-freiburg1.yaml"));
    put(root_ / "farpointd.log", "first line\nlast line\n");
  }
  [[nodiscard]] fs::path config() const { return root_ / "farpoint.yaml"; }
  [[nodiscard]] std::string socket() const { return (root_ / "control").string(); }
  // `before`: a program that runs it.
  [[nodiscard]] ProgramResult report(const std::string& before = "") const {
    return run_shell("cd '" + root_.path().string() + "' && " + before + " " + program() +
                     " bugreport --config '" + config().string() + "' -o fault.tar.gz");
  }
  void unpack() const {
    const ProgramResult done =
        run_shell("tar -xzf '" + (root_ / "fault.tar.gz").string() + "' -C '" + root_.path().string() + "'");
    ASSERT_EQ(done.status, 0) << done.err;
  }
  [[nodiscard]] fs::path in_archive(const std::string& name) const {
    return root_ / ("farpoint-bugreport/" + name);
  }
  [[nodiscard]] std::string contents() const { return get(in_archive("contents.txt")); }

  const ScratchFolder root_;
};

TEST_F(Bugreport, HoldsConfigurationCalibrationVersionsCheckAndLog) {
  const ProgramResult done = report();
  ASSERT_EQ(done.status, 0) << done.err;
  EXPECT_EQ(done.err, "");
  unpack();
  EXPECT_EQ(get(in_archive("configuration/farpoint.yaml")), get(config()));
  EXPECT_EQ(get(in_archive("configuration/camera.yaml")), get(root_ / "camera.yaml"));
  EXPECT_NE(get(in_archive("configuration/all_keys.yaml")).find("features: 1500"), std::string::npos);
  EXPECT_EQ(get(in_archive("log/farpointd.log")), "first line\nlast line\n");
  for (const char* program_name : {"farpoint", "farpointd"})
    EXPECT_EQ(get(in_archive(std::string("versions/") + program_name + ".txt"))
                  .find(std::string(program_name) + " 0."),
              0U);
  EXPECT_NE(get(in_archive("state/check.txt")).find("calibration         ok"), std::string::npos);
  EXPECT_NE(get(in_archive("hardware/memory.txt")).find("MemTotal"), std::string::npos);
}

TEST_F(Bugreport, EveryFileIsInTheListAndWhatIsMissingHasAReason) {
  fs::remove(root_ / "camera.yaml");
  const ProgramResult done = report();
  ASSERT_EQ(done.status, 0) << done.err;
  unpack();
  std::size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(in_archive(""))) {
    if (!entry.is_regular_file()) continue;
    const std::string name = fs::relative(entry.path(), in_archive("")).string();
    if (name == "contents.txt") continue;
    EXPECT_NE(contents().find("  " + name + " "), std::string::npos) << name;
    ++files;
  }
  EXPECT_GT(files, 8U);
  for (const std::string& part :
       {"configuration/camera.yaml: " + (root_ / "camera.yaml").string() + ": No such file or directory",
        std::string("state/daemon.txt: no daemon answers: ")}) {
    EXPECT_NE(contents().find("  " + part), std::string::npos) << contents();
    EXPECT_NE(done.out.find("not read: " + part), std::string::npos) << done.out;
  }
  EXPECT_FALSE(fs::exists(in_archive("configuration/camera.yaml")));
}

TEST_F(Bugreport, AsksTheDaemonThatRuns) {
  daemon::ControlSocket served(socket());
  std::atomic<bool> over = false;
  std::thread server([&] {
    while (!over) {
      served.serve([](const std::string& command) { return "ok asked for " + command; });
      usleep(1000);
    }
  });
  const ProgramResult done = report();
  over = true;
  server.join();
  ASSERT_EQ(done.status, 0) << done.err;
  unpack();
  EXPECT_EQ(get(in_archive("state/daemon.txt")), "ok asked for status\n");
}

TEST_F(Bugreport, OfALongLogItTakesTheEndAndNamesWhatIsLeftOut) {
  const std::string line(99, 'x');
  std::string log;
  for (int i = 0; i < 60'000; ++i) log += line + "\n";
  put(root_ / "farpointd.log", "first line\n" + log + "last line\n");
  ASSERT_EQ(report().status, 0);
  unpack();
  const std::string taken = get(in_archive("log/farpointd.log"));
  EXPECT_EQ(taken.find("[4000021 bytes before this are left out]\n"), 0U) << taken.substr(0, 80);
  EXPECT_TRUE(taken.ends_with("\nlast line\n"));
}

TEST_F(Bugreport, AConfigurationThatIsWrongIsTakenAndItsFaultListed) {
  put(config(), "camera:\n  nosuchkey: 1\n");
  const ProgramResult done = report();
  ASSERT_EQ(done.status, 0) << done.err;
  unpack();
  EXPECT_EQ(get(in_archive("configuration/farpoint.yaml")), "camera:\n  nosuchkey: 1\n");
  EXPECT_NE(contents().find("configuration/all_keys.yaml: "), std::string::npos);
  EXPECT_NE(contents().find("nosuchkey"), std::string::npos);
  EXPECT_NE(get(in_archive("state/check.txt")).find("configuration  error"), std::string::npos);
}

TEST_F(Bugreport, WithoutPrivilegesItListsWhatItCannotRead) {
  fs::permissions(root_.path(), fs::perms::all);
  fs::permissions(root_ / "farpointd.log", fs::perms::none);
  const bool is_root = geteuid() == 0;
  const std::string nobody = "setpriv --reuid=65534 --regid=65534 --clear-groups";
  if (is_root && run_shell(nobody + " " + program() + " --version").status != 0)
    GTEST_SKIP() << "another account may not run the build's programs";
  const ProgramResult done = report(is_root ? nobody : "");
  ASSERT_EQ(done.status, 0) << done.err;
  unpack();
  EXPECT_NE(
      contents().find("log/farpointd.log: " + (root_ / "farpointd.log").string() + ": Permission denied"),
      std::string::npos)
      << contents();
  EXPECT_TRUE(fs::exists(in_archive("configuration/camera.yaml")));
}

TEST_F(Bugreport, AnArchiveThatCannotBeWrittenIsRefusedInOneLine) {
  const ProgramResult done = run_farpoint_program("bugreport -o /nosuchfolder/fault.tar.gz");
  EXPECT_EQ(done.status, 2);
  EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
}

}  // namespace
}  // namespace farpoint::tools

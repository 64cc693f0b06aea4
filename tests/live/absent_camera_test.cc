// SPDX-License-Identifier: Apache-2.0
// farpointd live, as it is started on a vehicle, with the driver that is built in.
#include <gtest/gtest.h>

#include <string>

#include "tests/ipc/scratch.h"
#include "tests/replay/recordings.h"
#include "tests/support/paths.h"

namespace farpoint::test {
namespace {

TEST(LiveProgram, WaitsForACameraThatIsNotThereAndStopsWhenItIsTold) {
  const Scratch work;
  const std::string said = work.path("said.txt");
  const std::string start =
      (kBin / "farpointd").string() +
      " --set camera.device=/dev/video-none --set control.socket=none --set lcm.enabled=false "
      "--set camera.calibration=" +
      test::source_dir() + "/config/cameras/tum-freiburg1.yaml > " + said + " 2>&1 & daemon=$!; ";
  // Waits for the log line, at most half a minute; then sends the signal.
  const std::string wait = "for i in $(seq 300); do grep -q 'starting -> no_camera' " + said +
                           " && break; sleep 0.1; done; kill -TERM $daemon; wait $daemon";
  EXPECT_EQ(run(start + wait), 0);
  EXPECT_EQ(run("grep -q 'starting -> no_camera' " + said), 0);
  EXPECT_EQ(run("grep -q 'stopped by signal 15' " + said), 0);
}

}  // namespace
}  // namespace farpoint::test

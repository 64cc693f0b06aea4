// farpointd live, as it is started on a vehicle, with the driver that is built in.
#include <gtest/gtest.h>

#include <string>

#include "tests/ipc/scratch.h"
#include "tests/replay/recordings.h"

namespace farpoint::test {
namespace {

TEST(LiveProgram, WaitsForACameraThatIsNotThereAndStopsWhenItIsTold) {
  const Scratch work;
  const std::string said = work.path("said.txt");
  EXPECT_EQ(run("timeout --preserve-status -s TERM 1 " + (kBin / "farpointd").string() +
                " --set camera.device=/dev/video-none --set lcm.url=memq:// --set camera.calibration=" +
                FARPOINT_SOURCE_DIR "/config/cameras/tum-freiburg1.yaml > " + said + " 2>&1"),
            0);
  EXPECT_EQ(run("grep -q 'starting -> no_camera' " + said), 0);
  EXPECT_EQ(run("grep -q 'stopped by signal 15' " + said), 0);
}

}  // namespace
}  // namespace farpoint::test

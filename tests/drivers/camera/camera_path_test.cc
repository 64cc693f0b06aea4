// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/camera_path.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>

#include "tests/ipc/scratch.h"

namespace farpoint::drivers {
namespace {

namespace fs = std::filesystem;

// A sysfs with one node of a camera at a USB port.
void add_node(const fs::path& root, int number, const std::string& port, char index) {
  const std::string name = "video" + std::to_string(number);
  const fs::path device =
      root / "sys/devices/pci0000:00/0000:00:14.0/usb1" / port / (port + ":1.0") / "video4linux" / name;
  fs::create_directories(device);
  std::ofstream(device / "index") << index << '\n';
  fs::create_directories(root / "sys/class/video4linux");
  fs::create_symlink(device, root / "sys/class/video4linux" / name);
  fs::create_directories(root / "dev");
  std::ofstream(root / "dev" / name) << "";
}

TEST(CameraPath, OnlyNamesThatCanBeUsed) {
  for (const char* good :
       {"/dev/video0", "/dev/v4l/by-path/x", "by-id:usb-Cam_1-video-index0", "usb:1-2.3", "usb:3-1"})
    EXPECT_EQ(CameraPath::check(good), "") << good;
  for (const char* bad : {"", "/", "video0", "by-id:", "by-id:a/b", "usb:", "usb:1", "usb:-1", "usb:1-",
                          "usb:1-2/3", "usb:x-1"}) {
    const std::string why = CameraPath::check(bad);
    EXPECT_NE(why.find("expected a path like /dev/video0"), std::string::npos) << bad;
  }
}

TEST(CameraPath, APathAndAnId) {
  const test::Scratch scratch;
  const std::string root = scratch.path("");
  EXPECT_EQ(CameraPath("/dev/video3", root).find(), nullptr);
  add_node(root, 3, "1-2", '0');
  EXPECT_NE(CameraPath("/dev/video3", root).find(), nullptr);
  EXPECT_EQ(CameraPath("by-id:cam", root).find(), nullptr);
  fs::create_directories(root + "/dev/v4l/by-id");
  fs::create_symlink(root + "/dev/video3", root + "/dev/v4l/by-id/cam");
  EXPECT_NE(CameraPath("by-id:cam", root).find(), nullptr);
}

TEST(CameraPath, ACameraIsFoundByItsPortWhateverItsNumber) {
  const test::Scratch scratch;
  const std::string root = scratch.path("r");
  fs::create_directories(root);
  add_node(root, 0, "1-2.3", '0');  // another camera whose port begins alike
  add_node(root, 4, "1-2", '1');    // the camera's node for metadata
  add_node(root, 7, "1-2", '0');
  CameraPath path("usb:1-2", root);
  ASSERT_NE(path.find(), nullptr);
  EXPECT_EQ(std::string(path.find()), root + "/dev/video7");
  EXPECT_EQ(CameraPath("usb:1-9", root).find(), nullptr);
}

}  // namespace
}  // namespace farpoint::drivers

// SPDX-License-Identifier: Apache-2.0
#include "drivers/libcamera/libcamera_loader.h"

#include <gtest/gtest.h>

#include <cerrno>

#include "tests/ipc/allocations.h"

namespace farpoint::drivers {
namespace {

TEST(LibcameraModule, IsFoundBesideTheProgramLoadedAndListsNoSuchCamera) {
  if (!test::counts_allocations()) GTEST_SKIP() << "a sanitizer knows nothing of libcamera's threads";
  std::string problem;
  const auto system = load_libcamera(libcamera_module_path(), &problem);
  ASSERT_NE(system, nullptr) << problem;
  FinishedRequests finished;
  for (int i = 0; i < 5; ++i) {
    const char* what = "";
    EXPECT_EQ(system->open("no such camera", &finished, &what), -ENOENT);
    EXPECT_STREQ(what, "libcamera does not list it");
    EXPECT_EQ(system->open("999", &finished, &what), -ENOENT);
  }
  system->close();
  EXPECT_FALSE(finished.was_removed());
}

TEST(LibcameraModule, OneThatIsNotThereIsNamed) {
  std::string problem;
  EXPECT_EQ(load_libcamera("/nonexistent/farpoint_libcamera.so", &problem), nullptr);
  EXPECT_NE(problem.find("/nonexistent/farpoint_libcamera.so"), std::string::npos) << problem;
  // A library, but none of Farpoint's.
  EXPECT_EQ(load_libcamera("libm.so.6", &problem), nullptr);
  EXPECT_NE(problem.find("another version"), std::string::npos) << problem;
}

}  // namespace
}  // namespace farpoint::drivers

#include "drivers/socketcan.h"

#include <gtest/gtest.h>
#include <linux/can.h>
#include <sys/socket.h>
#include <unistd.h>

#include <stdexcept>
#include <string>

namespace farpoint::drivers {
namespace {

bool kernel_has_can() {
  const int fd = socket(PF_CAN, SOCK_RAW, CAN_RAW);
  if (fd >= 0) close(fd);
  return fd >= 0;
}

std::string error_of(const std::string& interface) {
  try {
    SocketCan can(interface);
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return {};
}

// Sending itself is proved in the virtual machine, which has vcan.
TEST(SocketCan, AnErrorSaysWhatIsMissing) {
  const std::string error = error_of("nocan0");
  EXPECT_NE(error.find("nocan0"), std::string::npos) << error;
  EXPECT_NE(error.find(kernel_has_can() ? "no such interface" : "kernel has no CAN"), std::string::npos)
      << error;
}

}  // namespace
}  // namespace farpoint::drivers

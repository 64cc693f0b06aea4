// SPDX-License-Identifier: Apache-2.0
// A kernel with one CAN interface in the place of this machine's, which may have none. While one is alive,
// the program's socket calls for CAN go to it; all others pass.
#pragma once

namespace farpoint::test {

class FakeCanKernel {
 public:
  FakeCanKernel();
  ~FakeCanKernel();
  FakeCanKernel(const FakeCanKernel&) = delete;
  FakeCanKernel& operator=(const FakeCanKernel&) = delete;

  static constexpr const char* kInterface = "fakecan0";
  bool has_interface = true;
  int mtu = 16;  // 72: CAN FD
  // The other end of the socket opened last, -1 for none.
  int bus = -1;
};

}  // namespace farpoint::test

// SPDX-License-Identifier: Apache-2.0
#include "tests/drivers/camera/fake_camera.h"

#include <algorithm>

namespace farpoint::test {

FakeCamera::FakeCamera() {
  waits_ms.reserve(1 << 16);
  queued_.reserve(32);
}

void FakeCamera::pass(std::int64_t us) {
  now.monotonic_us += us;
  now.boottime_us += us;
  now.realtime_us += us;
}

std::optional<FakeCamera::Filled> FakeCamera::fill(const FakeShot& shot) {
  if (queued_.empty()) return std::nullopt;
  Filled filled;
  filled.buffer = queued_.front();
  queued_.erase(queued_.begin());
  std::vector<std::uint8_t>& memory = memory_.at(filled.buffer);
  if (shot.bytes) {
    filled.bytes = std::min(shot.bytes->size(), memory.size());
    std::copy_n(shot.bytes->begin(), filled.bytes, memory.begin());
  } else {
    filled.bytes = memory.size();
    std::fill(memory.begin(), memory.end(), shot.grey);
  }
  return filled;
}

void FakeCameraWait::wait(int fd, int timeout_ms) {
  constexpr std::int64_t kMicrosPerMilli = 1000;
  camera_->waits_ms.push_back(timeout_ms);
  camera_->pass(kMicrosPerMilli * (camera_->is_readable(fd) ? 1 : timeout_ms));
}

}  // namespace farpoint::test

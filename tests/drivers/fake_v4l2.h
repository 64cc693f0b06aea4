// A V4L2 camera in memory, for tests of the driver: it answers the same requests with the same structures as
// the kernel does, and does wrong what a test asks for.
#pragma once

#include <linux/videodev2.h>

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "drivers/camera_wait.h"
#include "drivers/v4l2_system.h"

namespace farpoint::test {

struct FakeFormat {
  std::uint32_t code = V4L2_PIX_FMT_GREY;
  int width = 64, height = 48;
  double fastest_hz = 30;
  int stride_padding = 0;  // bytes
};

struct FakeFrame {
  std::vector<std::uint8_t> bytes;
  std::uint32_t sequence = 0;
  std::int64_t stamp_us = 0;
  std::uint32_t flags = V4L2_BUF_FLAG_TIMESTAMP_MONOTONIC;
};

// What the tests and the driver's V4l2System share.
// It makes no heap call while it streams, so that a test can see whether the driver does.
struct FakeCamera {
  FakeCamera() {
    waits_ms.reserve(1 << 16);
    queued.reserve(32);
  }
  std::vector<FakeFormat> formats{{}};
  std::string driver = "fake";
  std::uint32_t capabilities = V4L2_CAP_VIDEO_CAPTURE | V4L2_CAP_STREAMING;
  bool plugged = true;
  bool takes_other_size = false;                                // S_FMT changes what was asked for
  int stream_error = 0;                                         // of the next DQBUF, errno
  std::map<std::uint32_t, std::pair<int, int>> control_ranges;  // that it has
  std::map<std::uint32_t, int> controls;                        // as set
  std::deque<FakeFrame> frames;                                 // ready to be taken
  farpoint::drivers::ClockReadings now{10'000'000, 10'000'000, 1'700'000'000'000'000};

  // Seen.
  v4l2_pix_format set{};
  double set_rate_hz = 0;
  int opened = 0, closed = 0, mapped = 0, unmapped = 0, streams = 0;
  std::int64_t waited_ms = 0;
  std::vector<int> waits_ms;
  [[nodiscard]] int buffers_queued() const { return static_cast<int>(queued.size()); }

  std::vector<std::uint32_t> queued;
  std::vector<std::vector<std::uint8_t>> memory;
  bool streaming = false;
};

// A frame of a plain image, stamped just now.
[[nodiscard]] FakeFrame fake_frame(const FakeCamera& camera, std::uint32_t sequence, std::uint8_t grey = 100);

class FakeV4l2System final : public drivers::V4l2System {
 public:
  explicit FakeV4l2System(std::shared_ptr<FakeCamera> camera) : camera_(std::move(camera)) {}
  [[nodiscard]] int open(const char* path) override;
  void close(int fd) override;
  [[nodiscard]] int ioctl(int fd, unsigned long request, void* argument) override;
  [[nodiscard]] void* map(int fd, std::size_t bytes, std::int64_t offset) override;
  void unmap(void* memory, std::size_t bytes) override;

 private:
  int list_format(v4l2_fmtdesc* entry);
  int list_size(v4l2_frmsizeenum* entry);
  int list_interval(v4l2_frmivalenum* entry);
  int set_format(v4l2_format* format);
  int request_buffers(v4l2_requestbuffers* request);
  int dequeue(v4l2_buffer* buffer);
  int control(unsigned long request, void* argument);
  [[nodiscard]] std::size_t buffer_bytes() const;

  std::shared_ptr<FakeCamera> camera_;
};

// Time passes as it is waited for.
class FakeV4l2Wait final : public drivers::CameraWait {
 public:
  explicit FakeV4l2Wait(std::shared_ptr<FakeCamera> camera) : camera_(std::move(camera)) {}
  void wait(int fd, int timeout_ms) override;
  [[nodiscard]] drivers::ClockReadings clocks() override { return camera_->now; }

 private:
  std::shared_ptr<FakeCamera> camera_;
};

}  // namespace farpoint::test

// SPDX-License-Identifier: Apache-2.0
// A live camera over a fake one, as the tests of all drivers begin. A driver shows that it does what all have
// in common (live_camera_test.cc) by
//   INSTANTIATE_TEST_SUITE_P(Driver, LiveCameraTest, testing::Values(&test::make_fake<FakeOfTheDriver>));
#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <vector>

#include "drivers/camera/live_camera.h"
#include "tests/drivers/camera/fake_camera.h"

namespace farpoint::test {

template <typename Fake>
class LiveCameraFixture : public testing::Test {
 protected:
  static constexpr int kTimeout_ms = 20;

  explicit LiveCameraFixture(std::unique_ptr<Fake> fake = std::make_unique<Fake>()) : fake_(std::move(fake)) {
    options_.width_px = 64;
    options_.height_px = 48;
    options_.rate_hz = 30;
    options_.exposure.mode = drivers::ExposureMode::kCamera;
  }

  void make() {
    camera_.reset();
    events_.clear();
    camera_ = std::make_unique<drivers::LiveCamera>(options_, fake_->make_device(options_),
                                                    std::make_unique<FakeCameraWait>(fake_.get()));
    camera_->on_event([this](const drivers::CameraEvent& event) { events_.push_back(event); });
  }
  bool next() { return camera_->next(kTimeout_ms, &image_, &frame_); }
  // Opens the camera by looking for an image that is not there.
  void start() {
    make();
    EXPECT_FALSE(next());
    ASSERT_TRUE(camera_->is_streaming());
  }
  // At most 1.2 s.
  void wait_for_stream() {
    for (int i = 0; i < 60 && !camera_->is_streaming(); ++i) EXPECT_FALSE(next());
    ASSERT_TRUE(camera_->is_streaming());
  }
  [[nodiscard]] bool show(std::uint32_t sequence, std::uint8_t grey = 100) {
    return fake_->show({.sequence = sequence, .grey = grey});
  }
  [[nodiscard]] std::vector<drivers::CameraEvent::Kind> kinds() const {
    std::vector<drivers::CameraEvent::Kind> all;
    for (const drivers::CameraEvent& e : events_) all.push_back(e.kind);
    return all;
  }

  std::unique_ptr<Fake> fake_;
  drivers::CameraOptions options_;
  std::unique_ptr<drivers::LiveCamera> camera_;
  std::vector<drivers::CameraEvent> events_;
  ipc::GreyImage image_;
  drivers::CameraFrame frame_;
};

using MakeFakeCamera = std::unique_ptr<FakeCamera> (*)();
template <typename Fake>
std::unique_ptr<FakeCamera> make_fake() {
  return std::make_unique<Fake>();
}

class LiveCameraTest : public LiveCameraFixture<FakeCamera>,
                       public testing::WithParamInterface<MakeFakeCamera> {
 protected:
  LiveCameraTest() : LiveCameraFixture(GetParam()()) {}
};

}  // namespace farpoint::test

// SPDX-License-Identifier: Apache-2.0
// Images of another process, which here is the test itself.
#include "drivers/lcm/socket_camera.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "drivers/camera/live_camera.h"
#include "ipc/channels.h"
#include "ipc/event_file.h"
#include "tests/ipc/scratch.h"

namespace farpoint::drivers {
namespace {

using Kind = CameraEvent::Kind;
using Bytes = std::vector<std::uint8_t>;

constexpr int kWidth = 64, kHeight = 48;

// A process that offers images to one reader.
class Offerer {
 public:
  explicit Offerer(const std::string& path) : listening_(socket(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path.copy(address.sun_path, sizeof(address.sun_path) - 1);
    EXPECT_EQ(bind(listening_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(listen(listening_, 1), 0);
  }
  ~Offerer() {
    hang_up();
    close(listening_);
  }
  Offerer(const Offerer&) = delete;
  Offerer& operator=(const Offerer&) = delete;

  void accept_reader() { connected_ = accept(listening_, nullptr, nullptr); }
  void hang_up() {
    if (connected_ >= 0) close(connected_);
    connected_ = -1;
  }
  void send_bytes(const Bytes& bytes, std::size_t from = 0, std::size_t to = SIZE_MAX) const {
    to = std::min(to, bytes.size());
    EXPECT_EQ(send(connected_, bytes.data() + from, to - from, MSG_NOSIGNAL),
              static_cast<ssize_t>(to - from));
  }

 private:
  int listening_ = -1, connected_ = -1;
};

class SocketCameraTest : public testing::Test {
 protected:
  SocketCameraTest() {
    options_.device = scratch_.path("front.sock");
    options_.width_px = kWidth;
    options_.height_px = kHeight;
    make();
  }
  void make() {
    camera_ = std::make_unique<LiveCamera>(options_, std::make_unique<SocketCamera>(options_));
    camera_->on_event([this](const CameraEvent& event) { events_.push_back(event); });
  }
  // As a log holds it.
  [[nodiscard]] Bytes event(const std::string& channel, const Bytes& data) const {
    const std::string path = scratch_.path("event");
    ipc::EventFile file(path);
    EXPECT_EQ(file.append(channel, 0, data), 0);
    return test::read_bytes(path);
  }
  [[nodiscard]] Bytes image_event(std::int64_t utime, std::int64_t sequence, int width_px = kWidth,
                                  const std::string& channel = "CAMERA_0") const {
    image_t image{};
    image.utime = utime;
    image.sequence = sequence;
    image.exposure_us = 777;
    image.gain = 3.0F;
    image.width = width_px;
    image.height = kHeight;
    image.pixel_format = image_t::PIXEL_FORMAT_GREY;
    image.size = width_px * kHeight;
    image.data.assign(static_cast<std::size_t>(image.size), static_cast<std::uint8_t>(sequence));
    Bytes data;
    ipc::encode(image, &data);
    return event(channel, data);
  }
  static std::int64_t now_us() { return read_clocks().monotonic_us; }
  bool next(int timeout_ms = 20) { return camera_->next(timeout_ms, &image_, &frame_); }
  void connect() {
    EXPECT_FALSE(next());
    ASSERT_TRUE(camera_->is_streaming());
    offerer_->accept_reader();
  }

  const test::Scratch scratch_;
  CameraOptions options_;
  std::unique_ptr<Offerer> offerer_ = std::make_unique<Offerer>(scratch_.path("front.sock"));
  std::unique_ptr<LiveCamera> camera_;
  std::vector<CameraEvent> events_;
  ipc::GreyImage image_;
  CameraFrame frame_;
};

TEST_F(SocketCameraTest, EachImageComesWithItsData) {
  connect();
  for (int i = 0; i < 20; ++i) {
    const std::int64_t utime = now_us();
    offerer_->send_bytes(image_event(utime, 7 + i));
    ASSERT_TRUE(next());
    EXPECT_EQ(frame_.utime, utime);
    EXPECT_EQ(frame_.sequence, i);
    EXPECT_EQ(frame_.exposure_us, 777);
    EXPECT_EQ(frame_.gain, 3.0F);
    EXPECT_EQ(int{image_.pixels[100]}, 7 + i);
  }
  EXPECT_EQ(camera_->counts().times_unknown, 0);
}

TEST_F(SocketCameraTest, ImagesSentAtOnceAreGivenOneByOneWithoutAWait) {
  connect();
  const std::int64_t utime = now_us();
  Bytes all;
  for (int i = 0; i < 5; ++i) {
    const Bytes one = image_event(utime + i, i);
    all.insert(all.end(), one.begin(), one.end());
  }
  offerer_->send_bytes(all);
  for (int i = 0; i < 5; ++i) {
    ASSERT_TRUE(next(0)) << i;
    EXPECT_EQ(int{image_.pixels[0]}, i);
  }
  EXPECT_FALSE(next(0));
}

TEST_F(SocketCameraTest, AnImageThatComesInPiecesIsWhole) {
  connect();
  const std::int64_t utime = now_us();
  const Bytes bytes = image_event(utime, 9);
  for (const std::size_t at : {std::size_t{10}, std::size_t{30}, std::size_t{40}, std::size_t{1000}}) {
    static std::size_t from = 0;
    offerer_->send_bytes(bytes, from, at);
    from = at;
    EXPECT_FALSE(next(1));
  }
  offerer_->send_bytes(bytes, 1000);
  ASSERT_TRUE(next());
  EXPECT_EQ(frame_.utime, utime);
  EXPECT_EQ(int{image_.pixels.back()}, 9);
}

TEST_F(SocketCameraTest, OtherChannelsArePassedOverHoweverLongTheirEventsAre) {
  connect();
  std::thread sender([this] {
    offerer_->send_bytes(event("FARPOINT_MAP", Bytes(1'000'000, 0xED)));
    offerer_->send_bytes(image_event(now_us(), 1, kWidth, "CAMERA_1"));
    offerer_->send_bytes(event("CALIBRATION", Bytes(100)));
    offerer_->send_bytes(image_event(now_us(), 2));
  });
  bool came = false;
  for (int i = 0; i < 500 && !came; ++i) came = next();
  sender.join();
  ASSERT_TRUE(came);
  EXPECT_EQ(int{image_.pixels[0]}, 2);
  EXPECT_EQ(camera_->counts().frames, 1);
}

TEST_F(SocketCameraTest, ImagesOfAnotherSizeAndDamagedOnesAreCountedAndDropped) {
  connect();
  offerer_->send_bytes(image_event(now_us(), 0, kWidth / 2));
  EXPECT_FALSE(next());
  offerer_->send_bytes(event("CAMERA_0", Bytes(500, 1)));
  EXPECT_FALSE(next());
  EXPECT_EQ(camera_->counts().undecodable, 2);
  offerer_->send_bytes(image_event(now_us(), 1));
  EXPECT_TRUE(next());
}

TEST_F(SocketCameraTest, WhatIsNoEventEndsTheStreamAndTheSocketIsSearchedAgain) {
  connect();
  offerer_->send_bytes(Bytes(100, 0x55));
  EXPECT_FALSE(next());
  EXPECT_FALSE(camera_->is_streaming());
  ASSERT_EQ(events_.size(), 2U);
  EXPECT_EQ(events_[1].kind, Kind::kLost);
  EXPECT_EQ(events_[1].error, EPROTO);
  offerer_->hang_up();
  for (int i = 0; i < 100 && !camera_->is_streaming(); ++i) EXPECT_FALSE(next());
  offerer_->accept_reader();
  offerer_->send_bytes(image_event(now_us(), 3));
  EXPECT_TRUE(next());
}

TEST_F(SocketCameraTest, AProcessThatEndsIsALostCamera) {
  connect();
  offerer_.reset();
  EXPECT_FALSE(next());
  EXPECT_FALSE(camera_->is_streaming());
  EXPECT_EQ(camera_->counts().lost, 1);
  unlink(options_.device.c_str());
  for (int i = 0; i < 20; ++i) EXPECT_FALSE(next(10));
  EXPECT_EQ(events_.back().kind, Kind::kAbsent);
}

TEST_F(SocketCameraTest, ALogsOwnTimesGiveWayToTheTimeOfArrival) {
  connect();
  const std::int64_t before = now_us();
  offerer_->send_bytes(image_event(1'000, 0));
  ASSERT_TRUE(next());
  EXPECT_GE(frame_.utime, before - 1'000);
  EXPECT_EQ(camera_->counts().times_unknown, 1);
}

TEST(SocketCameraNames, OnlyLocalSocketsAreNamed) {
  EXPECT_EQ(SocketCamera::check("/run/front.sock"), "");
  for (const std::string& name : {std::string("udpm://239.255.76.67:7667"), std::string("front.sock"),
                                  std::string(), "/" + std::string(200, 'a')})
    EXPECT_NE(SocketCamera::check(name).find("expected the path of a Unix socket"), std::string::npos)
        << name;
}

}  // namespace
}  // namespace farpoint::drivers

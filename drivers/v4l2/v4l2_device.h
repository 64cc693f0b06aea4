// SPDX-License-Identifier: Apache-2.0
// A camera by V4L2.
#pragma once

#include <memory>
#include <optional>

#include "drivers/camera/camera_device.h"
#include "drivers/camera/camera_path.h"
#include "drivers/v4l2/v4l2_controls.h"
#include "drivers/v4l2/v4l2_stream.h"

namespace farpoint::drivers {

class V4l2Device final : public CameraDevice {
 public:
  // `root`: see CameraPath.
  V4l2Device(const CameraOptions& options, std::unique_ptr<V4l2System> system, const std::string& root = "");
  ~V4l2Device() override;
  V4l2Device(const V4l2Device&) = delete;
  V4l2Device& operator=(const V4l2Device&) = delete;

  [[nodiscard]] CameraEvent open() override;
  void close() override;
  [[nodiscard]] int fd() const override { return node_.fd; }
  [[nodiscard]] int take(RawFrame* raw, const char** what) override;
  [[nodiscard]] int give_back(const char** what) override;
  void adapt_exposure(const ipc::GreyImage& image) override;
  void set_exposure(const ExposureOptions& options) override;

 private:
  [[nodiscard]] int set_up(const char** what);
  [[nodiscard]] RawFrame describe(const V4l2Buffer& buffer) const;
  [[nodiscard]] std::optional<StampPoint> stamp_point(std::uint32_t flags) const;

  CameraOptions options_;
  std::unique_ptr<V4l2System> system_;
  CameraPath path_;
  V4l2Node node_;
  AgreedFormat agreed_;
  std::optional<V4l2Stream> stream_;
  V4l2Buffer taken_;
  V4l2Exposure exposure_;
};

}  // namespace farpoint::drivers

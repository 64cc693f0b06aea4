// SPDX-License-Identifier: Apache-2.0
// Images of another process as a camera. The process listens on a Unix stream socket and writes what an LCM
// log holds: events (ipc/log.h) with image_t on the channel CAMERA_N. Other channels are passed over.
// Permissions of the socket decide who may offer images.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "drivers/camera/camera_device.h"
#include "ipc/image_codec.h"
#include "ipc/message.h"

namespace farpoint::drivers {

class SocketCamera final : public CameraDevice {
 public:
  // options.device: path of the socket; options.index: N of the channel CAMERA_N.
  explicit SocketCamera(const CameraOptions& options);
  ~SocketCamera() override { close(); }
  SocketCamera(const SocketCamera&) = delete;
  SocketCamera& operator=(const SocketCamera&) = delete;

  // Returns "" for a usable name, else the error and the expected form.
  [[nodiscard]] static std::string check(const std::string& name);

  [[nodiscard]] CameraEvent open() override;
  void close() override;
  [[nodiscard]] int fd() const override { return fd_; }
  // An image that cannot be decoded, or has another size, is given out without bytes: counted as undecodable.
  [[nodiscard]] int take(RawFrame* raw, const char** what) override;
  [[nodiscard]] int give_back(const char** /*what*/) override { return 0; }
  void adapt_exposure(const ipc::GreyImage& /*image*/) override {}
  void set_exposure(const ExposureOptions& /*options*/) override {}

 private:
  enum class Part : std::uint8_t { kHeader, kBody, kSkipped };

  [[nodiscard]] int receive(const char** what);
  [[nodiscard]] int take_header(const char** what);
  [[nodiscard]] bool is_image() const;
  void describe(RawFrame* raw);
  void expect(Part part, std::size_t bytes);

  CameraOptions options_;
  const std::string channel_;
  int fd_ = -1;
  // The part of an event that is being received. Nothing beyond it is read, so that the descriptor stays
  // readable while the socket holds more.
  Part part_ = Part::kHeader;
  std::size_t wanted_ = 0, received_ = 0, channel_bytes_ = 0;
  std::vector<std::uint8_t> buffer_;
  image_t message_{};
  ipc::ImageDecoder decoder_;
  ipc::GreyImage image_;
};

}  // namespace farpoint::drivers

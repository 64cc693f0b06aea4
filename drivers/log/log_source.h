// SPDX-License-Identifier: Apache-2.0
// Reads the measurements of a recorded LCM log, in the order of the file, checked, with counts of refused
// ones. An image whose time leaps waits until the next image confirms it (kMaxLeap_us). Not thread-safe;
// waits for the disk.
//
// A measurement's time is its message's utime; the log event's time is that of the recording.
#pragma once

#include <array>
#include <cstdint>
#include <limits>
#include <string>
#include <string_view>

#include "ipc/image_codec.h"
#include "ipc/log.h"
#include "ipc/message.h"

namespace farpoint::drivers {

struct LogSourceCounts {
  // Returned.
  std::uint64_t images = 0, imu = 0, wheels = 0, calibrations = 0, ground_truths = 0;
  // Refused.
  std::uint64_t messages_undecodable = 0;  // damaged LCM messages on known channels
  // No such camera in the calibration, or channel and message disagree.
  std::uint64_t images_unknown_camera = 0;
  std::uint64_t images_wrong_size = 0;   // differs from the calibration or from the message's own size
  std::uint64_t images_undecodable = 0;  // damaged JPEG or PNG, unknown pixel format
  // Not after the previous one, or a leap that the next image does not confirm.
  std::uint64_t times_backwards = 0;
  std::uint64_t imu_invalid = 0;            // not finite, or beyond any sensor's range
  std::uint64_t wheels_invalid = 0;         // infinite
  std::uint64_t ground_truths_invalid = 0;  // not finite, or no rotation
  // Skipped: other channels.
  std::uint64_t others = 0;
};

enum class LogItemKind : std::uint8_t { kImage, kImu, kWheels, kCalibration, kGroundTruth };

// One measurement. The pointer of its kind is set, the others are null. The source owns the target, which is
// valid until the next call.
struct LogItem {
  LogItemKind kind = LogItemKind::kImage;
  std::int64_t utime = 0;
  std::uint64_t offset = 0;        // of the event in the file, bytes
  int camera = -1;                 // of an image
  const image_t* image = nullptr;  // still compressed: see decode()
  const imu_t* imu = nullptr;
  const wheels_t* wheels = nullptr;
  const calibration_t* calibration = nullptr;
  const ground_truth_t* ground_truth = nullptr;
};

class LogSource {
 public:
  static constexpr int kMaxCameras = 8;
  // An IMU time further ahead than this is accepted only with its next message: one damaged time must not
  // make all later ones look old. An image that is late by half of the camera's period is held until the next
  // one confirms it; at the end of the log it is accepted up to this leap.
  static constexpr std::int64_t kMaxLeap_us = 2'000'000;

  static constexpr int kAllCameras = -1;

  // "-" is standard input. Images of more pixels, and events longer than any such image, are refused. With
  // `only_camera` images of other cameras come without their data. Throws std::runtime_error naming the log
  // where it cannot be opened.
  explicit LogSource(const std::string& path, std::int64_t most_pixels = ipc::kMaxImagePixels,
                     int only_camera = kAllCameras);

  // Returns the next measurement that passes the checks; false at the end. A held image follows the
  // measurements read meanwhile. From the first calibration on, images are checked against it.
  [[nodiscard]] bool next(LogItem* item);
  // Decodes an image item and counts a failure. Precondition: no next() since the item was returned.
  [[nodiscard]] ipc::ImageStatus decode(const LogItem& item, ipc::GreyImage* image);

  [[nodiscard]] const LogSourceCounts& counts() const { return counts_; }
  [[nodiscard]] const ipc::LogDamage& damage() const { return reader_.damage(); }
  [[nodiscard]] std::uint64_t events() const { return reader_.events(); }

 private:
  // Times of one stream.
  struct Stream {
    static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::min();
    std::int64_t last = kNone;      // returned last
    std::int64_t doubtful = kNone;  // leapt ahead, not confirmed yet
  };

  // Images of one camera.
  struct CameraStream {
    std::int64_t last = Stream::kNone;  // returned last
    std::int64_t pace_us = 0;           // between two images; 0: unknown yet
    bool holds = false;                 // held, not confirmed yet
    image_t held{};
    std::uint64_t held_offset = 0;
  };

  bool accept_time(std::int64_t utime, bool check_leap, Stream* stream);
  bool judge_image(int camera, std::uint64_t offset, LogItem* item);
  void give_image(image_t* image, int camera, std::uint64_t offset, LogItem* item);
  bool give_held_at_end(LogItem* item);
  void reserve_images();
  bool take(const ipc::LogEvent& event, LogItem* item);
  bool take_image(int camera, const ipc::LogEvent& event, LogItem* item);
  bool take_imu(const ipc::LogEvent& event, LogItem* item);
  bool take_wheels(const ipc::LogEvent& event, LogItem* item);
  bool take_calibration(const ipc::LogEvent& event, LogItem* item);
  bool take_ground_truth(const ipc::LogEvent& event, LogItem* item);
  template <typename Message>
  bool decode_message(const ipc::LogEvent& event, Message* message);

  // Swaps two images, or copies one without its data.
  void move_image(int camera, image_t* from, image_t* to) const;

  std::int64_t most_pixels_;
  int only_camera_;
  ipc::LogReader reader_;
  ipc::ImageDecoder decoder_;
  LogSourceCounts counts_;
  std::array<CameraStream, kMaxCameras> camera_streams_;
  int waiting_camera_ = -1;  // camera of image_, which follows the held image that it confirmed
  std::uint64_t waiting_offset_ = 0;
  Stream imu_stream_, wheels_stream_, ground_truth_stream_;
  bool has_calibration_ = false;
  // Reused from message to message.
  image_t image_{}, given_{};
  imu_t imu_{};
  wheels_t wheels_{};
  calibration_t calibration_{};
  ground_truth_t ground_truth_{};
};

}  // namespace farpoint::drivers

// A recorded LCM log as the source of measurements: in the order of the file, checked, with counts of what
// was refused. An image whose time leaps waits until the next one bears it out (kMaxLeap_us).
//
// A measurement's time is its message's utime; the log event's time is only when it was recorded.
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
  // Given out.
  std::uint64_t images = 0, imu = 0, wheels = 0, calibrations = 0, ground_truths = 0;
  // Refused.
  std::uint64_t messages_undecodable = 0;  // damaged LCM messages on known channels
  // The calibration has no such camera, or channel and message disagree.
  std::uint64_t images_unknown_camera = 0;
  std::uint64_t images_wrong_size = 0;   // not the calibration's, or not what the message itself says
  std::uint64_t images_undecodable = 0;  // damaged JPEG or PNG, unknown pixel format
  // Not after the one before it, or a leap ahead that what follows does not bear out.
  std::uint64_t times_backwards = 0;
  std::uint64_t imu_invalid = 0;            // not finite, or beyond any sensor's range
  std::uint64_t wheels_invalid = 0;         // infinite
  std::uint64_t ground_truths_invalid = 0;  // not finite, or no rotation
  // Passed over: other channels.
  std::uint64_t others = 0;
};

enum class LogItemKind : std::uint8_t { kImage, kImu, kWheels, kCalibration, kGroundTruth };

// One measurement. The pointer that its kind names is set, the others are null; what it points to is the
// source's and holds until its next call.
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
  // An IMU that leaps further ahead than this is believed only with its next message: one damaged time must
  // not make all that follow look old. An image is held back already where it comes late by half of the
  // camera's pace, until the next one bears it out or not; at the end of the log it is believed up to this
  // leap.
  static constexpr std::int64_t kMaxLeap_us = 2'000'000;

  // "-" is standard input. Throws std::runtime_error naming the log where it cannot be opened.
  explicit LogSource(const std::string& path) : reader_(path) {}

  // The next measurement that passes the checks, images that were held back behind what came between; false
  // at the end. From the first calibration on, images are held against it.
  [[nodiscard]] bool next(LogItem* item);
  // Decodes an image item; counts it where it fails. Precondition: next() has not been called since.
  [[nodiscard]] ipc::ImageStatus decode(const LogItem& item, ipc::GreyImage* image);

  [[nodiscard]] const LogSourceCounts& counts() const { return counts_; }
  [[nodiscard]] const ipc::LogDamage& damage() const { return reader_.damage(); }
  [[nodiscard]] std::uint64_t events() const { return reader_.events(); }

 private:
  // Times of one stream.
  struct Stream {
    static constexpr std::int64_t kNone = std::numeric_limits<std::int64_t>::min();
    std::int64_t last = kNone;      // given out last
    std::int64_t doubtful = kNone;  // leapt ahead, not yet borne out
  };

  // Images of one camera.
  struct CameraStream {
    std::int64_t last = Stream::kNone;  // given out last
    std::int64_t pace_us = 0;           // between two of them; 0: not known yet
    bool holds = false;                 // held, not yet borne out
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

  ipc::LogReader reader_;
  ipc::ImageDecoder decoder_;
  LogSourceCounts counts_;
  std::array<CameraStream, kMaxCameras> camera_streams_;
  int waiting_camera_ = -1;  // image_ is this camera's, and comes after the held one that it bore out
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

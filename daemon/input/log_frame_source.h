// A recorded log as a source of frames.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include "daemon/input/frame_source.h"
#include "daemon/input/measurement_feed.h"
#include "drivers/log/log_source.h"

namespace farpoint::daemon {

class LogFrameSource final : public FrameSource {
 public:
  // "-" is standard input. Throws InputError if the log cannot be opened.
  LogFrameSource(const std::string& path, int camera_index);

  // Throws InputError at the end of a log without any accepted image. The line names the cause: no
  // calibration, no such camera, nothing decodable.
  [[nodiscard]] bool next(SourceFrame* frame, StageClock* clock) override;
  // After the first image. From now on next() feeds the IMU and WHEELS messages that it reads on its way to
  // an image. Earlier ones are passed over: no frame precedes them. `feed` outlives its use.
  void feed_to(MeasurementFeed* feed) { feed_ = feed; }
  void swap_image(ipc::GreyImage* image) override { std::swap(*image, image_); }
  [[nodiscard]] const calibration_t& calibration() const override { return *calibration_; }
  [[nodiscard]] InputCounts counts() const override;
  [[nodiscard]] double progress() const override;

  [[nodiscard]] const ipc::LogDamage& damage() const { return source_.damage(); }
  // Later calibrations that differ from the first; the first holds.
  [[nodiscard]] int calibrations_ignored() const { return calibrations_ignored_; }
  // The last image of next().
  [[nodiscard]] const ipc::GreyImage& image() const { return image_; }
  // Name of the log in messages.
  [[nodiscard]] const std::string& name() const { return name_; }

 private:
  void take_calibration(const calibration_t& calibration);
  void feed(const drivers::LogItem& item);
  [[noreturn]] void refuse_empty() const;

  std::string name_;
  int camera_index_;
  drivers::LogSource source_;
  std::optional<calibration_t> calibration_;
  int calibrations_ignored_ = 0;
  std::int64_t before_calibration_ = 0, wrong_size_decoded_ = 0;
  bool gave_image_ = false;
  MeasurementFeed* feed_ = nullptr;
  ipc::GreyImage image_;
  double file_bytes_ = -1.0;
  std::uint64_t offset_ = 0;
};

}  // namespace farpoint::daemon

// SPDX-License-Identifier: Apache-2.0
// A recorded log as a source of frames.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <utility>

#include "daemon/config/config.h"
#include "daemon/input/frame_source.h"
#include "daemon/input/measurement_feed.h"
#include "daemon/input/waiting_images.h"
#include "drivers/log/log_source.h"

namespace farpoint::daemon {

class LogFrameSource final : public FrameSource {
 public:
  // "-" is standard input. Throws InputError if the log cannot be opened.
  LogFrameSource(const std::string& path, const Config& config);

  // Throws InputError at the end of a log without any accepted image. The line names the cause: no
  // calibration, no such camera, nothing decodable. Also throws InputError for a calibration whose images
  // need more memory than capacity.image_mb, before it allocates any.
  [[nodiscard]] bool next(SourceFrame* frame, StageClock* clock) override;
  // After the first image. Feeds the IMU and WHEELS messages read so far, and from now on those that next()
  // reads on its way to an image. Passes over messages not after the first image: no frame precedes them.
  // `feed` outlives its use.
  void feed_to(MeasurementFeed* feed);
  void swap_image(ipc::GreyImage* image) override { std::swap(*image, image_); }
  void swap_second(ipc::GreyImage* image) override { std::swap(*image, second_image_); }
  // Of the second camera's images; 0 without one.
  [[nodiscard]] std::size_t second_pixels() const;
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
  void take(const drivers::LogItem& item, StageClock* clock);
  void decode(const drivers::LogItem& item, StageClock* clock, WaitingImages* out);
  void forget_past_seconds();
  [[nodiscard]] bool may_give();
  // Precondition: may_give() was the last call and an image of the first camera waits.
  void give(SourceFrame* frame);
  void take_calibration(const calibration_t& calibration);
  void reserve_waiting();
  void feed(const drivers::LogItem& item);
  void say_undecodable(ipc::ImageStatus status);
  void keep_early(const drivers::LogItem& item);
  [[noreturn]] void refuse_empty() const;

  std::string name_;
  const Config config_;
  drivers::LogSource source_;
  std::optional<calibration_t> calibration_;
  int calibrations_ignored_ = 0;
  std::int64_t before_calibration_ = 0, wrong_size_decoded_ = 0;
  bool gave_image_ = false, said_undecodable_ = false;
  MeasurementFeed* feed_ = nullptr;
  // Read before feed_to(), the newest kEarly of each: the source may read beyond the first image before it
  // gives it.
  static constexpr std::size_t kEarly = 1024;
  std::deque<imu_t> early_imu_;
  std::deque<wheels_t> early_wheels_;
  std::int64_t given_utime_ = 0;  // of the last image of next()
  ipc::GreyImage image_;
  // With a second camera an image waits for its partner until a later one of that camera, or kAhead more of
  // its own have come: the log's reader holds a doubtful image for one period.
  static constexpr std::size_t kAhead = 2;
  std::optional<int> second_camera_;
  WaitingImages firsts_, seconds_;
  ipc::GreyImage second_image_, decoded_;
  bool ended_ = false;
  double file_bytes_ = -1.0;
  std::uint64_t offset_ = 0;
};

}  // namespace farpoint::daemon

// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/log_frame_source.h"

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include <algorithm>
#include <filesystem>
#include <utility>

#include "daemon/config/rig.h"

namespace farpoint::daemon {
namespace {

drivers::LogSource open_source(const std::string& path, const Config& config) {
  try {
    const bool all = config.camera.use == CameraUse::kAll;
    return drivers::LogSource(path, most_image_pixels(config),
                              all ? drivers::LogSource::kAllCameras : config.camera.index);
  } catch (const std::runtime_error& error) {
    const std::string what = error.what();
    const bool says = what.find("expected") != std::string::npos;
    throw InputError(what + (says ? "" : ", expected the name of an LCM log"));
  }
}

std::int64_t as_signed(std::uint64_t count) {
  return static_cast<std::int64_t>(count);
}

std::string damage_text(const ipc::LogDamage& damage) {
  if (damage.places == 0) return "";
  return fmt::format("; {}, first damage at byte {}",
                     damage.cut_off ? "the log is cut off" : "the log is damaged", damage.first_offset);
}

}  // namespace

LogFrameSource::LogFrameSource(const std::string& path, const Config& config)
    : name_(path == "-" ? "standard input" : path), config_(config), source_(open_source(path, config)) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(path, error);
  if (path != "-" && !error) file_bytes_ = static_cast<double>(bytes);
}

bool LogFrameSource::next(SourceFrame* frame, StageClock* clock) {
  drivers::LogItem item;
  while (!may_give() && !ended_) {
    ended_ = !source_.next(&item);
    if (!ended_) take(item, clock);
  }
  if (!firsts_.empty()) {
    give(frame);
    return true;
  }
  if (!source_.damage().read_error.empty()) {
    throw std::runtime_error(name_ + ": reading failed (" + source_.damage().read_error + ")");
  }
  if (!gave_image_) refuse_empty();
  return false;
}

void LogFrameSource::take(const drivers::LogItem& item, StageClock* clock) {
  offset_ = item.offset;
  if (item.kind == drivers::LogItemKind::kCalibration) take_calibration(*item.calibration);
  feed(item);
  if (item.kind != drivers::LogItemKind::kImage) return;
  if (item.camera == config_.camera.index) {
    if (calibration_)
      decode(item, clock, &firsts_);
    else
      ++before_calibration_;
  } else if (item.camera == second_camera_) {
    decode(item, clock, &seconds_);
  }
}

void LogFrameSource::decode(const drivers::LogItem& item, StageClock* clock, WaitingImages* out) {
  const StageScope scope(clock, timing_t::STAGE_DECODE);
  const ipc::ImageStatus status = source_.decode(item, &decoded_);
  if (status == ipc::ImageStatus::kWrongSize) ++wrong_size_decoded_;
  if (status != ipc::ImageStatus::kOk) return say_undecodable(status);
  out->push({item.utime, item.image->sequence, item.image->exposure_us, item.image->gain}, &decoded_);
}

// Precondition: an image of the first camera waits.
void LogFrameSource::forget_past_seconds() {
  const std::int64_t oldest = firsts_.front().utime - config_.camera.pair_tolerance_us;
  while (!seconds_.empty() && seconds_.front().utime < oldest) seconds_.drop();
}

bool LogFrameSource::may_give() {
  if (firsts_.empty()) return false;
  forget_past_seconds();
  return !second_camera_ || !seconds_.empty() || firsts_.size() > kAhead;
}

void LogFrameSource::give(SourceFrame* frame) {
  *frame = {firsts_.front(), &image_, nullptr};
  firsts_.pop(&image_);
  if (!seconds_.empty() && seconds_.front().utime <= frame->meta.utime + config_.camera.pair_tolerance_us) {
    seconds_.pop(&second_image_);
    frame->second = &second_image_;
  }
  gave_image_ = true;
  given_utime_ = frame->meta.utime;
}

std::size_t LogFrameSource::second_pixels() const {
  if (!second_camera_) return 0;
  const auto& camera = calibration_->cameras[static_cast<std::size_t>(*second_camera_)];
  return static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
}

void LogFrameSource::reserve_waiting() {
  const auto& camera = calibration_->cameras[static_cast<std::size_t>(config_.camera.index)];
  const std::size_t first = static_cast<std::size_t>(camera.width) * static_cast<std::size_t>(camera.height);
  const std::size_t pixels = std::max(first, second_pixels());  // buffers change places
  firsts_.reserve(pixels);
  seconds_.reserve(pixels);
  for (ipc::GreyImage* image : {&image_, &second_image_, &decoded_}) image->pixels.reserve(pixels);
}

// Once: the counts say how many follow.
void LogFrameSource::say_undecodable(ipc::ImageStatus status) {
  if (std::exchange(said_undecodable_, true)) return;
  spdlog::warn("{}: image at byte {} is left out ({}), expected one that can be decoded", name_, offset_,
               to_string(status));
}

void LogFrameSource::feed(const drivers::LogItem& item) {
  if (feed_ == nullptr) return keep_early(item);
  if (item.kind == drivers::LogItemKind::kImu) feed_->add(*item.imu);
  if (item.kind == drivers::LogItemKind::kWheels) feed_->add(*item.wheels);
}

void LogFrameSource::keep_early(const drivers::LogItem& item) {
  if (item.kind == drivers::LogItemKind::kImu) early_imu_.push_back(*item.imu);
  if (item.kind == drivers::LogItemKind::kWheels) early_wheels_.push_back(*item.wheels);
  if (early_imu_.size() > kEarly) early_imu_.pop_front();
  if (early_wheels_.size() > kEarly) early_wheels_.pop_front();
}

void LogFrameSource::feed_to(MeasurementFeed* feed) {
  feed_ = feed;
  for (const imu_t& m : early_imu_)
    if (m.utime > given_utime_) feed_->add(m);
  for (const wheels_t& m : early_wheels_)
    if (m.utime > given_utime_) feed_->add(m);
  early_imu_ = {};
  early_wheels_ = {};
}

void LogFrameSource::take_calibration(const calibration_t& calibration) {
  if (!calibration_) {
    try {
      check_image_size(calibration, config_);
    } catch (const InputError& error) {
      throw InputError(name_ + ": " + error.what());
    }
    calibration_ = calibration;
    second_camera_ = second_camera(calibration, config_.camera);
    if (second_camera_) reserve_waiting();
    return;
  }
  if (calibration_hash(calibration) == calibration_hash(*calibration_)) return;
  if (calibrations_ignored_++ == 0) {
    spdlog::warn(
        "{}: another CALIBRATION at byte {} is ignored, expected the first to hold for the whole log", name_,
        offset_);
  }
}

void LogFrameSource::refuse_empty() const {
  const drivers::LogSourceCounts& c = source_.counts();
  const std::string damage = damage_text(source_.damage());
  if (source_.events() == 0) throw InputError(name_ + ": no LCM event, expected an LCM log" + damage);
  if (!calibration_) {
    throw InputError(fmt::format("{}: no CALIBRATION message in {} events, expected one before the images{}",
                                 name_, source_.events(), damage));
  }
  throw InputError(
      fmt::format("{}: no usable image of CAMERA_{} in {} events, expected images (other cameras {}, before "
                  "the calibration {}, "
                  "wrong size {}, undecodable {}, unknown camera {}, time not after the one before {}){}",
                  name_, config_.camera.index, source_.events(), as_signed(c.images) - before_calibration_,
                  before_calibration_, c.images_wrong_size, c.images_undecodable + c.messages_undecodable,
                  c.images_unknown_camera, c.times_backwards, damage));
}

InputCounts LogFrameSource::counts() const {
  const drivers::LogSourceCounts& c = source_.counts();
  InputCounts counts;
  // What is found out by decoding had been counted as an image before.
  counts.images = as_signed(c.images + c.images_wrong_size + c.images_unknown_camera) - wrong_size_decoded_;
  counts.wrong_size = as_signed(c.images_wrong_size);
  counts.undecodable = as_signed(c.images_undecodable);
  counts.unknown_camera = as_signed(c.images_unknown_camera) + before_calibration_;
  counts.times_backwards = as_signed(c.times_backwards);
  counts.messages_undecodable = as_signed(c.messages_undecodable);
  counts.imu_invalid = as_signed(c.imu_invalid);
  counts.wheels_invalid =
      as_signed(c.wheels_invalid) + (feed_ != nullptr ? feed_->wheels_without_value() : 0);
  counts.log_damages = as_signed(source_.damage().places);
  return counts;
}

double LogFrameSource::progress() const {
  return file_bytes_ > 0.0 ? static_cast<double>(offset_) / file_bytes_ : -1.0;
}

}  // namespace farpoint::daemon

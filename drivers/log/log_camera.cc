// SPDX-License-Identifier: Apache-2.0
#include "drivers/log/log_camera.h"

#include <sys/timerfd.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <stdexcept>

#include "drivers/camera/camera_time.h"

namespace farpoint::drivers {
namespace {

constexpr std::int64_t kMicros = 1'000'000;
constexpr std::int64_t kUnknownPeriod_us = 100'000;

std::int64_t now_us() {
  return read_clocks().monotonic_us;
}

}  // namespace

// --- coming and going

CameraEvent LogCamera::open() {
  using Kind = CameraEvent::Kind;
  if (!next_ && !begin_again()) return {Kind::kAbsent, "its log cannot be opened", ENOENT};
  if (!next_ && !read_next())
    return {Kind::kRefused, "its log holds no image of the calibration's size on the camera's channel",
            EINVAL};
  timer_fd_ = timerfd_create(CLOCK_MONOTONIC, TFD_NONBLOCK | TFD_CLOEXEC);
  if (timer_fd_ < 0) return {Kind::kRefused, "no timer can be made", errno};
  // The image that is next is due now, and the others follow it.
  const std::int64_t shift_us = now_us() - next_->due_us;
  next_->due_us += shift_us;
  last_due_us_ += shift_us;
  if (loop_offset_us_) *loop_offset_us_ += shift_us;
  arm();
  return {Kind::kStreaming, "", 0, CameraFormat::kGrey, 0.0, next_->exposure_us >= 0};
}

void LogCamera::close() {
  if (timer_fd_ >= 0) ::close(timer_fd_);
  timer_fd_ = -1;
}

void LogCamera::arm() const {
  itimerspec when{};
  when.it_value.tv_sec = next_->due_us / kMicros;
  when.it_value.tv_nsec = next_->due_us % kMicros * 1000 + 1;  // 0 would disarm it
  (void)timerfd_settime(timer_fd_, TFD_TIMER_ABSTIME, &when, nullptr);
}

// --- frames

int LogCamera::take(RawFrame* raw, const char** what) {
  *what = "its log has ended";
  if (!next_) return -EIO;
  if (now_us() < next_->due_us) return -EAGAIN;
  raw->bytes = image_.pixels;
  raw->format = CameraFormat::kGrey;
  raw->row_stride = image_.width_px;
  raw->damaged = false;
  raw->sequence = sequence_;
  raw->stamp_us = next_->due_us;
  raw->stamp_point.reset();
  raw->exposure_us = next_->exposure_us;
  raw->gain = next_->gain;
  return 0;
}

int LogCamera::give_back(const char** what) {
  *what = "its log cannot be read again";
  if (!read_next()) return -EIO;
  arm();
  return 0;
}

bool LogCamera::read_next() {
  const bool began = !next_.has_value();
  next_.reset();
  LogItem item;
  int ends = began ? 1 : 0;  // of the log; a whole one without an image is not read in a circle
  for (;;) {
    if (!read_item(&item)) {
      if (++ends > 1 || !begin_again()) return false;
      continue;
    }
    const std::int64_t due = due_us(item.utime);
    ++sequence_;
    const std::int64_t latest_us = now_us() - options_.buffers * std::max<std::int64_t>(period_us_, 1);
    if (ends == 0 && due < latest_us) continue;
    if (source_->decode(item, &image_) != ipc::ImageStatus::kOk) continue;
    if (image_.width_px != options_.width_px || image_.height_px != options_.height_px) continue;
    next_ = {due, item.image->exposure_us, item.image->gain};
    return true;
  }
}

bool LogCamera::read_item(LogItem* item) {
  while (source_->next(item))
    if (item->kind == LogItemKind::kImage && item->camera == options_.index) return true;
  return false;
}

bool LogCamera::begin_again() {
  log_utime_.reset();
  loop_offset_us_.reset();
  try {
    source_.emplace(options_.device, std::int64_t{options_.width_px} * options_.height_px, options_.index);
  } catch (const std::runtime_error&) {
    source_.reset();
  }
  return source_.has_value();
}

// A loop's first image follows the last one after a period.
std::int64_t LogCamera::due_us(std::int64_t utime) {
  if (log_utime_) period_us_ = utime - *log_utime_;
  log_utime_ = utime;
  if (!loop_offset_us_) {
    const std::int64_t period_us = period_us_ > 0 ? period_us_ : kUnknownPeriod_us;
    loop_offset_us_ = (last_due_us_ > 0 ? last_due_us_ + period_us : now_us()) - utime;
  }
  last_due_us_ = utime + *loop_offset_us_;
  return last_due_us_;
}

}  // namespace farpoint::drivers

// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/frame_intake.h"

#include <bit>

#include "drivers/camera/pixel_conversion.h"

namespace farpoint::drivers {

bool FrameIntake::take(const RawFrame& raw, const ClockReadings& now, ipc::GreyImage* image,
                       CameraFrame* frame) {
  count_sequence(raw.sequence);
  if (raw.damaged) {
    ++counts.flagged;
    return false;
  }
  const std::int64_t utime = time_of(raw, now);
  judge_stamps(utime);
  if (utime <= last_utime_) {
    ++counts.times_backwards;
    return false;
  }
  if (!to_grey(raw, image)) {
    ++counts.undecodable;
    return false;
  }
  last_utime_ = utime;
  ++counts.frames;
  frame->utime = utime;
  frame->sequence = sequence_;
  frame->exposure_us = static_cast<std::int32_t>(raw.exposure_us);
  frame->gain = raw.gain;
  return true;
}

void FrameIntake::count_sequence(std::uint32_t sequence) {
  constexpr std::uint32_t kLargestGap = 1000;  // more is a driver that counts otherwise
  std::uint32_t step = last_driver_sequence_ ? sequence - *last_driver_sequence_ : 1;
  if (step == 0 || step > kLargestGap) step = 1;
  counts.missing += step - 1;
  sequence_ += step;
  last_driver_sequence_ = sequence;
}

// A repeated time is no sign of bad stamps: a driver may return one image twice.
void FrameIntake::judge_stamps(std::int64_t utime) {
  backwards_ = backwards_ << 1 | (utime < last_utime_ ? 1U : 0U);
  if (std::popcount(backwards_) >= kBackwards) distrusts_stamps_ = true;
}

std::int64_t FrameIntake::time_of(const RawFrame& raw, const ClockReadings& now) {
  const SourceClock clock = distrusts_stamps_ ? SourceClock::kUnknown : detect_clock(raw.stamp_us, now);
  if (clock == SourceClock::kUnknown) {
    ++counts.times_unknown;
    return now.monotonic_us + options_.time_offset_us +
           mid_exposure_shift_us(StampPoint::kEndOfFrame, raw.exposure_us, options_.readout_s);
  }
  const std::int64_t stamp_us = to_monotonic(raw.stamp_us, clock, now) + options_.time_offset_us;
  if (!raw.stamp_point) return stamp_us;
  return stamp_us + mid_exposure_shift_us(*raw.stamp_point, raw.exposure_us, options_.readout_s);
}

bool FrameIntake::to_grey(const RawFrame& raw, ipc::GreyImage* image) {
  const PixelLayout layout{options_.width_px, options_.height_px, raw.row_stride};
  switch (raw.format) {
    case CameraFormat::kGrey:
    case CameraFormat::kNv12:
      return grey_rows_to_grey(raw.bytes, layout, image);
    case CameraFormat::kYuyv:
      return yuyv_to_grey(raw.bytes, layout, image);
    case CameraFormat::kRgb24:
      return rgb24_to_grey(raw.bytes, layout, image);
    case CameraFormat::kMjpeg:
      return decoder_.decode_jpeg(raw.bytes, options_.width_px, options_.height_px, image) ==
             ipc::ImageStatus::kOk;
    case CameraFormat::kAuto:
      break;
  }
  return false;
}

}  // namespace farpoint::drivers

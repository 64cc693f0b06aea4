// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/camera_reports.h"

namespace farpoint::daemon {

void CameraReports::put(const std::optional<drivers::CameraFrame>& frame, bool is_streaming,
                        const drivers::CameraCounts& counts) {
  if (!frame && is_streaming == reported_streaming_ && unreported_ == reported_unreported_) return;
  CameraReport* report = ring_.begin_push();
  if (report == nullptr) {
    if (frame) ++unreported_;
    return;
  }
  *report = {frame, is_streaming, counts, unreported_};
  reported_streaming_ = is_streaming;
  reported_unreported_ = unreported_;
  ring_.end_push();
}

bool CameraReports::take(CameraReport* report) {
  const CameraReport* oldest = ring_.front();
  if (oldest == nullptr) return false;
  *report = *oldest;
  ring_.pop();
  return true;
}

}  // namespace farpoint::daemon

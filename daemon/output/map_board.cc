// SPDX-License-Identifier: Apache-2.0
#include "daemon/output/map_board.h"

#include "daemon/output/messages.h"
#include "daemon/output/rate.h"

namespace farpoint::daemon {

namespace {

// To the body's first place from the camera's, which is at `lever`; map units.
void move_origin(const Eigen::Vector3d& lever, MapContent* content) {
  for (slam::LandmarkInfo& landmark : content->landmarks) landmark.position_map += lever;
  for (slam::SE3& T : content->keyframes) T.t += lever - T.q * lever;
}

}  // namespace

MapBoard::MapBoard(const Config& config)
    : rate_hz_(config.lcm.map_rate_hz),
      assumed_scale_(config.scale.assumed),
      points_(config.lcm.map_points),
      next_utime_(kAtOnce),
      sheets_(kSheets) {}

void MapBoard::note(const slam::Inspection& inspection, const slam::MappingNote& note) {
  if (!note.full || !due(note.utime, rate_hz_, &next_utime_)) return;
  Sheet* sheet = sheets_.begin_push();
  if (sheet == nullptr) return;  // the output is far behind: this map is skipped
  slam::FrameResult result;
  result.utime = note.utime;
  result.map_id = note.map_id;
  const std::int32_t assumed_map = assumed_map_.load(std::memory_order_relaxed);
  const bool is_assumed = assumed_map < 0 || assumed_map == note.map_id;
  const FrameOutput frame = make_frame_output(result, is_assumed ? assumed_scale_ : 0.0);
  const double unit_scale = frame.result.scale == slam::ScaleState::kAssumed ? assumed_scale_ : 1.0;
  MapContent content{inspection.landmarks(), inspection.keyframe_poses()};
  if (frame.result.scale == slam::ScaleState::kAssumed) move_origin(lever_m_ / unit_scale, &content);
  ipc::encode(make_map(frame, content, points_, unit_scale), &sheet->bytes);
  sheet->reply = note.reply;
  sheet->utime = note.utime;
  sheets_.end_push();
}

void MapBoard::publish_known(std::uint64_t replies_taken, Publisher* publisher) {
  while (const Sheet* sheet = sheets_.front()) {
    if (sheet->reply > replies_taken) return;
    publisher->publish_encoded(ipc::kMapChannel, sheet->utime, sheet->bytes);
    sheets_.pop();
  }
}

}  // namespace farpoint::daemon

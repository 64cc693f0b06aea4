// SPDX-License-Identifier: Apache-2.0
// The way back after lost frames: when a frame is searched for instead of tracked, when a place found again
// is trusted, when the map is given up.
//
// tracking -> lost -> relocalising -> candidate -> tracking, or -> a new map. A candidate is a pose that
// relocalisation found; the next frame confirms it, or it is dropped.
#pragma once

#include <cstdint>
#include <limits>
#include <optional>

#include "slam/frame_result.h"
#include "slam/mapping_rings.h"

namespace farpoint::slam {

class Recovery {
 public:
  enum class Search : std::uint8_t {
    kTrack,       // from the last frame
    kConfirm,     // from the candidate: track, and drop the candidate where the match contradicts it
    kRelocalise,  // by descriptors
  };
  enum class Verdict : std::uint8_t { kSearchOn, kDiscardMap, kRetireMap };

  // How the frame at `utime` is looked for, `state` being that of the frame before.
  [[nodiscard]] Search search(State state, std::int64_t utime) const;

  // A frame that showed something: its time teaches the camera's pace.
  void note_seen(std::int64_t utime);
  // A frame has an accepted pose.
  void note_tracked() { lost_frames_ = 0; }
  // The present map has settled: its unit has held once. It is kept when it is lost, whatever comes after.
  void note_settled() { ever_settled_ = true; }
  [[nodiscard]] bool ever_settled() const { return ever_settled_; }
  // A frame was searched in vain.
  [[nodiscard]] Verdict note_lost(std::int64_t utime);
  // After note_lost(): lost at the first such frame, relocalising from the second on.
  [[nodiscard]] State state() const { return lost_frames_ == 1 ? State::kLost : State::kRelocalising; }

  void set_candidate(const RecordedFrame& candidate) { candidate_ = candidate; }
  // Hands it out once: it lasts for one frame.
  [[nodiscard]] std::optional<RecordedFrame> take_candidate();

  // A new map begins: nothing is lost.
  void begin_map();

 private:
  [[nodiscard]] bool after_gap(std::int64_t utime) const;

  bool ever_settled_ = false;  // the present map
  int lost_frames_ = 0;        // searched in vain, one after another
  std::int64_t lost_since_utime_ = 0;
  std::optional<RecordedFrame> candidate_;
  // Of frames that showed something.
  static constexpr std::int64_t kNever = std::numeric_limits<std::int64_t>::min();
  std::int64_t seen_utime_ = kNever, interval_us_ = 0;
};

// Neither tracked nor on the way into a first map.
[[nodiscard]] inline bool is_lost(State state) {
  return state == State::kLost || state == State::kRelocalising;
}

}  // namespace farpoint::slam

// SPDX-License-Identifier: Apache-2.0
// Streams a simulation in real time: each measurement goes out at its due time.
//
// Moment t of the simulation is due at start + t / pace, of CLOCK_MONOTONIC. The due time, not the time of
// sending, is the stamp of an image and the utime of a message. Images are rendered ahead. If the renderer
// does not keep the pace, measurements go out late, in order, as soon as possible.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "tools/simulate/render/frames_ahead.h"
#include "tools/simulate/simulation.h"
#include "tools/simulate/stream/stream_sinks.h"

namespace farpoint::tools::simulate {

class PaceClock {
 public:
  virtual ~PaceClock() = default;
  [[nodiscard]] virtual std::int64_t now_us() = 0;
  virtual void sleep_until(std::int64_t due_us) = 0;
};

class MonotonicClock final : public PaceClock {
 public:
  [[nodiscard]] std::int64_t now_us() override;
  void sleep_until(std::int64_t due_us) override;  // or a signal
};

// An image is late above this delay, which a busy machine reaches only under overload.
constexpr std::int64_t kLate_us = 2000;

struct StreamOptions {
  double pace = 1.0;                                  // seconds of the simulation a second
  std::function<bool()> stop = [] { return false; };  // asked a few times a second at least
  std::function<void(std::int64_t start_us)> started = [](std::int64_t) {};  // when moment 0 will be due
  std::function<void(std::int64_t frames)> progress = [](std::int64_t) {};
};

struct StreamResult {
  std::int64_t frames = 0, late = 0;  // went out; of them late
  std::int64_t latest_us = 0;         // the one that was latest
  double reached = 1.0;               // share of the pace, up to the last image
};

using StreamSinks = std::vector<std::unique_ptr<StreamSink>>;

// Streams all frames of the simulation, or until a stop. An exception of a sink ends it.
StreamResult stream(const Simulation& simulation, FrameSource* frames, const StreamSinks& sinks,
                    PaceClock* clock, const StreamOptions& options);

// The images of a simulation as they are rendered; takes them from it in order.
[[nodiscard]] FramesAhead::Render renderer_of(Simulation* simulation);

}  // namespace farpoint::tools::simulate

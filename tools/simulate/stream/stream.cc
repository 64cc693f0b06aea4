// SPDX-License-Identifier: Apache-2.0
#include "tools/simulate/stream/stream.h"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "tools/common/errors.h"
#include "tools/simulate/sensors/measurements.h"

namespace farpoint::tools::simulate {
namespace {

constexpr std::int64_t kSecond_us = 1'000'000;
// From when all is ready to the first image.
constexpr std::int64_t kLead_us = 100'000;
// Interval of the check for a stop while nothing is due.
constexpr std::int64_t kSlice_us = 100'000;
// Interval of tries while the device holds all of its buffers, and the number of image periods (a second at
// least) after which it is given up: it may return buffers at the images' rate.
constexpr std::int64_t kRetry_us = 1000;
constexpr double kPatience_periods = 3.0;

class Streamer {
 public:
  Streamer(const Simulation& simulation, FrameSource* frames, const StreamSinks& sinks, PaceClock* clock,
           const StreamOptions& options)
      : simulation_(simulation),
        frames_(*frames),
        sinks_(sinks),
        clock_(*clock),
        options_(options),
        motion_(simulation),
        calibration_(calibration_of(simulation)),
        patience_us_(std::max(kSecond_us, std::lround(kPatience_periods * 1e6 / options.pace /
                                                      simulation.description().camera.rate_hz))) {}

  StreamResult run() {
    while (!options_.stop() && !frames_.is_ahead()) continue;
    start_us_ = clock_.now_us() + kLead_us;
    housekeeping_us_ = start_us_;
    if (!options_.stop()) options_.started(start_us_);
    for (std::int64_t frame = 0; frame < simulation_.frames(); ++frame) {
      if (!send_motion(simulation_.frame_time_s(frame)) || !send_frame(frame)) break;
      options_.progress(++result_.frames);
    }
    for (const auto& sink : sinks_) sink->close();
    return result_;
  }

 private:
  [[nodiscard]] std::int64_t due_us(double time_s) const {
    return start_us_ + std::llround(1e6 * time_s / options_.pace);
  }

  // False where it is to stop.
  [[nodiscard]] bool wait_until(std::int64_t due_us) {
    while (!options_.stop()) {
      const std::int64_t now_us = clock_.now_us();
      if (now_us >= due_us) return true;
      clock_.sleep_until(std::min(due_us, now_us + kSlice_us));
    }
    return false;
  }

  [[nodiscard]] bool send_motion(double until_s) {
    while (std::optional<MotionSample> sample = motion_.next(until_s)) {
      const std::int64_t due = due_us(sample->time_s);
      if (!wait_until(due)) return false;
      keep_house(due);
      std::visit([due](auto& message) { message.utime = due; }, sample->message);
      for (const auto& sink : sinks_) {
        if (const auto* imu = std::get_if<imu_t>(&sample->message)) sink->take_imu(*imu);
        if (const auto* wheels = std::get_if<wheels_t>(&sample->message)) sink->take_wheels(*wheels);
      }
    }
    return true;
  }

  [[nodiscard]] bool send_frame(std::int64_t frame) {
    const std::int64_t due = due_us(simulation_.frame_time_s(frame));
    FrameImages images;
    while (!frames_.next(&images))
      if (options_.stop()) return false;
    if (!wait_until(due)) return false;
    keep_house(due);
    for (image_t& image : images) {
      image.utime = due;
      for (const auto& sink : sinks_) send_image(image, sink.get());
    }
    note_time(due, clock_.now_us());
    ground_truth_t truth = truth_of(simulation_, frame);
    truth.utime = due;
    for (const auto& sink : sinks_) sink->take_truth(truth);
    return true;
  }

  void send_image(const image_t& image, StreamSink* sink) {
    const std::int64_t since_us = clock_.now_us();
    while (!sink->take_image(image)) {
      const std::int64_t now_us = clock_.now_us();
      if (now_us - since_us > patience_us_)
        throw RunError(sink->name() + ": has held all of its buffers for " +
                       std::to_string(patience_us_ / kSecond_us) + " s, expected it to give one back");
      clock_.sleep_until(now_us + kRetry_us);
    }
  }

  void note_time(std::int64_t due_us, std::int64_t sent_us) {
    const std::int64_t late_us = sent_us - due_us;
    if (late_us > kLate_us) ++result_.late;
    result_.latest_us = std::max(result_.latest_us, late_us);
    const auto should_us = static_cast<double>(due_us - start_us_),
               took_us = static_cast<double>(sent_us - start_us_);
    if (due_us > start_us_) result_.reached = std::min(1.0, should_us / took_us);
  }

  // For those who begin to listen later, and interfaces that went away.
  void keep_house(std::int64_t now_us) {
    if (now_us < housekeeping_us_) return;
    housekeeping_us_ = now_us + kSecond_us;
    calibration_.utime = now_us;
    for (const auto& sink : sinks_) {
      sink->take_calibration(calibration_);
      sink->maintain();
    }
  }

  const Simulation& simulation_;
  FrameSource& frames_;
  const StreamSinks& sinks_;
  PaceClock& clock_;
  const StreamOptions& options_;
  MotionMeasurements motion_;
  calibration_t calibration_;
  std::int64_t patience_us_;
  std::int64_t start_us_ = 0, housekeeping_us_ = 0;
  StreamResult result_;
};

}  // namespace

std::int64_t MonotonicClock::now_us() {
  timespec t{};
  clock_gettime(CLOCK_MONOTONIC, &t);
  return std::int64_t{t.tv_sec} * kSecond_us + t.tv_nsec / 1000;
}

void MonotonicClock::sleep_until(std::int64_t due_us) {
  timespec t{};
  t.tv_sec = static_cast<time_t>(due_us / kSecond_us);
  t.tv_nsec = static_cast<long>(due_us % kSecond_us) * 1000;
  (void)clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, nullptr);
}

StreamResult stream(const Simulation& simulation, FrameSource* frames, const StreamSinks& sinks,
                    PaceClock* clock, const StreamOptions& options) {
  return Streamer(simulation, frames, sinks, clock, options).run();
}

FramesAhead::Render renderer_of(Simulation* simulation) {
  return [simulation, image = SimulatedImage{}](std::int64_t frame) mutable {
    FrameImages images;
    for (int camera = 0; camera < simulation->cameras(); ++camera) {
      simulation->take_image(frame, camera, &image);
      images.push_back(grey_message(*simulation, frame, camera, image));
    }
    return images;
  };
}

}  // namespace farpoint::tools::simulate

// SPDX-License-Identifier: Apache-2.0
// Sets exposure and gain of a V4L2 camera by the controls that it has. Capture thread; control calls of a
// running stream are made by a ControlWriter, so that no image waits for them.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <span>

#include "drivers/camera/auto_exposure.h"
#include "drivers/v4l2/v4l2_system.h"

namespace farpoint::drivers {

// The controls of one camera, their ranges and present values.
struct V4l2ExposureState {
  bool has_gain = false;
  ExposureRange range;
  ExposureSetting applied;
  std::optional<AutoExposure> automatic;
  std::optional<double> exposure_us;
  std::optional<int> gain;
};

// Queries the camera's ranges and applies options. Blocks for the camera's answers.
class V4l2ExposureSetUp final : public ControlJob {
 public:
  void prepare(V4l2System* system, int fd, const ExposureOptions& options);
  void run() override;
  [[nodiscard]] const V4l2ExposureState& state() const { return state_; }

 private:
  [[nodiscard]] bool query(std::uint32_t id, std::int64_t* min, std::int64_t* max);
  bool set(std::uint32_t id, std::int64_t value);
  [[nodiscard]] std::optional<std::int64_t> get(std::uint32_t id);
  void leave_to_camera();
  [[nodiscard]] bool take_manual_control();
  void apply(const ExposureSetting& setting);

  V4l2System* system_ = nullptr;
  int fd_ = -1;
  ExposureOptions options_;
  V4l2ExposureState state_;
};

// Applies one setting.
class V4l2ExposureWrite final : public ControlJob {
 public:
  // The range and the gain are those of `state`.
  void prepare(V4l2System* system, int fd, const V4l2ExposureState& state, const ExposureSetting& setting);
  void run() override;
  // Enters in `state` what the camera accepted.
  void note(V4l2ExposureState* state) const;

 private:
  struct Control {
    std::uint32_t id = 0;
    std::int32_t value = 0;
    bool taken = false;  // accepted by the camera
  };
  V4l2System* system_ = nullptr;
  int fd_ = -1;
  std::array<Control, 2> controls_;
  std::size_t count_ = 0;
};

class V4l2Exposure {
 public:
  V4l2Exposure() = default;
  V4l2Exposure(const V4l2Exposure&) = delete;  // a running job refers to it
  V4l2Exposure& operator=(const V4l2Exposure&) = delete;

  // Before the stream starts: queries the camera's ranges and applies the options. May block.
  void start(V4l2System* system, int fd, const ExposureOptions& options);
  // While it streams: the same without waiting. The exposure counts as unknown until the camera has followed.
  void restart(const ExposureOptions& options);
  // Call after each image: takes over what the camera has accepted. Does not wait.
  void poll();
  // Call after poll(): runs the automatic exposure for the next images. Does not wait for the camera, which
  // may follow some images later.
  void update(double mean_grey);

  // Of the next images; empty where the camera does not report it.
  [[nodiscard]] std::optional<double> exposure_us() const { return state_.exposure_us; }
  [[nodiscard]] std::optional<int> gain() const { return state_.gain; }
  [[nodiscard]] bool needs_brightness() const {
    return running_ == Running::kNone && !wanted_ && state_.automatic;
  }

 private:
  enum class Running : std::uint8_t { kNone, kWrite, kSetUp };
  void begin_set_up();

  V4l2System* system_ = nullptr;
  int fd_ = -1;
  Running running_ = Running::kNone;
  std::optional<ExposureOptions> wanted_;  // restart() that waits for the running job
  V4l2ExposureState state_;
  V4l2ExposureSetUp set_up_;
  V4l2ExposureWrite write_;
};

}  // namespace farpoint::drivers

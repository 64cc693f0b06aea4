// SPDX-License-Identifier: Apache-2.0
// Sets a camera's controls on a thread of its own (fp-controls). A control call may block for a USB transfer
// and its answer; the capture thread must not wait for it.
#pragma once

#include <pthread.h>

#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <span>

namespace farpoint::drivers {

struct ControlValue {
  std::uint32_t id = 0;
  std::int32_t value = 0;
  bool taken = false;  // accepted by the camera
};

class ControlWriter {
 public:
  static constexpr std::size_t kMost = 2;  // controls in one start()
  // Sets one control; false where the camera refuses it. Runs on the writer's thread and may block.
  using Set = std::function<bool(int fd, const ControlValue& control)>;

  // Throws std::runtime_error where no thread can be created.
  explicit ControlWriter(Set set);
  // Waits for the running call.
  ~ControlWriter();
  ControlWriter(const ControlWriter&) = delete;
  ControlWriter& operator=(const ControlWriter&) = delete;

  // One thread makes all calls below. start() and finished() do not wait.
  // Starts setting the controls. Returns false without effect while earlier ones run, or until finished() has
  // returned them.
  [[nodiscard]] bool start(int fd, std::span<const ControlValue> controls);
  // Returns the controls of start() once when they are done, each taken or not. Empty otherwise.
  [[nodiscard]] std::span<const ControlValue> finished();
  // Waits until no call runs and drops its result. Call it before the descriptor is closed.
  void wait();

 private:
  enum class State : int { kIdle, kWanted, kOver, kEnd };

  static void* enter(void* self);
  void run();

  Set set_;
  int fd_ = -1;
  std::array<ControlValue, kMost> controls_;
  std::size_t count_ = 0;
  std::atomic<State> state_{State::kIdle};  // the writer's thread owns controls_ while kWanted
  pthread_t thread_{};
};

}  // namespace farpoint::drivers

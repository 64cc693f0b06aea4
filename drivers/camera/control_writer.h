// Sets a camera's controls on a thread of its own: a camera takes as long as it likes over it (over USB, a
// transfer and its answer), and the capture thread is not to wait for that.
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
  bool taken = false;  // by the camera
};

class ControlWriter {
 public:
  static constexpr std::size_t kMost = 2;  // controls at a time
  // Sets one control; false where the camera does not take it. Called on the writer's thread, may block.
  using Set = std::function<bool(int fd, const ControlValue& control)>;

  // Throws std::runtime_error where no thread can be had.
  explicit ControlWriter(Set set);
  // Waits for the call under way.
  ~ControlWriter();
  ControlWriter(const ControlWriter&) = delete;
  ControlWriter& operator=(const ControlWriter&) = delete;

  // All of one thread. Neither of the next two waits.
  // False, with nothing done, while the ones before are under way, or were not asked for by finished().
  [[nodiscard]] bool start(int fd, std::span<const ControlValue> controls);
  // Once for each start(), when it is over: the same controls, each taken or not. Else empty.
  [[nodiscard]] std::span<const ControlValue> finished();
  // Until nothing is under way; forgets what came of it. Before the descriptor is closed.
  void wait();

 private:
  enum class State : int { kIdle, kWanted, kOver, kEnd };

  static void* enter(void* self);
  void run();

  Set set_;
  int fd_ = -1;
  std::array<ControlValue, kMost> controls_;
  std::size_t count_ = 0;
  std::atomic<State> state_{State::kIdle};  // whose turn it is: the thread's while kWanted
  pthread_t thread_{};
};

}  // namespace farpoint::drivers

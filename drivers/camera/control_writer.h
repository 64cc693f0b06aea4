// SPDX-License-Identifier: Apache-2.0
// Runs a camera's control calls on a thread of its own (fp-controls). A control call may block for a USB
// transfer and its answer; the capture thread must not wait for it.
#pragma once

#include <pthread.h>

#include <atomic>

namespace farpoint::drivers {

// Control calls that belong together. Owned by the caller, which leaves it alone while it runs.
class ControlJob {
 public:
  virtual ~ControlJob() = default;
  // Writer's thread; may block.
  virtual void run() = 0;
};

class ControlWriter {
 public:
  // Throws std::runtime_error where no thread can be created.
  ControlWriter();
  // Waits for the running job.
  ~ControlWriter();
  ControlWriter(const ControlWriter&) = delete;
  ControlWriter& operator=(const ControlWriter&) = delete;

  // One thread makes all calls below. start() and finished() do not wait.
  // Starts the job. Returns false without effect while an earlier one runs, or until finished() has reported
  // it.
  [[nodiscard]] bool start(ControlJob* job);
  // Returns true once after a job's end; its results may then be read.
  [[nodiscard]] bool finished();
  // Waits until no job runs and drops the report. Call it before the descriptor is closed.
  void wait();

 private:
  enum class State : int { kIdle, kWanted, kOver, kEnd };

  static void* enter(void* self);
  void run();

  ControlJob* job_ = nullptr;
  std::atomic<State> state_{State::kIdle};  // the writer's thread owns *job_ while kWanted
  pthread_t thread_{};
};

}  // namespace farpoint::drivers

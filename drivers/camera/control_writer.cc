// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/control_writer.h"

#include <cstring>
#include <stdexcept>
#include <string>

namespace farpoint::drivers {

ControlWriter::ControlWriter() {
  // Locked memory means all of it; the program's thread-local variables are in it, so that 64 kB are too few.
  constexpr std::size_t kStack_bytes = std::size_t{256} << 10;
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, kStack_bytes);
  const int error = pthread_create(&thread_, &attributes, enter, this);
  pthread_attr_destroy(&attributes);
  if (error != 0)
    throw std::runtime_error(std::string("cannot start the thread of the camera's controls: ") +
                             std::strerror(error));
  pthread_setname_np(thread_, "fp-controls");
}

ControlWriter::~ControlWriter() {
  wait();
  state_.store(State::kEnd, std::memory_order_release);
  state_.notify_one();
  pthread_join(thread_, nullptr);
}

bool ControlWriter::start(ControlJob* job) {
  if (state_.load(std::memory_order_acquire) != State::kIdle) return false;
  job_ = job;
  state_.store(State::kWanted, std::memory_order_release);
  state_.notify_one();
  return true;
}

bool ControlWriter::finished() {
  if (state_.load(std::memory_order_acquire) != State::kOver) return false;
  state_.store(State::kIdle, std::memory_order_relaxed);
  return true;
}

void ControlWriter::wait() {
  state_.wait(State::kWanted, std::memory_order_acquire);
  state_.store(State::kIdle, std::memory_order_relaxed);
}

void* ControlWriter::enter(void* self) {
  static_cast<ControlWriter*>(self)->run();
  return nullptr;
}

void ControlWriter::run() {
  for (;;) {
    const State state = state_.load(std::memory_order_acquire);
    if (state == State::kEnd) return;
    if (state != State::kWanted) {
      state_.wait(state, std::memory_order_acquire);
      continue;
    }
    job_->run();
    state_.store(State::kOver, std::memory_order_release);
    state_.notify_all();
  }
}

}  // namespace farpoint::drivers

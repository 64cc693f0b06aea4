#include "daemon/realtime.h"

#include <malloc.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>

#include <cerrno>
#include <cstring>
#include <ctime>

namespace farpoint::daemon {
namespace {

void refused(const RealtimeConfig& config, const std::string& what) {
  if (config.require) throw std::runtime_error(what + " (realtime.require is set)");
  spdlog::warn("{}; the run goes on without", what);
}

}  // namespace

void lock_memory(const RealtimeConfig& config) {
  if (!config.lock_memory) return;
  // Only mapping and the main thread allocate: one arena serves both, and a second would be locked whole.
  mallopt(M_ARENA_MAX, 1);
  if (mlockall(MCL_CURRENT | MCL_FUTURE) != 0) {
    refused(config, std::string("memory is not locked: ") + std::strerror(errno) +
                        ", expected RLIMIT_MEMLOCK or CAP_IPC_LOCK to allow it");
  }
}

Thread::Thread(const char* name, const RealtimeConfig& config, int priority, std::function<void()> body)
    : body_(std::move(body)) {
  const auto start = [&](int fifo_priority) {
    pthread_attr_t attributes;
    pthread_attr_init(&attributes);
    pthread_attr_setstacksize(&attributes, static_cast<std::size_t>(config.stack_kb) << 10);
    if (fifo_priority > 0) {
      const sched_param parameters{fifo_priority};
      pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
      pthread_attr_setschedpolicy(&attributes, SCHED_FIFO);
      pthread_attr_setschedparam(&attributes, &parameters);
    }
    const int error = pthread_create(&handle_, &attributes, enter, this);
    pthread_attr_destroy(&attributes);
    return error;
  };
  int error = start(priority);
  if (error == EPERM && priority > 0) {
    refused(config, std::string("thread ") + name +
                        " has no real-time priority, expected RLIMIT_RTPRIO or CAP_SYS_NICE to allow it");
    error = start(0);
  }
  if (error != 0)
    throw std::runtime_error(std::string("cannot start thread ") + name + ": " + std::strerror(error));
  pthread_setname_np(handle_, name);
  pthread_getcpuclockid(handle_, &clock_);
}

Thread::~Thread() {
  join();
}

void Thread::join() {
  if (!joined_) pthread_join(handle_, nullptr);
  joined_ = true;
}

double Thread::cpu_s() const {
  timespec t{};
  clock_gettime(clock_, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

void* Thread::enter(void* self) {
  static_cast<Thread*>(self)->body_();
  return nullptr;
}

}  // namespace farpoint::daemon

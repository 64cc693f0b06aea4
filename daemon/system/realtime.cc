// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/realtime.h"

#include <alloca.h>
#include <fcntl.h>
#include <malloc.h>
#include <sched.h>
#include <spdlog/fmt/fmt.h>
#include <spdlog/fmt/ranges.h>
#include <spdlog/spdlog.h>
#include <sys/mman.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <ctime>
#include <fstream>
#include <set>

namespace farpoint::daemon {
namespace {

const char* name_of(int policy) {
  return policy == SCHED_FIFO ? "SCHED_FIFO" : policy == SCHED_RR ? "SCHED_RR" : "ordinary scheduling";
}

// Bytes between here and the end of the calling thread's stack: less than it was given, for the libraries'
// thread-local variables lie in it too. 0: unknown.
std::size_t stack_left() {
  pthread_attr_t attributes;
  if (pthread_getattr_np(pthread_self(), &attributes) != 0) return 0;
  void* end = nullptr;
  std::size_t bytes = 0;
  const bool known = pthread_attr_getstack(&attributes, &end, &bytes) == 0;
  pthread_attr_destroy(&attributes);
  const auto here = reinterpret_cast<std::uintptr_t>(__builtin_frame_address(0));
  return known ? here - reinterpret_cast<std::uintptr_t>(end) : 0;
}

// The kernel hands out a stack page by page as it is first used: use all of it now.
void touch_stack() {
  constexpr std::size_t kLeftForOthers = 64 << 10, kPage = 4096;
  const std::size_t left = stack_left();
  if (left <= 2 * kLeftForOthers) return;
  const std::size_t touched = left - kLeftForOthers;
  auto* stack = static_cast<volatile char*>(alloca(touched));
  for (std::size_t i = 0; i < touched; i += kPage) stack[i] = 0;
}

}  // namespace

// --- the process

RealtimeReport::~RealtimeReport() {
  if (latency_fd_ >= 0) close(latency_fd_);
}

void RealtimeReport::lock_memory() {
  if (!config_.lock_memory) return;
  // Only mapping and the main thread allocate: one arena serves both, and a second would be locked whole.
  mallopt(M_ARENA_MAX, 1);
  if (mlockall(MCL_CURRENT | MCL_FUTURE) == 0) {
    grant("memory locked");
  } else {
    refuse(std::string("memory is not locked: ") + std::strerror(errno) +
           ", expected RLIMIT_MEMLOCK (LimitMEMLOCK=infinity in the unit) or CAP_IPC_LOCK to allow it");
  }
}

void RealtimeReport::hold_cpu_latency() {
  if (config_.cpu_latency_us < 0) return;
  const char* path = "/dev/cpu_dma_latency";
  const std::int32_t latency_us = config_.cpu_latency_us;
  latency_fd_ = open(path, O_WRONLY | O_CLOEXEC);
  const bool held = latency_fd_ >= 0 && write(latency_fd_, &latency_us, sizeof latency_us) ==
                                            static_cast<ssize_t>(sizeof latency_us);
  if (held) {
    grant(fmt::format("processors wake within {} us", latency_us));
  } else {
    refuse(
        fmt::format("processors may sleep deeply: {}: {}, expected the udev rule of the package to give it "
                    "to the group farpoint",
                    path, std::strerror(errno)));
  }
}

void RealtimeReport::check_governors(const std::string& root) {
  std::set<std::string> slow;
  const long cores = sysconf(_SC_NPROCESSORS_ONLN);
  for (long core = 0; core < cores; ++core) {
    std::ifstream file(fmt::format("{}/sys/devices/system/cpu/cpu{}/cpufreq/scaling_governor", root, core));
    std::string governor;
    if (file >> governor && governor != "performance") slow.insert(governor);
  }
  if (!slow.empty())
    refuse(
        fmt::format("processor frequency is left to governor '{}', expected 'performance' "
                    "(cpupower frequency-set -g performance)",
                    fmt::join(slow, "', '")));
}

void RealtimeReport::refuse(const std::string& what) {
  if (config_.require) throw std::runtime_error(what + " (realtime.require is set)");
  refused_.push_back(what);
}

void RealtimeReport::print() const {
  if (!granted_.empty()) spdlog::info("real time: {}", fmt::join(granted_, "; "));
  for (const std::string& what : refused_) spdlog::warn("real time: {}; the run goes on without", what);
}

// --- a thread

Thread::Thread(const char* name, const RealtimeConfig& config, const ThreadConfig& wanted,
               RealtimeReport* report, std::function<void()> body)
    : body_(std::move(body)) {
  ThreadConfig got = wanted;
  int error = start(config, got);
  // A refusal may throw: no thread may run then.
  if (error == EPERM && got.priority > 0) {
    if (report != nullptr)
      report->refuse(
          fmt::format("{} has no real-time priority, expected RLIMIT_RTPRIO of at least {} "
                      "(LimitRTPRIO= in the unit) or CAP_SYS_NICE to allow it",
                      name, wanted.priority));
    got.priority = 0;
    error = start(config, got);
  }
  if (error == EINVAL && got.core >= 0) {
    if (report != nullptr)
      report->refuse(fmt::format("{} is not on core {}: this process may not use it", name, wanted.core));
    got.core = -1;
    error = start(config, got);
  }
  if (error != 0)
    throw std::runtime_error(std::string("cannot start thread ") + name + ": " + std::strerror(error));
  pthread_setname_np(handle_, name);
  pthread_getcpuclockid(handle_, &clock_);
  if (report != nullptr) say_what_it_got(name, report);
}

int Thread::start(const RealtimeConfig& config, const ThreadConfig& wanted) {
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstacksize(&attributes, static_cast<std::size_t>(config.stack_kb) << 10);
  if (wanted.priority > 0) {
    const sched_param parameters{wanted.priority};
    pthread_attr_setinheritsched(&attributes, PTHREAD_EXPLICIT_SCHED);
    pthread_attr_setschedpolicy(&attributes,
                                config.policy == SchedulingPolicy::kFifo ? SCHED_FIFO : SCHED_RR);
    pthread_attr_setschedparam(&attributes, &parameters);
  }
  if (wanted.core >= 0) {
    cpu_set_t cores;
    CPU_ZERO(&cores);
    CPU_SET(static_cast<std::size_t>(wanted.core), &cores);
    pthread_attr_setaffinity_np(&attributes, sizeof cores, &cores);
  }
  const int error = pthread_create(&handle_, &attributes, enter, this);
  pthread_attr_destroy(&attributes);
  return error;
}

// As the system says it, not as it was asked for.
void Thread::say_what_it_got(const char* name, RealtimeReport* report) const {
  int policy = 0;
  sched_param parameters{};
  cpu_set_t cores;
  CPU_ZERO(&cores);
  if (pthread_getschedparam(handle_, &policy, &parameters) != 0 ||
      pthread_getaffinity_np(handle_, sizeof cores, &cores) != 0)
    return;
  std::string text = fmt::format("{} {}", name, name_of(policy));
  if (parameters.sched_priority > 0) text += fmt::format(" {}", parameters.sched_priority);
  if (CPU_COUNT(&cores) == 1) {
    for (std::size_t core = 0; core < CPU_SETSIZE; ++core)
      if (CPU_ISSET(core, &cores)) text += fmt::format(" on core {}", core);
  }
  report->grant(text);
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
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

void* Thread::enter(void* self) {
  auto* thread = static_cast<Thread*>(self);
  touch_stack();
  thread->body_();
  return nullptr;
}

}  // namespace farpoint::daemon

// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/stage_clock.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <ctime>

namespace farpoint::daemon {
namespace {

double clock_s(clockid_t id) {
  timespec t{};
  clock_gettime(id, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Adds to a time that is negative until the stage runs.
void add_ms(double began_s, double now_s, double* total_ms) {
  *total_ms = std::max(*total_ms, 0.0) + 1e3 * (now_s - began_s);
}

// The name of the estimator's stage in timing_t.
int message_stage(slam::Stage stage) {
  switch (stage) {
    case slam::Stage::kTracking:
      return timing_t::STAGE_TRACKING;
    case slam::Stage::kPyramid:
      return timing_t::STAGE_PYRAMID;
    case slam::Stage::kExtraction:
      return timing_t::STAGE_EXTRACTION;
    case slam::Stage::kMatching:
      return timing_t::STAGE_MATCHING;
    case slam::Stage::kAlignment:
      return timing_t::STAGE_ALIGNMENT;
    case slam::Stage::kPose:
      return timing_t::STAGE_POSE;
    case slam::Stage::kKeyframe:
      return timing_t::STAGE_KEYFRAME;
    case slam::Stage::kMapping:
      return timing_t::STAGE_MAPPING;
    case slam::Stage::kTriangulation:
      return timing_t::STAGE_TRIANGULATION;
    case slam::Stage::kFusing:
      return timing_t::STAGE_FUSING;
    case slam::Stage::kLocalBa:
      return timing_t::STAGE_LOCAL_BA;
    case slam::Stage::kCalibration:
      return StageClock::kCalibration;
    case slam::Stage::kCulling:
      return timing_t::STAGE_CULLING;
  }
  return timing_t::STAGE_FRAME;
}

}  // namespace

double thread_cpu_s() {
  return clock_s(CLOCK_THREAD_CPUTIME_ID);
}
double process_cpu_s() {
  return clock_s(CLOCK_PROCESS_CPUTIME_ID);
}
double steady_s() {
  return clock_s(CLOCK_MONOTONIC);
}

std::int64_t resident_bytes() {
  // Read by hand: a FILE would be allocated for every frame.
  const int file = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  if (file < 0) return 0;
  char text[128] = {};
  const ssize_t got = read(file, text, sizeof(text) - 1);
  close(file);
  long long total_pages = 0, resident_pages = 0;
  const int found = got > 0 ? std::sscanf(text, "%lld %lld", &total_pages, &resident_pages) : 0;
  return found == 2 ? resident_pages * sysconf(_SC_PAGESIZE) : 0;
}

std::int64_t peak_resident_bytes() {
  rusage usage{};
  if (getrusage(RUSAGE_SELF, &usage) != 0) return 0;
  return std::int64_t{usage.ru_maxrss} * 1024;  // Linux counts in kilobytes
}

void StageClock::new_frame() {
  cpu_ms_.fill(-1.0);
  wall_ms_.fill(-1.0);
}

void StageClock::begin(int stage) {
  cpu_began_s_.at(static_cast<std::size_t>(stage)) = thread_cpu_s();
  wall_began_s_.at(static_cast<std::size_t>(stage)) = steady_s();
}

void StageClock::end(int stage) {
  const auto i = static_cast<std::size_t>(stage);
  add_ms(cpu_began_s_.at(i), thread_cpu_s(), &cpu_ms_.at(i));
  add_ms(wall_began_s_.at(i), steady_s(), &wall_ms_.at(i));
}

void StageClock::begin(slam::Stage stage) {
  begin(message_stage(stage));
}
void StageClock::end(slam::Stage stage) {
  end(message_stage(stage));
}

void StageClock::forget(int stage) {
  cpu_ms_.at(static_cast<std::size_t>(stage)) = -1.0;
  wall_ms_.at(static_cast<std::size_t>(stage)) = -1.0;
}

void StageClock::add(int stage, const StageClock& other) {
  const auto i = static_cast<std::size_t>(stage);
  if (other.cpu_ms_.at(i) < 0.0) return;
  cpu_ms_.at(i) = std::max(cpu_ms_.at(i), 0.0) + other.cpu_ms_.at(i);
  wall_ms_.at(i) = std::max(wall_ms_.at(i), 0.0) + other.wall_ms_.at(i);
}

bool is_late(std::int64_t age_us, double deadline_ms) {
  return deadline_ms > 0.0 && 1e-3 * static_cast<double>(age_us) > deadline_ms;
}

timing_t StageClock::message(std::int64_t utime, std::int64_t sequence, std::int64_t age_us,
                             double deadline_ms) const {
  timing_t m{};
  m.utime = utime;
  m.sequence = sequence;
  std::copy(cpu_ms_.begin(), cpu_ms_.end(), m.cpu_ms);
  std::copy(wall_ms_.begin(), wall_ms_.end(), m.wall_ms);
  m.latency_ms = age_us > 0 ? 1e-3 * static_cast<double>(age_us) : -1.0;
  m.deadline_ms = deadline_ms;
  m.deadline_missed = is_late(age_us, deadline_ms) ? 1 : 0;
  m.process_cpu_s = process_cpu_s();
  m.resident_bytes = resident_bytes();
  m.peak_resident_bytes = peak_resident_bytes();
  return m;
}

}  // namespace farpoint::daemon

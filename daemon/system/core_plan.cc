// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/core_plan.h"

#include <sched.h>
#include <spdlog/fmt/fmt.h>

#include <algorithm>
#include <array>
#include <fstream>

namespace farpoint::daemon {
namespace {

constexpr std::size_t kLeastCores = 4;
constexpr int kFastest = 1024;
// Tracking comes last of the three: capture and output work for well under a millisecond.
constexpr int kCapturePriority = 50, kOutputPriority = 45, kTrackingPriority = 40, kMappingPriority = 0;

int capacity_of(const std::string& root, int core) {
  std::ifstream file(fmt::format("{}/sys/devices/system/cpu/cpu{}/cpu_capacity", root, core));
  int capacity = 0;
  return file >> capacity && capacity > 0 ? capacity : kFastest;
}

// Fastest first, without core 0, where most systems handle their interrupts.
std::vector<int> preferred(std::vector<Core> cores) {
  std::erase_if(cores, [](const Core& core) { return core.number == 0; });
  std::stable_sort(cores.begin(), cores.end(),
                   [](const Core& a, const Core& b) { return a.capacity > b.capacity; });
  std::vector<int> numbers;
  for (const Core& core : cores) numbers.push_back(core.number);
  return numbers;
}

void set_priority(int priority, ThreadConfig* thread) {
  if (thread->priority == ThreadConfig::kByProfile) thread->priority = priority;
}

}  // namespace

std::vector<Core> usable_cores(const std::string& root) {
  std::vector<Core> cores;
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (sched_getaffinity(0, sizeof allowed, &allowed) != 0) return cores;
  for (int core = 0; core < CPU_SETSIZE; ++core)
    if (CPU_ISSET(static_cast<std::size_t>(core), &allowed)) cores.push_back({core, capacity_of(root, core)});
  return cores;
}

RealtimeConfig resolved(const RealtimeConfig& config, const std::vector<Core>& cores) {
  const bool vehicle = config.profile == RealtimeProfile::kVehicle;
  RealtimeConfig r = config;
  set_priority(vehicle ? kCapturePriority : 0, &r.capture);
  set_priority(vehicle ? kOutputPriority : 0, &r.output);
  set_priority(vehicle && cores.size() > 1 ? kTrackingPriority : 0, &r.tracking);
  set_priority(kMappingPriority, &r.mapping);
  if (!vehicle || cores.size() < kLeastCores) return r;
  const std::vector<int> order = preferred(cores);
  const std::array threads = {&r.tracking, &r.mapping, &r.output, &r.capture};
  for (std::size_t i = 0; i < threads.size(); ++i)
    if (threads[i]->core < 0) threads[i]->core = order[std::min(i, order.size() - 1)];
  return r;
}

}  // namespace farpoint::daemon

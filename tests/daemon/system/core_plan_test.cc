// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/core_plan.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <filesystem>
#include <fstream>

#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

RealtimeConfig of_profile(RealtimeProfile profile) {
  RealtimeConfig config;
  config.profile = profile;
  return config;
}

std::vector<Core> equal_cores(int count) {
  std::vector<Core> cores;
  for (int i = 0; i < count; ++i) cores.push_back({i, 1024});
  return cores;
}

// Cores of capture, tracking, mapping, output.
std::vector<int> cores_of(const RealtimeConfig& c) {
  return {c.capture.core, c.tracking.core, c.mapping.core, c.output.core};
}

std::vector<int> priorities_of(const RealtimeConfig& c) {
  return {c.capture.priority, c.tracking.priority, c.mapping.priority, c.output.priority};
}

TEST(CorePlan, ADeskRunIsOrdinaryOnAnyCore) {
  const RealtimeConfig r = resolved(RealtimeConfig{}, equal_cores(8));
  EXPECT_EQ(priorities_of(r), (std::vector<int>{0, 0, 0, 0}));
  EXPECT_EQ(cores_of(r), (std::vector<int>{-1, -1, -1, -1}));
}

TEST(CorePlan, AVehicleGetsPrioritiesAndCoresButNeverCoreZero) {
  const RealtimeConfig r = resolved(of_profile(RealtimeProfile::kVehicle), equal_cores(6));
  EXPECT_EQ(priorities_of(r), (std::vector<int>{50, 40, 0, 45}));
  EXPECT_EQ(cores_of(r), (std::vector<int>{4, 1, 2, 3}));
}

TEST(CorePlan, TheFastestCoresGoToTrackingAndMapping) {
  // Four small cores, two middle ones, one big: as on many boards.
  const std::vector<Core> cores = {{0, 300}, {1, 300}, {2, 300}, {3, 300}, {4, 750}, {5, 750}, {6, 1024}};
  EXPECT_EQ(cores_of(resolved(of_profile(RealtimeProfile::kVehicle), cores)), (std::vector<int>{1, 6, 4, 5}));
}

TEST(CorePlan, WithFourCoresCaptureAndOutputShareOneAndWithFewerNoneIsBound) {
  EXPECT_EQ(cores_of(resolved(of_profile(RealtimeProfile::kVehicle), equal_cores(4))),
            (std::vector<int>{3, 1, 2, 3}));
  const RealtimeConfig three = resolved(of_profile(RealtimeProfile::kVehicle), equal_cores(3));
  EXPECT_EQ(cores_of(three), (std::vector<int>{-1, -1, -1, -1}));
  EXPECT_EQ(priorities_of(three), (std::vector<int>{50, 40, 0, 45}));
}

TEST(CorePlan, OnASingleCoreTrackingIsOrdinarySoThatMappingDoesNotStarve) {
  EXPECT_EQ(priorities_of(resolved(of_profile(RealtimeProfile::kVehicle), equal_cores(1))),
            (std::vector<int>{50, 0, 0, 45}));
}

TEST(CorePlan, OnlyCoresOfTheAffinityAreUsed) {
  EXPECT_EQ(
      cores_of(resolved(of_profile(RealtimeProfile::kVehicle), {{2, 1024}, {3, 1024}, {6, 1024}, {7, 1024}})),
      (std::vector<int>{7, 2, 3, 6}));
}

TEST(CorePlan, WhatTheConfigurationSetsStays) {
  RealtimeConfig config = of_profile(RealtimeProfile::kVehicle);
  config.tracking.priority = 0;
  config.tracking.core = 5;
  const RealtimeConfig r = resolved(config, equal_cores(8));
  EXPECT_EQ(priorities_of(r), (std::vector<int>{50, 0, 0, 45}));
  EXPECT_EQ(cores_of(r), (std::vector<int>{4, 5, 2, 3}));
}

TEST(CorePlan, UsableCoresAreThoseOfTheAffinityWithTheKernelsCapacity) {
  cpu_set_t allowed;
  ASSERT_EQ(sched_getaffinity(0, sizeof allowed, &allowed), 0);
  std::vector<Core> cores = usable_cores();
  ASSERT_EQ(cores.size(), static_cast<std::size_t>(CPU_COUNT(&allowed)));
  const test::Scratch scratch;
  const std::string folder =
      scratch.path("sys/devices/system/cpu/cpu" + std::to_string(cores.front().number));
  std::filesystem::create_directories(folder);
  std::ofstream(folder + "/cpu_capacity") << "446\n";
  cores = usable_cores(scratch.path(""));
  EXPECT_EQ(cores.front().capacity, 446);
  for (std::size_t i = 1; i < cores.size(); ++i) EXPECT_EQ(cores[i].capacity, 1024);
}

}  // namespace
}  // namespace farpoint::daemon

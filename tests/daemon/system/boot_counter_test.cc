// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/boot_counter.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <limits>
#include <set>

#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

TEST(BootCounter, CountsFromStartToStart) {
  const test::Scratch scratch;
  for (int i = 1; i <= 3; ++i) {
    const BootCounter counter = next_boot_counter(scratch.path("."));
    EXPECT_EQ(counter.value, i);
    EXPECT_EQ(counter.problem, "");
  }
}

TEST(BootCounter, WithoutAFolderItIsRandomAndSaysSo) {
  std::set<std::int32_t> values;
  for (int i = 0; i < 20; ++i) {
    const BootCounter counter = next_boot_counter("");
    EXPECT_GT(counter.value, 0);
    EXPECT_NE(counter.problem, "");
    values.insert(counter.value);
  }
  EXPECT_GT(values.size(), 18U);
  EXPECT_NE(next_boot_counter("/no/such/folder").problem.find("/no/such/folder/boot_counter"),
            std::string::npos);
}

TEST(BootCounter, WhatIsNoCounterIsNotTakenForOne) {
  const test::Scratch scratch;
  std::ofstream(scratch.path("boot_counter")) << "damaged";
  EXPECT_NE(next_boot_counter(scratch.path(".")).problem, "");
}

TEST(BootCounter, AfterADamagedFileLaterStartsCountOn) {
  const test::Scratch scratch;
  std::ofstream(scratch.path("boot_counter")) << "damaged";
  const BootCounter first = next_boot_counter(scratch.path("."));
  const BootCounter second = next_boot_counter(scratch.path("."));
  EXPECT_EQ(second.value, first.value + 1);
  EXPECT_EQ(second.problem, "");
}

TEST(BootCounter, AfterTheLastNumberComesTheFirst) {
  const test::Scratch scratch;
  std::ofstream(scratch.path("boot_counter")) << std::numeric_limits<std::int32_t>::max();
  EXPECT_EQ(next_boot_counter(scratch.path(".")).value, 1);
}

TEST(BootCounter, OnCanItRunsFrom1To255) {
  EXPECT_EQ(boot_counter_on_can(0), 0);  // replay
  EXPECT_EQ(boot_counter_on_can(1), 1);
  EXPECT_EQ(boot_counter_on_can(255), 255);
  EXPECT_EQ(boot_counter_on_can(256), 1);
}

TEST(StateFolder, IsTheServicesWhereTheKeySaysAuto) {
  ASSERT_EQ(setenv("STATE_DIRECTORY", "/var/lib/farpoint:/other", 1), 0);
  EXPECT_EQ(state_folder("auto"), "/var/lib/farpoint");
  EXPECT_EQ(state_folder("none"), "");
  EXPECT_EQ(state_folder("/elsewhere"), "/elsewhere");
  unsetenv("STATE_DIRECTORY");
  EXPECT_EQ(state_folder("auto"), "");
}

}  // namespace
}  // namespace farpoint::daemon

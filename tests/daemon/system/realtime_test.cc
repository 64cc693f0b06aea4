// SPDX-License-Identifier: Apache-2.0
#include "daemon/system/realtime.h"

#include <gtest/gtest.h>
#include <sched.h>
#include <unistd.h>

#include <atomic>
#include <filesystem>
#include <fstream>

#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

// Lies in the stack of every thread of this program, as the variables of libraries do (the thread sanitizer's
// take 0.8 MB): what a thread touches of its stack beforehand must end before it.
thread_local volatile char library_variables[std::size_t{160} << 10];

TEST(Realtime, AStackThatThreadLocalVariablesShareIsTouchedToItsEndOnly) {
  RealtimeConfig config;
  config.stack_kb = 256;
  std::atomic<int> sum{-1};
  {
    Thread thread("fp-test", config, ThreadConfig{}, nullptr, [&] {
      library_variables[0] = 1;
      sum = library_variables[0] + library_variables[(std::size_t{160} << 10) - 1];
    });
  }
  EXPECT_EQ(sum, 1);
}

TEST(Realtime, AThreadRunsWhereItIsBoundAndItIsSaid) {
  cpu_set_t allowed;
  ASSERT_EQ(sched_getaffinity(0, sizeof allowed, &allowed), 0);
  int core = 0;
  while (!CPU_ISSET(static_cast<std::size_t>(core), &allowed)) ++core;
  RealtimeConfig config;
  ThreadConfig wanted;
  wanted.core = core;
  RealtimeReport report(config);
  std::atomic<int> ran_on{-1};
  std::atomic<bool> may_end{false};
  {
    Thread thread("fp-test", config, wanted, &report, [&] {
      ran_on = sched_getcpu();
      while (!may_end) usleep(1000);
    });
    may_end = true;
  }
  EXPECT_EQ(ran_on, core);
  ASSERT_EQ(report.granted().size(), 1U);
  EXPECT_EQ(report.granted()[0], "fp-test ordinary scheduling on core " + std::to_string(core));
  EXPECT_TRUE(report.refused().empty());
}

TEST(Realtime, ACoreThatIsNotThereIsRefusedAndTheThreadRunsAllTheSame) {
  RealtimeConfig config;
  ThreadConfig wanted;
  wanted.core = 1000;
  RealtimeReport report(config);
  std::atomic<bool> ran{false};
  {
    Thread thread("fp-test", config, wanted, &report, [&] { ran = true; });
  }
  EXPECT_TRUE(ran);
  ASSERT_EQ(report.refused().size(), 1U);
  EXPECT_EQ(report.refused()[0], "fp-test is not on core 1000: this process may not use it");
  config.require = true;
  RealtimeReport strict(config);
  EXPECT_THROW(Thread("fp-test", config, wanted, &strict, [] {}), std::runtime_error);
}

// Which of the two depends on who runs the test; either way it is said what the system did.
TEST(Realtime, APriorityIsGrantedOrRefusedAndSaid) {
  RealtimeConfig config;
  ThreadConfig wanted;
  wanted.priority = 5;
  RealtimeReport report(config);
  std::atomic<int> policy{-1};
  std::atomic<bool> may_end{false};  // one that has ended has no priority to tell
  {
    Thread thread("fp-test", config, wanted, &report, [&] {
      policy = sched_getscheduler(0);
      while (!may_end) usleep(1000);
    });
    may_end = true;
  }
  ASSERT_EQ(report.granted().size(), 1U);
  if (policy == SCHED_FIFO) {
    EXPECT_EQ(report.granted()[0], "fp-test SCHED_FIFO 5");
    EXPECT_TRUE(report.refused().empty());
  } else {
    EXPECT_EQ(report.granted()[0], "fp-test ordinary scheduling");
    ASSERT_EQ(report.refused().size(), 1U);
    EXPECT_NE(report.refused()[0].find("expected RLIMIT_RTPRIO of at least 5"), std::string::npos);
  }
}

TEST(Realtime, AGovernorThatSavesPowerIsSaid) {
  const test::Scratch scratch;
  const std::string folder = scratch.path("sys/devices/system/cpu/cpu0/cpufreq");
  std::filesystem::create_directories(folder);
  RealtimeReport report{RealtimeConfig{}};
  std::ofstream(folder + "/scaling_governor") << "performance\n";
  report.check_governors(scratch.path(""));
  EXPECT_TRUE(report.refused().empty());
  std::ofstream(folder + "/scaling_governor") << "powersave\n";
  report.check_governors(scratch.path(""));
  ASSERT_EQ(report.refused().size(), 1U);
  EXPECT_NE(report.refused()[0].find("'powersave', expected 'performance'"), std::string::npos);
}

}  // namespace
}  // namespace farpoint::daemon

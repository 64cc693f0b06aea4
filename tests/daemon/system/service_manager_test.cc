// SPDX-License-Identifier: Apache-2.0
// The watchdog is fed soon after progress, and never without it.
#include "daemon/system/service_manager.h"

#include <gtest/gtest.h>

#include "tests/daemon/system/notify_socket.h"
#include "tests/ipc/scratch.h"

namespace farpoint::daemon {
namespace {

constexpr double kTick_s = 0.02;

// Time of the last feed. The service makes progress until `hangs_s` and is watched for 10 s.
double fed_last_s(ServiceManager* manager, test::NotifySocket* socket, double hangs_s) {
  double fed_s = -1.0;
  for (double now_s = 0.0; now_s < 10.0; now_s += kTick_s) {
    manager->watch(now_s, [&] { return now_s < hangs_s; });
    socket->messages.clear();
    socket->read_all();
    if (socket->count("WATCHDOG=1") > 0) fed_s = now_s;
  }
  return fed_s;
}

TEST(ServiceManager, AHangIsNotCoveredUpForLongWheneverItBegins) {
  const test::Scratch scratch;
  test::NotifySocket socket(scratch.path("notify"), 2'000'000);
  for (const double hangs_s : {3.0, 3.31, 3.62, 3.99, 4.4}) {
    ServiceManager manager;
    const double fed_s = fed_last_s(&manager, &socket, hangs_s);
    EXPECT_LT(fed_s, hangs_s);
    EXPECT_GT(fed_s, hangs_s - 0.15);
  }
}

TEST(ServiceManager, WithoutAWatchdogProgressIsNotEvaluated) {
  ServiceManager manager;
  manager.watch(1.0, [] {
    ADD_FAILURE();
    return true;
  });
  EXPECT_FALSE(manager.watchdog_s());
}

}  // namespace
}  // namespace farpoint::daemon

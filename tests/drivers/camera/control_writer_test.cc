// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/control_writer.h"

#include <gtest/gtest.h>

#include <chrono>
#include <semaphore>
#include <thread>

namespace farpoint::drivers {
namespace {

// A job of two control calls, each of which returns only when the test lets it.
class SlowJob final : public ControlJob {
 public:
  void run() override {
    thread = std::this_thread::get_id();
    for (int call = 0; call < 2; ++call) {
      asked.release();
      may_go.acquire();
      ++done;
    }
  }
  std::counting_semaphore<> asked{0}, may_go{0};
  int done = 0;
  std::thread::id thread;
};

bool finishes_soon(ControlWriter* writer) {
  for (int i = 0; i < 5000; ++i) {
    if (writer->finished()) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  return false;
}

TEST(ControlWriter, DoesNotWaitForTheCamera) {
  SlowJob job;
  ControlWriter writer;
  EXPECT_FALSE(writer.finished());
  ASSERT_TRUE(writer.start(&job));
  job.asked.acquire();  // it hangs in the first call now
  EXPECT_FALSE(writer.start(&job));
  EXPECT_FALSE(writer.finished());
  job.may_go.release(2);
  ASSERT_TRUE(finishes_soon(&writer));
  EXPECT_EQ(job.done, 2);
  EXPECT_FALSE(writer.finished()) << "once only";
  EXPECT_NE(job.thread, std::this_thread::get_id());
}

TEST(ControlWriter, TakesTheNextOnceTheEndOfTheLastWasReported) {
  SlowJob job;
  job.may_go.release(100);
  ControlWriter writer;
  for (int i = 1; i <= 20; ++i) {
    ASSERT_TRUE(writer.start(&job));
    ASSERT_TRUE(finishes_soon(&writer));
    EXPECT_EQ(job.done, 2 * i);
  }
}

TEST(ControlWriter, WaitsUntilNothingIsUnderWayAndForgetsIt) {
  SlowJob job;
  ControlWriter writer;
  writer.wait();  // for nothing
  ASSERT_TRUE(writer.start(&job));
  job.asked.acquire();
  std::thread later([&job] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    job.may_go.release(2);
  });
  writer.wait();
  EXPECT_EQ(job.done, 2);
  EXPECT_FALSE(writer.finished());
  later.join();
}

TEST(ControlWriter, EndsWhileACallIsUnderWay) {
  SlowJob job;
  std::thread later;
  {
    ControlWriter writer;
    ASSERT_TRUE(writer.start(&job));
    job.asked.acquire();
    later = std::thread([&job] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      job.may_go.release(2);
    });
  }
  EXPECT_EQ(job.done, 2);
  later.join();
}

}  // namespace
}  // namespace farpoint::drivers

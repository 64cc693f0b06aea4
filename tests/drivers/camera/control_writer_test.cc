// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/control_writer.h"

#include <gtest/gtest.h>

#include <chrono>
#include <semaphore>
#include <stdexcept>
#include <thread>
#include <vector>

namespace farpoint::drivers {
namespace {

// A camera that takes a control only when the test lets it.
class SlowCamera {
 public:
  ControlWriter::Set set() {
    return [this](int fd, const ControlValue& control) {
      thread = std::this_thread::get_id();
      asked.release();
      may_go.acquire();
      seen.push_back({control.id, control.value, false});
      return fd == 7 && control.value >= 0;
    };
  }
  std::counting_semaphore<> asked{0}, may_go{0};
  std::vector<ControlValue> seen;
  std::thread::id thread;
};

std::vector<ControlValue> finished_soon(ControlWriter* writer) {
  for (int i = 0; i < 5000; ++i) {
    const auto controls = writer->finished();
    if (!controls.empty()) return {controls.begin(), controls.end()};
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  throw std::runtime_error("the controls never finished");
}

const std::vector<ControlValue> kBoth = {{1, 100}, {2, -5}};

TEST(ControlWriter, DoesNotWaitForTheCamera) {
  SlowCamera camera;
  ControlWriter writer(camera.set());
  EXPECT_TRUE(writer.finished().empty());
  ASSERT_TRUE(writer.start(7, kBoth));
  camera.asked.acquire();  // it hangs in the first control now
  EXPECT_FALSE(writer.start(7, kBoth));
  EXPECT_TRUE(writer.finished().empty());
  camera.may_go.release(2);
  const auto done = finished_soon(&writer);
  ASSERT_EQ(done.size(), 2U);
  EXPECT_EQ(done[0].id, 1U);
  EXPECT_TRUE(done[0].taken);
  EXPECT_EQ(done[1].id, 2U);
  EXPECT_FALSE(done[1].taken);
  EXPECT_TRUE(writer.finished().empty()) << "once only";
  EXPECT_NE(camera.thread, std::this_thread::get_id());
}

TEST(ControlWriter, TakesTheNextOnceTheLastWasAskedFor) {
  SlowCamera camera;
  camera.may_go.release(100);
  ControlWriter writer(camera.set());
  for (std::int32_t value = 1; value <= 20; ++value) {
    const std::vector<ControlValue> one = {{3, value}};
    ASSERT_TRUE(writer.start(7, one));
    EXPECT_EQ(finished_soon(&writer).at(0).value, value);
  }
  EXPECT_EQ(camera.seen.size(), 20U);
}

TEST(ControlWriter, RefusesMoreThanItHasRoomFor) {
  SlowCamera camera;
  ControlWriter writer(camera.set());
  const std::vector<ControlValue> many(ControlWriter::kMost + 1);
  EXPECT_FALSE(writer.start(7, many));
}

TEST(ControlWriter, WaitsUntilNothingIsUnderWayAndForgetsIt) {
  SlowCamera camera;
  ControlWriter writer(camera.set());
  writer.wait();  // for nothing
  ASSERT_TRUE(writer.start(7, kBoth));
  camera.asked.acquire();
  std::thread later([&camera] {
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    camera.may_go.release(2);
  });
  writer.wait();
  EXPECT_EQ(camera.seen.size(), 2U);
  EXPECT_TRUE(writer.finished().empty());
  later.join();
}

TEST(ControlWriter, EndsWhileACallIsUnderWay) {
  SlowCamera camera;
  std::thread later;
  {
    ControlWriter writer(camera.set());
    ASSERT_TRUE(writer.start(7, kBoth));
    camera.asked.acquire();
    later = std::thread([&camera] {
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      camera.may_go.release(2);
    });
  }
  EXPECT_EQ(camera.seen.size(), 2U);
  later.join();
}

}  // namespace
}  // namespace farpoint::drivers

// SPDX-License-Identifier: Apache-2.0
#include "daemon/input/image_queue.h"

#include <gtest/gtest.h>

#include <atomic>
#include <thread>

namespace farpoint::daemon {
namespace {

void push(ImageQueue* queue, std::int64_t utime) {
  CapturedImage* image = queue->begin_push();
  ASSERT_NE(image, nullptr);
  image->meta.utime = utime;
  image->image.pixels[0] = static_cast<std::uint8_t>(utime);
  queue->push();
}

TEST(ImageQueue, TheNewestWin) {
  ImageQueue queue(2, 4, 3);
  EXPECT_EQ(queue.pop(), nullptr);
  for (std::int64_t utime = 1; utime <= 5; ++utime) push(&queue, utime);
  EXPECT_EQ(queue.waiting(), 2U);
  EXPECT_EQ(queue.dropped(), 3);
  CapturedImage* image = queue.pop();
  ASSERT_NE(image, nullptr);
  EXPECT_EQ(image->meta.utime, 4);
  EXPECT_EQ(image->frames_dropped, 2);  // when it was queued
  queue.give_back(image);
  image = queue.pop();
  EXPECT_EQ(image->meta.utime, 5);
  queue.give_back(image);
  EXPECT_EQ(queue.pop(), nullptr);
}

TEST(ImageQueue, TheImageBeingTrackedIsNotTouched) {
  ImageQueue queue(1, 4, 3);
  push(&queue, 1);
  const CapturedImage* tracked = queue.pop();
  for (std::int64_t utime = 2; utime <= 20; ++utime) push(&queue, utime);
  EXPECT_EQ(tracked->meta.utime, 1);
  EXPECT_EQ(tracked->image.pixels[0], 1);
  EXPECT_EQ(queue.dropped(), 18);
}

TEST(ImageQueue, BetweenThreadsEveryImageIsTrackedOrCountedAndNoneIsTorn) {
  constexpr std::int64_t kImages = 20000;
  ImageQueue queue(2, 8, 8);
  std::int64_t tracked = 0, last = 0;
  bool torn = false, unordered = false;
  std::thread tracking([&] {
    for (;;) {
      const bool closed = queue.is_closed();
      CapturedImage* image = queue.pop();
      if (image == nullptr) {
        if (closed) return;
        std::this_thread::yield();
        continue;
      }
      ++tracked;
      unordered = unordered || image->meta.utime <= last;
      last = image->meta.utime;
      for (const std::uint8_t pixel : image->image.pixels)
        torn = torn || pixel != static_cast<std::uint8_t>(image->meta.utime);
      queue.give_back(image);
    }
  });
  for (std::int64_t utime = 1; utime <= kImages; ++utime) {
    CapturedImage* image = queue.begin_push();
    image->meta.utime = utime;
    for (std::uint8_t& pixel : image->image.pixels) pixel = static_cast<std::uint8_t>(utime);
    queue.push();
    if (utime % 7 == 0) std::this_thread::yield();
  }
  queue.close();
  tracking.join();
  EXPECT_FALSE(torn);
  EXPECT_FALSE(unordered);
  EXPECT_EQ(last, kImages);  // the newest is never dropped
  EXPECT_EQ(tracked + queue.dropped(), kImages);
}

}  // namespace
}  // namespace farpoint::daemon

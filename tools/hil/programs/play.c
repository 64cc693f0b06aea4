// SPDX-License-Identifier: Apache-2.0
// usage: play DEVICE WIDTHxHEIGHT RATE COUNT GO_FILE FRAMES_FILE [LEAVE_OUT]
//
// Plays raw grey frames to a video output device, RATE a second, each with the time at which it was due as
// its stamp; with RATE 0 at the pace at which the device takes them, with the time at which it could. Streams
// at once, but sends the first frame only when GO_FILE exists, and falls silent while it is away. The file is
// played forwards and backwards in turn, so that the motion has no jump. Prints "clock MONOTONIC_US
// REALTIME_US", then "NUMBER INDEX_IN_FILE STAMP_US" a frame. The frame LEAVE_OUT is printed and not sent.
#include <errno.h>
#include <fcntl.h>
#include <linux/videodev2.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <time.h>
#include <unistd.h>

enum { kBuffers = 4 };

static int64_t now_us(clockid_t clock) {
  struct timespec t;
  clock_gettime(clock, &t);
  return (int64_t)t.tv_sec * 1000000 + t.tv_nsec / 1000;
}

static void sleep_until(int64_t due_us) {
  const struct timespec t = {due_us / 1000000, due_us % 1000000 * 1000};
  while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &t, NULL) == EINTR) continue;
}

static int wait_for(const char* path) {
  int waited = 0;
  for (; access(path, F_OK) != 0; waited = 1) usleep(20000);
  return waited;
}

static void check(int failed, const char* what) {
  if (!failed) return;
  perror(what);
  exit(1);
}

static void ask(int fd, unsigned long request, void* argument, const char* what) {
  check(ioctl(fd, request, argument) < 0, what);
}

struct frames {
  const uint8_t* bytes;
  long count;
};

static struct frames map_frames(const char* path, size_t frame_bytes) {
  const int fd = open(path, O_RDONLY);
  struct stat status;
  check(fd < 0 || fstat(fd, &status) < 0, path);
  void* bytes = mmap(NULL, (size_t)status.st_size, PROT_READ, MAP_PRIVATE | MAP_POPULATE, fd, 0);
  check(bytes == MAP_FAILED, path);
  return (struct frames){bytes, (long)((size_t)status.st_size / frame_bytes)};
}

static long forwards_and_backwards(long number, long count) {
  const long period = count > 1 ? 2 * (count - 1) : 1, at = number % period;
  return at < count ? at : period - at;
}

static void agree_on_format(int fd, uint32_t width, uint32_t height) {
  struct v4l2_format format = {.type = V4L2_BUF_TYPE_VIDEO_OUTPUT};
  ask(fd, VIDIOC_G_FMT, &format, "VIDIOC_G_FMT");
  format.fmt.pix.width = format.fmt.pix.bytesperline = width;
  format.fmt.pix.height = height;
  format.fmt.pix.pixelformat = V4L2_PIX_FMT_GREY;
  format.fmt.pix.field = V4L2_FIELD_NONE;
  format.fmt.pix.sizeimage = width * height;
  ask(fd, VIDIOC_S_FMT, &format, "VIDIOC_S_FMT");
  ask(fd, VIDIOC_G_FMT, &format, "VIDIOC_G_FMT");
  if (format.fmt.pix.width == width && format.fmt.pix.height == height &&
      format.fmt.pix.sizeimage == width * height)
    return;
  fprintf(stderr, "the device gives %ux%u, %u bytes\n", format.fmt.pix.width, format.fmt.pix.height,
          format.fmt.pix.sizeimage);
  exit(1);
}

static void map_buffers(int fd, uint8_t* buffers[kBuffers]) {
  struct v4l2_requestbuffers request = {
      .count = kBuffers, .type = V4L2_BUF_TYPE_VIDEO_OUTPUT, .memory = V4L2_MEMORY_MMAP};
  ask(fd, VIDIOC_REQBUFS, &request, "VIDIOC_REQBUFS");
  check(request.count < kBuffers, "VIDIOC_REQBUFS");
  for (uint32_t i = 0; i < kBuffers; ++i) {
    struct v4l2_buffer buffer = {.index = i, .type = V4L2_BUF_TYPE_VIDEO_OUTPUT, .memory = V4L2_MEMORY_MMAP};
    ask(fd, VIDIOC_QUERYBUF, &buffer, "VIDIOC_QUERYBUF");
    buffers[i] = mmap(NULL, buffer.length, PROT_READ | PROT_WRITE, MAP_SHARED, fd, buffer.m.offset);
    check(buffers[i] == MAP_FAILED, "mmap");
  }
}

// Every buffer is sent once before any is taken back.
static void take_back(int fd, long sent) {
  struct v4l2_buffer buffer = {.type = V4L2_BUF_TYPE_VIDEO_OUTPUT, .memory = V4L2_MEMORY_MMAP};
  if (sent >= kBuffers) ask(fd, VIDIOC_DQBUF, &buffer, "VIDIOC_DQBUF");
}

static void send(int fd, uint8_t* buffers[kBuffers], long sent, const uint8_t* frame, uint32_t bytes,
                 int64_t stamp_us) {
  struct v4l2_buffer buffer = {.type = V4L2_BUF_TYPE_VIDEO_OUTPUT, .memory = V4L2_MEMORY_MMAP};
  buffer.index = (uint32_t)(sent % kBuffers);
  memcpy(buffers[buffer.index], frame, bytes);
  buffer.bytesused = bytes;
  buffer.field = V4L2_FIELD_NONE;
  buffer.flags = V4L2_BUF_FLAG_TIMESTAMP_COPY;
  buffer.timestamp.tv_sec = stamp_us / 1000000;
  buffer.timestamp.tv_usec = stamp_us % 1000000;
  ask(fd, VIDIOC_QBUF, &buffer, "VIDIOC_QBUF");
}

int main(int argc, char** argv) {
  uint32_t width = 0, height = 0;
  if (argc < 7 || sscanf(argv[2], "%ux%u", &width, &height) != 2) {
    fprintf(stderr, "usage: play DEVICE WIDTHxHEIGHT RATE COUNT GO_FILE FRAMES_FILE [LEAVE_OUT]\n");
    return 2;
  }
  const double rate = atof(argv[3]);
  const int64_t period_us = rate > 0.0 ? (int64_t)(1e6 / rate) : 0;
  const long count = atol(argv[4]), left_out = argc > 7 ? atol(argv[7]) : -1;
  const uint32_t bytes = width * height;
  const struct frames frames = map_frames(argv[6], bytes);
  uint8_t* buffers[kBuffers];
  const int fd = open(argv[1], O_RDWR);
  check(fd < 0, argv[1]);
  agree_on_format(fd, width, height);
  map_buffers(fd, buffers);
  int type = V4L2_BUF_TYPE_VIDEO_OUTPUT;
  ask(fd, VIDIOC_STREAMON, &type, "VIDIOC_STREAMON");
  wait_for(argv[5]);

  printf("clock %lld %lld\n", (long long)now_us(CLOCK_MONOTONIC), (long long)now_us(CLOCK_REALTIME));
  int64_t due_us = now_us(CLOCK_MONOTONIC) + period_us;
  long sent = 0;
  for (long number = 0; number < count; ++number, due_us += period_us) {
    const long index = forwards_and_backwards(number, frames.count);
    sleep_until(due_us);
    if (wait_for(argv[5])) due_us = now_us(CLOCK_MONOTONIC);
    if (number != left_out) {
      take_back(fd, sent);
      if (period_us == 0) due_us = now_us(CLOCK_MONOTONIC);
      send(fd, buffers, sent++, frames.bytes + (size_t)index * bytes, bytes, due_us);
    }
    printf("%ld %ld %lld\n", number, index, (long long)due_us);
    fflush(stdout);
  }
  sleep(1);  // what is sent last is still to be taken
  return 0;
}

// SPDX-License-Identifier: Apache-2.0
// A subscriber that is not Farpoint's code: lcm-gen's C types and LCM's own library. Prints one line a message: channel,
// utime, and the FNV-1a hash of the message decoded and encoded again, so that every member counts. Ends on the channel
// END, or after half a minute.
#include <inttypes.h>
#include <lcm/lcm.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

#include "bot_core_pose_t.h"
#include "farpoint_map_from_odom_t.h"
#include "farpoint_map_t.h"
#include "farpoint_odometry_t.h"
#include "farpoint_pose_t.h"
#include "farpoint_status_t.h"
#include "farpoint_timing_t.h"

static int ended = 0;

static void print(const char* channel, int64_t utime, const uint8_t* bytes, int size) {
  uint64_t hash = 14695981039346656037u;
  for (int i = 0; i < size; ++i) hash = (hash ^ bytes[i]) * 1099511628211u;
  printf("%s %" PRId64 " %016" PRIx64 "\n", channel, utime, hash);
  fflush(stdout);
}

#define HANDLER(type)                                                                                        \
  static void on_##type(const lcm_recv_buf_t* in, const char* channel, const type* message, void* user) {    \
    (void)in;                                                                                                \
    (void)user;                                                                                              \
    const int size = type##_encoded_size(message);                                                           \
    uint8_t* bytes = malloc((size_t)size);                                                                   \
    if (type##_encode(bytes, 0, size, message) == size) print(channel, message->utime, bytes, size);         \
    free(bytes);                                                                                             \
  }
HANDLER(farpoint_odometry_t)
HANDLER(farpoint_pose_t)
HANDLER(farpoint_map_from_odom_t)
HANDLER(farpoint_status_t)
HANDLER(farpoint_timing_t)
HANDLER(farpoint_map_t)
HANDLER(bot_core_pose_t)

static void on_end(const lcm_recv_buf_t* in, const char* channel, void* user) {
  (void)in;
  (void)channel;
  (void)user;
  ended = 1;
}

static void on_ready(const lcm_recv_buf_t* in, const char* channel, void* user) {
  (void)in;
  (void)channel;
  (void)user;
  printf("READY\n");
  fflush(stdout);
}

int main(int argc, char** argv) {
  lcm_t* lcm = argc == 2 ? lcm_create(argv[1]) : NULL;
  if (lcm == NULL) {
    fprintf(stderr, "subscriber: cannot receive; expected one LCM URL\n");
    return 1;
  }
  farpoint_odometry_t_subscribe(lcm, "FARPOINT_ODOMETRY", on_farpoint_odometry_t, NULL);
  farpoint_pose_t_subscribe(lcm, "FARPOINT_POSE", on_farpoint_pose_t, NULL);
  farpoint_map_from_odom_t_subscribe(lcm, "FARPOINT_MAP_FROM_ODOM", on_farpoint_map_from_odom_t, NULL);
  farpoint_status_t_subscribe(lcm, "FARPOINT_STATUS", on_farpoint_status_t, NULL);
  farpoint_timing_t_subscribe(lcm, "FARPOINT_TIMING", on_farpoint_timing_t, NULL);
  farpoint_map_t_subscribe(lcm, "FARPOINT_MAP", on_farpoint_map_t, NULL);
  bot_core_pose_t_subscribe(lcm, "POSE", on_bot_core_pose_t, NULL);
  lcm_subscribe(lcm, "READY", on_ready, NULL);
  lcm_subscribe(lcm, "END", on_end, NULL);
  const time_t start = time(NULL);
  while (!ended && time(NULL) - start < 30) lcm_handle_timeout(lcm, 200);
  lcm_destroy(lcm);
  return ended ? 0 : 2;
}

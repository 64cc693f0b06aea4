// SPDX-License-Identifier: Apache-2.0
#include "drivers/camera/foreign_threads.h"

#include <pthread.h>
#include <sched.h>

#include <algorithm>
#include <cstddef>

namespace farpoint::drivers {
namespace {

constexpr std::size_t kStack_bytes = 1 << 20;

void stand_below_caller(pthread_attr_t* attributes) {
  int policy = SCHED_OTHER;
  sched_param own{};
  if (pthread_getschedparam(pthread_self(), &policy, &own) != 0) return;
  if (policy != SCHED_FIFO && policy != SCHED_RR) return;
  own.sched_priority = std::max(own.sched_priority - 1, sched_get_priority_min(policy));
  if (pthread_attr_setschedpolicy(attributes, policy) != 0) return;
  if (pthread_attr_setschedparam(attributes, &own) != 0) return;
  (void)pthread_attr_setinheritsched(attributes, PTHREAD_EXPLICIT_SCHED);
}

}  // namespace

void limit_foreign_threads() {
  pthread_attr_t attributes;
  if (pthread_attr_init(&attributes) != 0) return;
  if (pthread_attr_setstacksize(&attributes, kStack_bytes) == 0) {
    stand_below_caller(&attributes);
    (void)pthread_setattr_default_np(&attributes);
  }
  pthread_attr_destroy(&attributes);
}

}  // namespace farpoint::drivers

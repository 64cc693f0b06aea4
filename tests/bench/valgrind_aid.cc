// SPDX-License-Identifier: Apache-2.0
// Preloaded under valgrind. Highway's library times itself with rdtscp as it is loaded; valgrind refuses that
// instruction on virtual processors that lack it. No program here uses that timer.
#include <cstdint>

namespace hwy::platform {

std::uint64_t TimerResolution();  // NOLINT(readability-identifier-naming): Highway's name
std::uint64_t TimerResolution() {
  return 1;
}

}  // namespace hwy::platform

// SPDX-License-Identifier: Apache-2.0
// Entry of libFuzzer, built once a target.
#include "tests/fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const farpoint::fuzz::Target& target = farpoint::fuzz::target_of(FARPOINT_FUZZ_TARGET);
  target.run({data, size});
  return 0;
}

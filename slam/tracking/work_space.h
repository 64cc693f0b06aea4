// SPDX-License-Identifier: Apache-2.0
// Work space of the running path: sized and touched at start, reused afterwards.
#pragma once

#include <cstddef>
#include <vector>

namespace farpoint::slam {

// Reserves room for `count` values and writes to its memory; the vector stays empty.
template <typename T>
void reserve_touched(std::vector<T>* values, std::size_t count) {
  values->resize(count);
  values->clear();
}

template <typename T>
[[nodiscard]] std::size_t capacity_bytes(const std::vector<T>& values) {
  return values.capacity() * sizeof(T);
}

}  // namespace farpoint::slam

// What a run keeps of every frame and keyframe to its end.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace farpoint::slam {

// Appends; a full vector gets room for a fixed number more instead of twice as much, half of which would be
// locked memory that nobody uses.
template <typename T>
void append_in_steps(T value, std::vector<T>* values) {
  constexpr std::size_t kStep = 2048;
  if (values->size() == values->capacity()) values->reserve(values->size() + kStep);
  values->push_back(std::move(value));
}

}  // namespace farpoint::slam

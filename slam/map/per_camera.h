// SPDX-License-Identifier: Apache-2.0
// One value a camera of the rig.
#pragma once

#include <cstddef>
#include <utility>
#include <vector>

namespace farpoint::slam {

// The first camera's value is stored inline: a rig of one camera needs no heap memory of its own.
template <typename T>
class PerCamera {
 public:
  PerCamera() = default;
  explicit PerCamera(int cameras) : others_(static_cast<std::size_t>(cameras - 1)) {}

  [[nodiscard]] int size() const { return static_cast<int>(others_.size()) + 1; }
  // Adds default values, or drops the last ones. Precondition: cameras > 0.
  void resize(int cameras) { others_.resize(static_cast<std::size_t>(cameras) - 1); }
  // Precondition: 0 <= camera < size().
  [[nodiscard]] T& operator[](int camera) { return camera == 0 ? first_ : others_[index(camera)]; }
  [[nodiscard]] const T& operator[](int camera) const {
    return camera == 0 ? first_ : others_[index(camera)];
  }

 private:
  [[nodiscard]] static std::size_t index(int camera) { return static_cast<std::size_t>(camera) - 1; }

  T first_{};
  std::vector<T> others_;
};

}  // namespace farpoint::slam

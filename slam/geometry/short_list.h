// SPDX-License-Identifier: Apache-2.0
// A list of few items in place, without the heap.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

namespace farpoint::slam {

// At most N items, in order.
template <typename T, size_t N>
class ShortList {
 public:
  [[nodiscard]] size_t size() const { return size_; }
  [[nodiscard]] bool empty() const { return size_ == 0; }
  [[nodiscard]] T* begin() { return items_.data(); }
  [[nodiscard]] T* end() { return items_.data() + size_; }
  [[nodiscard]] const T* begin() const { return items_.data(); }
  [[nodiscard]] const T* end() const { return items_.data() + size_; }
  [[nodiscard]] const T& front() const { return items_.front(); }
  [[nodiscard]] const T& back() const { return items_[size_ - 1]; }
  // Precondition: size() < N.
  void push_back(const T& item) { items_[size_++] = item; }
  void insert(T* place, const T& item) {
    std::move_backward(place, end(), end() + 1);
    *place = item;
    ++size_;
  }
  void pop_back() { --size_; }
  template <typename Predicate>
  void erase_if(Predicate&& predicate) {
    size_ = static_cast<size_t>(std::remove_if(begin(), end(), predicate) - begin());
  }

 private:
  std::array<T, N> items_;
  size_t size_ = 0;
};

}  // namespace farpoint::slam

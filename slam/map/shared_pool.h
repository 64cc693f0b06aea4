// SPDX-License-Identifier: Apache-2.0
// A fixed number of objects, made at start and lent out as shared_ptr again and again: no heap call when one
// is taken or given back, and no destructor runs on a thread that must not wait for the heap.
#pragma once

#include <cstddef>
#include <memory>
#include <vector>

namespace farpoint::slam {

// take() and for_each_idle() belong to one thread; what they gave out may be dropped by any.
//
// An object is idle when the pool holds its only reference. A reader's last access happens before its
// reference goes (the decrement is a release), and the copy that take() returns is an atomic increment that
// reads that count with acquire (libstdc++ counts with acq_rel throughout), so that the new owner writes
// after the last reader has read.
template <typename T>
class SharedPool {
 public:
  SharedPool() = default;
  // make() gives one std::shared_ptr<T>, with all its memory allocated and touched.
  template <typename Make>
  SharedPool(std::size_t capacity, Make&& make) {
    objects_.reserve(capacity);
    for (std::size_t i = 0; i < capacity; ++i) objects_.push_back(make());
  }

  // An idle object as its last user left it; null where all are lent out.
  [[nodiscard]] std::shared_ptr<T> take() {
    for (std::size_t i = 0; i < objects_.size(); ++i) {
      const std::shared_ptr<T>& object = objects_[next_];
      next_ = next_ + 1 == objects_.size() ? 0 : next_ + 1;
      if (object.use_count() == 1) return object;
    }
    return {};
  }
  // Calls visit(object) for every idle one.
  template <typename Visitor>
  void for_each_idle(Visitor&& visit) {
    for (const std::shared_ptr<T>& object : objects_) {
      if (object.use_count() != 1) continue;
      const std::shared_ptr<T> held = object;
      visit(*held);
    }
  }

  [[nodiscard]] std::size_t capacity() const { return objects_.size(); }
  [[nodiscard]] std::size_t lent() const {
    std::size_t count = 0;
    for (const std::shared_ptr<T>& object : objects_) count += object.use_count() > 1 ? 1U : 0U;
    return count;
  }
  // One of them, for its size. Precondition: capacity() > 0.
  [[nodiscard]] const T& sample() const { return *objects_.front(); }

 private:
  std::vector<std::shared_ptr<T>> objects_;
  std::size_t next_ = 0;
};

}  // namespace farpoint::slam

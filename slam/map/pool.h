// SPDX-License-Identifier: Apache-2.0
// Fixed-capacity storage with generation handles. A handle to something that has gone never resolves to what
// took its place, and nothing moves or allocates after construction.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace farpoint::slam {

template <typename T>
struct Handle {
  static constexpr std::uint32_t kNone = 0xFFFFFFFFU;
  std::uint32_t index = kNone;
  std::uint32_t generation = 0;

  [[nodiscard]] bool is_null() const { return index == kNone; }
  [[nodiscard]] bool operator==(const Handle&) const = default;
};

// Slots are handed out lowest index first among never-used ones, then the most recently returned: the same
// sequence of calls gives the same handles.
template <typename T>
class Pool {
 public:
  explicit Pool(std::size_t capacity) : slots_(capacity) { free_.reserve(capacity); }

  // Null handle when full. The object is as its last user left it: the caller resets what it needs.
  [[nodiscard]] Handle<T> allocate() {
    std::uint32_t index = 0;
    if (!free_.empty()) {
      index = free_.back();
      free_.pop_back();
    } else if (used_ < slots_.size()) {
      index = static_cast<std::uint32_t>(used_++);
    } else {
      return {};
    }
    slots_[index].alive = true;
    ++size_;
    return {index, slots_[index].generation};
  }

  // Ends every handle to this slot. False where the handle had ended before.
  bool release(Handle<T> h) {
    if (!contains(h)) return false;
    Slot& slot = slots_[h.index];
    slot.alive = false;
    ++slot.generation;
    free_.push_back(h.index);
    --size_;
    return true;
  }

  [[nodiscard]] bool contains(Handle<T> h) const {
    return h.index < slots_.size() && slots_[h.index].alive && slots_[h.index].generation == h.generation;
  }
  // nullptr where the handle has ended.
  [[nodiscard]] T* get(Handle<T> h) { return contains(h) ? &slots_[h.index].value : nullptr; }
  [[nodiscard]] const T* get(Handle<T> h) const { return contains(h) ? &slots_[h.index].value : nullptr; }
  // Precondition: contains(h).
  [[nodiscard]] T& operator[](Handle<T> h) { return slots_[h.index].value; }
  [[nodiscard]] const T& operator[](Handle<T> h) const { return slots_[h.index].value; }

  [[nodiscard]] std::size_t size() const { return size_; }
  [[nodiscard]] std::size_t capacity() const { return slots_.size(); }
  [[nodiscard]] bool full() const { return size_ == slots_.size(); }
  [[nodiscard]] std::size_t bytes() const { return slots_.size() * (sizeof(Slot) + sizeof(std::uint32_t)); }

  // Calls visit(object) for every slot, alive or not: to give each its room at the start.
  template <typename Visitor>
  void for_each_slot(Visitor&& visit) {
    for (Slot& slot : slots_) visit(slot.value);
  }

  template <typename Visitor>
  void for_each_slot(Visitor&& visit) const {
    for (const Slot& slot : slots_) visit(slot.value);
  }

  // Calls visit(handle, object) for everything alive, by ascending slot. The visitor may release the visited
  // one.
  template <typename Visitor>
  void for_each(Visitor&& visit) {
    for (std::uint32_t i = 0; i < used_; ++i)
      if (slots_[i].alive) visit(Handle<T>{i, slots_[i].generation}, slots_[i].value);
  }
  template <typename Visitor>
  void for_each(Visitor&& visit) const {
    for (std::uint32_t i = 0; i < used_; ++i)
      if (slots_[i].alive) visit(Handle<T>{i, slots_[i].generation}, slots_[i].value);
  }

 private:
  struct Slot {
    T value{};
    std::uint32_t generation = 0;
    bool alive = false;
  };
  std::vector<Slot> slots_;
  std::vector<std::uint32_t> free_;
  std::size_t used_ = 0;
  std::size_t size_ = 0;
};

}  // namespace farpoint::slam

/* SPDX-License-Identifier: GPL-3.0-or-later */
#ifndef QMAT_NODES_SKIN_RISING_ALLOCATOR_H
#define QMAT_NODES_SKIN_RISING_ALLOCATOR_H

#include <sys/mman.h>

#include <atomic>
#include <cstddef>
#include <limits>
#include <new>

namespace qmat {

/* Thrown by allocations after a stop was requested. */
struct Stopped {};

/* Memory whose addresses only rise, so that objects are ordered by address as they were made. CGAL's mixed complex
 * sorts simplices by the addresses of their vertices and cells; with other memory the last digits of its points depend
 * on the history of the process. While an object of this class lives, the RisingAllocators of its thread use it; the
 * system gets it back in one piece. Throws std::bad_alloc, and Stopped once `stop` is set: CGAL has no way to cancel,
 * but it allocates all the time. */
class RisingMemory {
 public:
  explicit RisingMemory(const std::atomic<bool> &stop) : stop_(stop), outer_(current()) {
    /* Reserves address space only; pages come when they are touched. */
    for (size_ = kLargest; base_ == nullptr; size_ /= 2) {
      if (size_ < kSmallest) throw std::bad_alloc();
      void *memory = mmap(nullptr, size_, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
      if (memory == MAP_FAILED) continue;
      base_ = static_cast<char *>(memory);
      break;
    }
    current() = this;
  }
  ~RisingMemory() {
    current() = outer_;
    munmap(base_, size_);
  }
  RisingMemory(const RisingMemory &) = delete;
  RisingMemory &operator=(const RisingMemory &) = delete;

  void *take(std::size_t bytes) {
    constexpr std::size_t alignment = 64;
    if (stop_) throw Stopped();
    if (bytes > size_ - used_) throw std::bad_alloc();
    void *memory = base_ + used_;
    used_ += (bytes + alignment - 1) / alignment * alignment;
    if (used_ > size_) used_ = size_;
    return memory;
  }
  bool holds(const void *memory) const {
    const char *at = static_cast<const char *>(memory);
    return at >= base_ && at < base_ + size_;
  }

  static RisingMemory *&current() {
    static thread_local RisingMemory *memory = nullptr;
    return memory;
  }

 private:
  static constexpr std::size_t kLargest = std::size_t{1} << 36, kSmallest = std::size_t{1} << 26;
  const std::atomic<bool> &stop_;
  RisingMemory *outer_;
  char *base_ = nullptr;
  std::size_t size_ = 0, used_ = 0;
};

/* Allocates from the RisingMemory of the thread and never frees; without one, uses the ordinary heap. */
template <class T>
class RisingAllocator {
 public:
  using value_type = T;
  RisingAllocator() = default;
  template <class U>
  RisingAllocator(const RisingAllocator<U> &) {}

  T *allocate(std::size_t count) {
    if (count > std::numeric_limits<std::size_t>::max() / 2 / sizeof(T)) throw std::bad_alloc();
    RisingMemory *memory = RisingMemory::current();
    if (memory == nullptr) return static_cast<T *>(::operator new(count * sizeof(T)));
    return static_cast<T *>(memory->take(count * sizeof(T)));
  }
  void deallocate(T *place, std::size_t) {
    const RisingMemory *memory = RisingMemory::current();
    if (memory != nullptr && memory->holds(place)) return;
    ::operator delete(place);
  }
  template <class U>
  bool operator==(const RisingAllocator<U> &) const {
    return true;
  }
  template <class U>
  bool operator!=(const RisingAllocator<U> &) const {
    return false;
  }
};

}  // namespace qmat

#endif

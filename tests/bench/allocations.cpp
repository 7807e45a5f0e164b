// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/allocations.h"

#include <algorithm>
#include <cstdlib>
#include <new>

namespace {
thread_local std::uint64_t count = 0;
thread_local std::size_t largest = 0;

void* counted(std::size_t size, std::size_t alignment) {
  ++count;
  largest = std::max(largest, size);
  const std::size_t rounded = (size + alignment - 1) / alignment * alignment;
  void* p = std::aligned_alloc(alignment, rounded == 0 ? alignment : rounded);
  if (p == nullptr) {
    std::abort();
  }
  return p;
}
}  // namespace

namespace linegate::bench {
std::uint64_t allocations() {
  return count;
}
std::size_t largest_allocation() {
  return largest;
}
void forget_largest_allocation() {
  largest = 0;
}
}  // namespace linegate::bench

namespace {
// Not inlined: where GCC 12 inlines only one of operator new and this function, it warns that
// memory from operator new is freed with free().
[[gnu::noinline]] void release(void* p) {
  std::free(p);
}
}  // namespace

void* operator new(std::size_t size) {
  return counted(size, alignof(std::max_align_t));
}
void* operator new[](std::size_t size) {
  return counted(size, alignof(std::max_align_t));
}
void* operator new(std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void* operator new[](std::size_t size, std::align_val_t alignment) {
  return counted(size, static_cast<std::size_t>(alignment));
}
void* operator new(std::size_t size, const std::nothrow_t&) noexcept {
  return counted(size, alignof(std::max_align_t));
}
void* operator new[](std::size_t size, const std::nothrow_t&) noexcept {
  return counted(size, alignof(std::max_align_t));
}
void operator delete(void* p) noexcept {
  release(p);
}
void operator delete[](void* p) noexcept {
  release(p);
}
void operator delete(void* p, const std::nothrow_t&) noexcept {
  release(p);
}
void operator delete[](void* p, const std::nothrow_t&) noexcept {
  release(p);
}
void operator delete(void* p, std::size_t) noexcept {
  release(p);
}
void operator delete[](void* p, std::size_t) noexcept {
  release(p);
}
void operator delete(void* p, std::align_val_t) noexcept {
  release(p);
}
void operator delete[](void* p, std::align_val_t) noexcept {
  release(p);
}
void operator delete(void* p, std::size_t, std::align_val_t) noexcept {
  release(p);
}
void operator delete[](void* p, std::size_t, std::align_val_t) noexcept {
  release(p);
}

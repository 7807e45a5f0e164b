// SPDX-License-Identifier: Apache-2.0
// Sets of small numbers (slots, ranks) as bits.
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace linegate::pdo {

// visit(bit) for each set bit, ascending; it may clear that bit.
template <class Visit>
void for_each_bit(const std::vector<std::uint64_t>& words, Visit visit) {
  for (std::size_t word = 0; word < words.size(); ++word) {
    for (std::uint64_t bits = words[word]; bits != 0; bits &= bits - 1) {
      visit(64 * word + static_cast<std::size_t>(std::countr_zero(bits)));
    }
  }
}

class Bitmap {
 public:
  // Room for so many bits, none set. Allocates.
  void reset(std::size_t bits) { words_.assign((bits + 63) / 64, 0); }
  void set(std::size_t bit) { words_[bit / 64] |= std::uint64_t{1} << (bit % 64); }
  void clear(std::size_t bit) { words_[bit / 64] &= ~(std::uint64_t{1} << (bit % 64)); }
  bool test(std::size_t bit) const { return (words_[bit / 64] >> (bit % 64) & 1U) != 0; }
  void clear_all() { std::fill(words_.begin(), words_.end(), 0); }
  const std::vector<std::uint64_t>& words() const { return words_; }

  // Clears all bits, calling take(bit) for each in ascending order. Bits that take() sets stay.
  template <class Take>
  void take_all(Take take) {
    for (std::size_t word = 0; word < words_.size(); ++word) {
      for (std::uint64_t bits = std::exchange(words_[word], 0); bits != 0; bits &= bits - 1) {
        const auto bit = static_cast<std::size_t>(std::countr_zero(bits));
        take(static_cast<std::uint16_t>(64 * word + bit));
      }
    }
  }

 private:
  std::vector<std::uint64_t> words_;
};

// A Bitmap whose set bits are counted, on their own and together with those of others: whether any
// bit of any of them is set is one look.
class CountedBitmap {
 public:
  // total: of all that share it; must outlive this.
  explicit CountedBitmap(std::size_t& total) : total_(total) {}
  ~CountedBitmap() = default;
  CountedBitmap(const CountedBitmap&) = delete;
  CountedBitmap& operator=(const CountedBitmap&) = delete;

  void reset(std::size_t bits) {
    clear_all();
    bits_.reset(bits);
  }
  void set(std::size_t bit) {
    const std::size_t more = bits_.test(bit) ? 0 : 1;
    count_ += more;
    total_ += more;
    bits_.set(bit);
  }
  void clear(std::size_t bit) {
    const std::size_t less = bits_.test(bit) ? 1 : 0;
    count_ -= less;
    total_ -= less;
    bits_.clear(bit);
  }
  void clear_all() {
    total_ -= std::exchange(count_, 0);
    bits_.clear_all();
  }
  bool any() const { return count_ != 0; }
  bool test(std::size_t bit) const { return bits_.test(bit); }
  const std::vector<std::uint64_t>& words() const { return bits_.words(); }

 private:
  Bitmap bits_;
  std::size_t count_ = 0;
  std::size_t& total_;
};

}  // namespace linegate::pdo

// SPDX-License-Identifier: Apache-2.0
// Bit sets of small numbers (slots, ranks).
#pragma once

#include <algorithm>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <utility>
#include <vector>

namespace linegate::pdo {

// Calls visit(bit) for each set bit in ascending order; visit may clear that bit.
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
  // Resizes to that many bits, all clear. Allocates.
  void reset(std::size_t bits) { words_.assign((bits + 63) / 64, 0); }
  void set(std::size_t bit) { words_[bit / 64] |= std::uint64_t{1} << (bit % 64); }
  void clear(std::size_t bit) { words_[bit / 64] &= ~(std::uint64_t{1} << (bit % 64)); }
  bool test(std::size_t bit) const { return (words_[bit / 64] >> (bit % 64) & 1U) != 0; }
  void clear_all() { std::fill(words_.begin(), words_.end(), 0); }
  const std::vector<std::uint64_t>& words() const { return words_; }

  // Clears all bits, and calls visit(bit) for each that was set, in ascending order. Bits that
  // visit() sets stay set.
  template <class Visit>
  void drain(Visit visit) {
    for (std::size_t word = 0; word < words_.size(); ++word) {
      for (std::uint64_t bits = std::exchange(words_[word], 0); bits != 0; bits &= bits - 1) {
        const auto bit = static_cast<std::size_t>(std::countr_zero(bits));
        visit(static_cast<std::uint16_t>(64 * word + bit));
      }
    }
  }

 private:
  std::vector<std::uint64_t> words_;
};

// A set with a summary word, which shows whether the set is empty and where its first bit is.
class SummedBitmap {
 public:
  static constexpr std::size_t kNone = SIZE_MAX;

  // summary: bit n is set if word n (or n + 64, ...) is not 0; must outlive this.
  explicit SummedBitmap(std::uint64_t& summary) : summary_(summary) {}
  ~SummedBitmap() = default;
  SummedBitmap(const SummedBitmap&) = delete;
  SummedBitmap& operator=(const SummedBitmap&) = delete;

  void reset(std::size_t bits) {
    summary_ = 0;
    words_.assign((bits + 63) / 64, 0);
    one_to_one_ = words_.size() <= 64;
  }
  // Returns false if the bit was already set.
  bool set(std::size_t bit) {
    std::uint64_t& word = words_[bit / 64];
    const std::uint64_t before = word;
    word = before | std::uint64_t{1} << (bit % 64);
    summary_ |= std::uint64_t{1} << (bit / 64 % 64);
    return (before >> (bit % 64) & 1U) == 0;
  }
  void clear(std::size_t bit) {
    std::uint64_t& word = words_[bit / 64];
    word &= ~(std::uint64_t{1} << (bit % 64));
    if (word == 0 && (one_to_one_ || !others_of_summary(bit / 64))) {
      summary_ &= ~(std::uint64_t{1} << (bit / 64 % 64));
    }
  }
  void clear_all() { reset(64 * words_.size()); }
  bool any() const { return summary_ != 0; }
  bool test(std::size_t bit) const { return (words_[bit / 64] >> (bit % 64) & 1U) != 0; }
  const std::vector<std::uint64_t>& words() const { return words_; }

  // Returns the lowest bit that is set here and not in `except`, which has the same size; kNone if
  // there is none.
  std::size_t first_except(const Bitmap& except) const {
    for (std::uint64_t used = summary_; one_to_one_ && used != 0; used &= used - 1) {
      const auto word = static_cast<std::size_t>(std::countr_zero(used));
      const std::uint64_t bits = words_[word] & ~except.words()[word];
      if (bits != 0) {
        return 64 * word + static_cast<std::size_t>(std::countr_zero(bits));
      }
    }
    return one_to_one_ ? kNone : first_of_many(except);
  }
  // Whether each bit of the summary is that of one word: a set of up to 4096 bits.
  bool one_to_one() const { return one_to_one_; }
  // Removes first_except() and returns it. The bits that are left do not depend on the number of
  // the removed one: the next call can begin before it is known. Precondition: one_to_one().
  std::size_t pop_first_except(const Bitmap& except) {
    const std::uint64_t summary = summary_;
    for (std::uint64_t used = summary; used != 0; used &= used - 1) {
      const auto word = static_cast<std::size_t>(std::countr_zero(used));
      const std::uint64_t all = words_[word];
      const std::uint64_t bits = all & ~except.words()[word];
      if (bits != 0) {
        const std::uint64_t rest = all ^ (bits & (~bits + 1));
        words_[word] = rest;
        if (rest == 0) {
          summary_ = summary ^ (used & (~used + 1));
        }
        return 64 * word + static_cast<std::size_t>(std::countr_zero(bits));
      }
    }
    return kNone;
  }

 private:
  // Whether another word that shares the summary bit of this word is not 0.
  [[gnu::noinline]] bool others_of_summary(std::size_t word) const {
    for (std::size_t other = word % 64; other < words_.size(); other += 64) {
      if (words_[other] != 0) {
        return true;
      }
    }
    return false;
  }
  [[gnu::noinline]] std::size_t first_of_many(const Bitmap& except) const {
    for (std::size_t word = 0; word < words_.size(); ++word) {
      const std::uint64_t bits = words_[word] & ~except.words()[word];
      if (bits != 0) {
        return 64 * word + static_cast<std::size_t>(std::countr_zero(bits));
      }
    }
    return kNone;
  }

  std::vector<std::uint64_t> words_;
  std::uint64_t& summary_;
  bool one_to_one_ = true;  // each bit of the summary is that of one word
};

}  // namespace linegate::pdo

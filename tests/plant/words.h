// SPDX-License-Identifier: Apache-2.0
// The words of one statement and their values. Everything throws BadStatement, which the scenario
// turns into "name:line: text".
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "stack/base/time.h"
#include "stack/od/description.h"

namespace linegate::plant {

struct BadStatement : std::runtime_error {
  using std::runtime_error::runtime_error;
};

// A statement without its comment, split at blanks.
class Words {
 public:
  explicit Words(std::string_view statement);

  bool done() const { return next_ == words_.size(); }
  const std::string& peek() const;
  std::string take();
  // Removes the next word and returns true if it is this one; else removes nothing.
  bool accept(std::string_view word);
  void expect(std::string_view word);

  std::uint64_t number();        // decimal or 0x
  std::uint8_t node();           // 0..127, "all" = 0
  Duration duration();           // "10ms", "2s", "100us"
  od::Address address();         // "6000:1", hexadecimal index, decimal sub-index
  std::vector<std::byte> hex();  // "12AB", bytes in this order

 private:
  std::vector<std::string> words_;
  std::size_t next_ = 0;
};

// Bytes that show whether a value is complete: each depends on its position and on the size.
std::vector<std::byte> pattern(std::uint64_t size);

std::uint64_t to_number(std::string_view text);
Duration to_duration(std::string_view text);
od::Address parse_address(std::string_view text);

}  // namespace linegate::plant

// SPDX-License-Identifier: Apache-2.0
// A device as a table of SDO responses.
#pragma once

#include <cstdint>
#include <map>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/scan/survey.h"

namespace linegate::scan::test {

struct Answers {
  std::map<od::Address, std::vector<std::byte>> objects;
  std::vector<od::Address> asked;

  void set(std::uint16_t index, std::uint8_t sub, std::uint64_t value, std::size_t size) {
    std::vector<std::byte> data(size);
    store_le(std::span(data), value);
    objects[{index, sub}] = data;
  }
  // A PDO of the device: communication and mapping.
  void set_pdo(std::uint16_t index, std::uint32_t cob_id, std::uint8_t type,
               const std::vector<std::uint32_t>& mapped) {
    set(index, 0, 2, 1);
    set(index, 1, cob_id, 4);
    set(index, 2, type, 1);
    const auto mapping = static_cast<std::uint16_t>(index + 0x200);
    set(mapping, 0, mapped.size(), 1);
    for (std::size_t i = 0; i < mapped.size(); ++i) {
      set(mapping, static_cast<std::uint8_t>(i + 1), mapped[i], 4);
    }
  }

  // Answers until the survey has ended.
  ScannedNode survey(std::uint8_t node = 5) {
    Survey survey(node);
    while (const auto address = survey.wanted()) {
      asked.push_back(*address);
      const auto found = objects.find(*address);
      if (found == objects.end()) {
        survey.take(AbortCode::no_object, {});
      } else {
        survey.take(AbortCode::none, found->second);
      }
    }
    return survey.pop_result();
  }
};

}  // namespace linegate::scan::test

// SPDX-License-Identifier: Apache-2.0
// Short ways to write object descriptions and bytes in tests of the dictionary.
#pragma once

#include <cstddef>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "stack/od/dictionary.h"

namespace linegate::od::test {

inline std::vector<std::byte> bytes(std::initializer_list<unsigned> values) {
  std::vector<std::byte> out;
  for (const unsigned value : values) {
    out.push_back(static_cast<std::byte>(value));
  }
  return out;
}

inline std::vector<std::byte> text(const std::string& characters) {
  std::vector<std::byte> out;
  for (const char c : characters) {
    out.push_back(static_cast<std::byte>(c));
  }
  return out;
}

inline std::vector<std::byte> copy(std::span<const std::byte> value) {
  return {value.begin(), value.end()};
}

inline VariableDescription variable(std::uint8_t sub, DataType type,
                                    std::vector<std::byte> value = {}, Access access = Access::rw) {
  VariableDescription out;
  out.sub = sub;
  out.type = type;
  out.access = access;
  out.value = std::move(value);
  return out;
}

inline ObjectDescription object(std::uint16_t index, ObjectType type,
                                std::vector<VariableDescription> variables) {
  ObjectDescription out;
  out.index = index;
  out.type = type;
  out.variables = std::move(variables);
  return out;
}

inline ObjectDescription var(std::uint16_t index, DataType type, std::vector<std::byte> value = {},
                             Access access = Access::rw) {
  return object(index, ObjectType::variable, {variable(0, type, std::move(value), access)});
}

}  // namespace linegate::od::test

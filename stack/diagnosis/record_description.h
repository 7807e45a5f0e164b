// How the objects of this folder's records are described. Private to stack/diagnosis.
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "stack/base/byte_order.h"
#include "stack/od/description.h"

namespace linegate::diagnosis {

inline od::VariableDescription member(std::uint8_t sub, std::string name, od::DataType type,
                                      od::Access access, std::uint64_t value = 0) {
  od::VariableDescription out;
  out.sub = sub;
  out.name = std::move(name);
  out.type = type;
  out.access = access;
  out.value.resize(od::byte_size(type));
  store_le(std::span(out.value), value);
  return out;
}

// With the sub-index 0 that says which is the highest.
inline od::ObjectDescription record(std::uint16_t index, std::string name,
                                    std::vector<od::VariableDescription> members) {
  od::ObjectDescription out{
      .index = index, .name = std::move(name), .type = od::ObjectType::record};
  out.variables = std::move(members);
  const std::uint8_t highest = out.variables.back().sub;
  out.variables.insert(
      out.variables.begin(),
      member(0, "Highest sub-index", od::DataType::unsigned8, od::Access::constant, highest));
  return out;
}

}  // namespace linegate::diagnosis

// SPDX-License-Identifier: Apache-2.0
// What the objects of a device are called in the image: names that differ, whatever its file says.
#pragma once

#include <map>
#include <string>

#include "stack/od/description.h"

namespace linegate::pdo {

// Rules, which hang on the device file alone, so that a name stays when another object is mapped:
//
// 1. The name of an object is its ParameterName; that of an element of an array or record the
//    object's and its own ("Read input 8-bit.Input 1"), or its own if that begins with the
//    object's.
// 2. Elements of one object that have one name are followed by their sub-index, two hexadecimal
//    digits: "Write output 8-bit.Output 01".
// 3. Objects that can be mapped and still have one name are followed by index and sub-index:
//    "Value 2001:00".
class ObjectNames {
 public:
  // device must outlive it.
  explicit ObjectNames(const od::DeviceDescription& device);

  // "unknown" if there is no such object.
  std::string of(od::Address address) const;

 private:
  std::string text_of(const od::ObjectDescription& object,
                      const od::VariableDescription* variable) const;

  const od::DeviceDescription& device_;
  std::map<std::string, unsigned> count_;  // of what can be mapped
};

}  // namespace linegate::pdo

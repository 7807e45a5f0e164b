// SPDX-License-Identifier: Apache-2.0
// Unique names of a device's objects in the image, even if its file has duplicates.
#pragma once

#include <map>
#include <string>

#include "stack/od/description.h"

namespace linegate::pdo {

// The rules depend only on the device file, so that a name does not change when another object is
// mapped:
//
// 1. The name of an object is its ParameterName; that of an element of an array or record is the
//    name of the object and its own ("Read input 8-bit.Input 1"), or its own if that begins with
//    the object's.
// 2. Elements of one object with the same name are followed by their sub-index, two hexadecimal
//    digits: "Write output 8-bit.Output 01".
// 3. Mappable objects that still have the same name are followed by index and sub-index:
//    "Value 2001:00".
class ObjectNames {
 public:
  // device must outlive it.
  explicit ObjectNames(const od::DeviceDescription& device);

  // Returns "unknown" if there is no such object.
  std::string of(od::Address address) const;

 private:
  std::string text_of(const od::ObjectDescription& object,
                      const od::VariableDescription* variable) const;

  const od::DeviceDescription& device_;
  std::map<std::string, unsigned> count_;  // number of mappable objects with that name
};

}  // namespace linegate::pdo

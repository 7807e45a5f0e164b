// SPDX-License-Identifier: Apache-2.0
// Files for tests of the EDS reader, and the messages of the reader.
#pragma once

#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "stack/eds/reader.h"

namespace linegate::eds::test {

// The head that every file needs: 8 lines.
inline constexpr std::string_view kHead =
    "[FileInfo]\n"
    "EDSVersion=4.0\n"
    "[DeviceInfo]\n"
    "VendorName=Linegate\n"
    "Granularity=8\n"
    "[MandatoryObjects]\n"
    "SupportedObjects=1\n"
    "1=0x1000\n";

// A valid object: 5 lines, which are lines 9 to 13 after the head.
inline constexpr std::string_view kDeviceType =
    "[1000]\n"
    "ParameterName=Device type\n"
    "DataType=0x0007\n"
    "AccessType=ro\n"
    "DefaultValue=0x00020192\n";

// A complete section: 8 lines.
inline constexpr std::string_view kDummyUsage =
    "[DummyUsage]\nDummy0001=0\nDummy0002=0\nDummy0003=0\nDummy0004=0\nDummy0005=1\n"
    "Dummy0006=1\nDummy0007=0\n";

// A complete file; `more` begins in line 14.
inline std::string file_with(std::string_view more) {
  return std::string(kHead) + std::string(kDeviceType) + std::string(more);
}

inline std::vector<std::string> messages(const std::vector<Diagnostic>& diagnostics) {
  std::vector<std::string> out;
  std::transform(diagnostics.begin(), diagnostics.end(), std::back_inserter(out),
                 [](const Diagnostic& diagnostic) { return to_string(diagnostic); });
  return out;
}

// The messages of load() for the text under the name "x.eds".
inline std::vector<std::string> messages(std::string_view text, std::uint8_t node_id = 5) {
  return messages(load(text, "x.eds", node_id).diagnostics);
}

inline std::vector<std::byte> bytes(std::initializer_list<unsigned> values) {
  std::vector<std::byte> out;
  for (const unsigned value : values) {
    out.push_back(static_cast<std::byte>(value));
  }
  return out;
}

}  // namespace linegate::eds::test

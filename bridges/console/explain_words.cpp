// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/explain_words.h"

#include <algorithm>
#include <array>
#include <cstdio>
#include <string_view>

#include "stack/base/byte_order.h"

namespace linegate::console {
namespace {

struct ErrorClass {
  std::uint16_t mask;
  std::uint16_t code;
  std::string_view words;
};

// The first match counts.
constexpr std::array<ErrorClass, 42> kErrorClasses{{
    {0xFFFF, 0x8110, "CAN overrun, messages lost"},
    {0xFFFF, 0x8120, "CAN controller error passive"},
    {0xFFFF, 0x8130, "heartbeat or life guarding error"},
    {0xFFFF, 0x8140, "recovered from bus-off"},
    {0xFFFF, 0x8150, "another device sends with the same identifier"},
    {0xFFFF, 0x8210, "PDO not processed, it is too short"},
    {0xFFFF, 0x8220, "PDO is longer than mapped"},
    {0xFFFF, 0x8230, "destination object of an MPDO does not exist"},
    {0xFFFF, 0x8240, "SYNC of an unexpected length"},
    {0xFFFF, 0x8250, "RPDO time-out"},
    {0xFF00, 0x0000, "no error any more"},
    {0xFF00, 0x1000, "generic error"},
    {0xFF00, 0x2000, "current"},
    {0xFF00, 0x2100, "current on the input side"},
    {0xFF00, 0x2200, "current inside the device"},
    {0xFF00, 0x2300, "current on the output side"},
    {0xFF00, 0x3000, "voltage"},
    {0xFF00, 0x3100, "mains voltage"},
    {0xFF00, 0x3200, "voltage inside the device"},
    {0xFF00, 0x3300, "output voltage"},
    {0xFF00, 0x4000, "temperature"},
    {0xFF00, 0x4100, "ambient temperature"},
    {0xFF00, 0x4200, "device temperature"},
    {0xFF00, 0x5000, "device hardware"},
    {0xFF00, 0x6000, "device software"},
    {0xFF00, 0x6100, "internal software"},
    {0xFF00, 0x6200, "user software"},
    {0xFF00, 0x6300, "data set"},
    {0xFF00, 0x7000, "additional modules"},
    {0xFF00, 0x8000, "monitoring"},
    {0xFF00, 0x8100, "communication"},
    {0xFF00, 0x8200, "protocol error"},
    {0xFF00, 0x9000, "external error"},
    {0xFF00, 0xF000, "additional functions"},
    {0xFF00, 0xFF00, "device-specific error"},
    {0xF000, 0x1000, "generic error"},
    {0xF000, 0x2000, "current"},
    {0xF000, 0x3000, "voltage"},
    {0xF000, 0x4000, "temperature"},
    {0xF000, 0x5000, "device hardware"},
    {0xF000, 0x6000, "device software"},
    {0x0000, 0x0000, "an error class that CiA 301 does not define"},
}};

struct LssCommand {
  std::uint8_t code;
  std::string_view request;  // empty: no such request
  std::string_view answer;
  std::uint8_t value_bytes;  // size of the value that is printed with it
};

constexpr std::array<LssCommand, 26> kLssCommands{{
    {0x04, "switch all devices to state", "", 1},
    {0x11, "node-ID shall be", "node-ID set, error", 1},
    {0x13, "bit timing", "bit timing set, error", 2},
    {0x15, "activate the bit timing after ms", "", 2},
    {0x17, "store the configuration", "configuration stored, error", 1},
    {0x40, "switch the device with vendor-ID", "", 4},
    {0x41, "with product code", "", 4},
    {0x42, "with revision number", "", 4},
    {0x43, "with serial number", "", 4},
    {0x44, "", "it is in configuration state", 0},
    {0x46, "identify devices with vendor-ID", "", 4},
    {0x47, "and product code", "", 4},
    {0x48, "and revision number from", "", 4},
    {0x49, "and revision number to", "", 4},
    {0x4A, "and serial number from", "", 4},
    {0x4B, "and serial number to", "", 4},
    {0x4C, "identify devices without a node-ID", "", 0},
    {0x4F, "", "here is such a device", 0},
    {0x50, "", "here is a device without node-ID", 0},
    {0x51, "fastscan for", "", 4},
    {0x5A, "which vendor-ID", "vendor-ID", 4},
    {0x5B, "which product code", "product code", 4},
    {0x5C, "which revision number", "revision number", 4},
    {0x5D, "which serial number", "serial number", 4},
    {0x5E, "which node-ID", "node-ID", 1},
    {0x00, "", "", 0},
}};

bool is_question(std::uint8_t code) {
  return code >= 0x5A && code <= 0x5E;
}

std::string hex(std::uint32_t value) {
  char text[12];
  std::snprintf(text, sizeof text, "%Xh", value);
  return text;
}

}  // namespace

std::string describe_error_code(std::uint16_t code) {
  const auto found =
      std::find_if(kErrorClasses.begin(), kErrorClasses.end(),
                   [&](const ErrorClass& known) { return (code & known.mask) == known.code; });
  return std::string(found->words);
}

std::string describe_error_register(std::uint8_t bits) {
  constexpr std::array<std::string_view, 8> kNames{"generic",     "current",       "voltage",
                                                   "temperature", "communication", "device profile",
                                                   "reserved",    "manufacturer"};
  std::string out;
  for (std::size_t i = 0; i < kNames.size(); ++i) {
    if ((bits >> i & 1U) != 0) {
      out += (out.empty() ? "" : ", ") + std::string(kNames[i]);
    }
  }
  return out;
}

std::string explain_lss(const can::Frame& frame, bool request) {
  if (frame.length == 0) {
    return "no LSS command: 0 bytes";
  }
  const auto code = std::to_integer<std::uint8_t>(frame.data[0]);
  const auto found =
      std::find_if(kLssCommands.begin(), kLssCommands.end(), [&](const LssCommand& known) {
        return known.code == code && !(request ? known.request : known.answer).empty();
      });
  if (found == kLssCommands.end()) {
    return "LSS: no command that CiA 305 has: " + hex(code);
  }
  std::string out = "LSS: " + std::string(request ? found->request : found->answer);
  if (request && is_question(code)) {
    return out + "?";
  }
  if (code == 0x04) {
    return out + (frame.data[1] == std::byte{1} ? " configuration" : " waiting");
  }
  if (code == 0x17 && request) {
    return out;
  }
  const auto value = load_le(std::span(frame.data).subspan(1, found->value_bytes));
  return found->value_bytes == 0 ? out : out + " " + hex(static_cast<std::uint32_t>(value));
}

}  // namespace linegate::console

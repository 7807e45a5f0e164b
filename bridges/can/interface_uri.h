// SPDX-License-Identifier: Apache-2.0
// An interface as written in the configuration: "scheme:name?key=value&key=value".
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace linegate::can_bridge {

struct UriOption {
  std::string key;
  std::string value;
};

struct InterfaceUri {
  std::string scheme;  // "socketcan", "virtual", "replay", "udp"
  // "can0"; 1 to 64 characters (socketcan: at most 15). replay: the path of a file; udp:
  // address and port
  std::string name;
  std::vector<UriOption> options;  // each key at most once

  // The value of that option; nothing if it is not there.
  std::optional<std::string_view> option(std::string_view key) const;
};

struct ParsedUri {
  InterfaceUri uri;
  std::string error;  // empty if uri is valid; else a sentence for the integrator

  bool ok() const { return error.empty(); }
};

// Also checks the options: an unknown scheme, an unknown key or a wrong value is an error that
// names it. The header that opens a channel of the scheme documents its options.
ParsedUri parse_uri(std::string_view text);

// "speed=max&interface=can0", as it follows the question mark. A sentence if it is not that.
std::string split_options(std::string_view text, std::vector<UriOption>& out);

}  // namespace linegate::can_bridge

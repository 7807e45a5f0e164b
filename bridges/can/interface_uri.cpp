// SPDX-License-Identifier: Apache-2.0
#include "bridges/can/interface_uri.h"

#include <algorithm>
#include <array>
#include <span>

#include "bridges/can/replay.h"
#include "bridges/can/socketcan.h"
#include "bridges/can/udp.h"
#include "bridges/can/virtual_faults.h"

namespace linegate::can_bridge {
namespace {

constexpr std::size_t kMaxInterfaceName = 15;  // IFNAMSIZ without the final zero
constexpr std::size_t kMaxBusName = 64;

// What a scheme is like. Each check gives a sentence if something is wrong, else nothing.
struct Scheme {
  std::string_view name;
  std::string_view example;
  std::string (*check_name)(const Scheme& scheme, const InterfaceUri& uri);
  std::string (*check_options)(const InterfaceUri& uri);
};

std::string quoted(std::string_view text) {
  return "\"" + std::string(text) + "\"";
}

bool printable_name(std::string_view name) {
  return !name.empty() && std::all_of(name.begin(), name.end(),
                                      [](char c) { return c > ' ' && c <= '~' && c != '/'; });
}

std::string check_short_name(const Scheme& scheme, const InterfaceUri& uri) {
  const std::size_t longest = uri.scheme == "socketcan" ? kMaxInterfaceName : kMaxBusName;
  if (!printable_name(uri.name)) {
    return "interface " + quoted(uri.scheme + ":" + uri.name) +
           " needs a name of printable characters after the colon, as in " + quoted(scheme.example);
  }
  if (uri.name.size() > longest) {
    return "interface name " + quoted(uri.name) + " is too long: at most " +
           std::to_string(longest) + " characters";
  }
  return {};
}

std::string check_path(const Scheme& scheme, const InterfaceUri& uri) {
  return uri.name.empty() ? "interface " + quoted(uri.scheme + ":") +
                                " needs a file after the colon, as in " + quoted(scheme.example)
                          : std::string();
}

std::string check_socketcan(const InterfaceUri& uri) {
  return controller_setup(uri).error;
}

std::string any_name(const Scheme& /*scheme*/, const InterfaceUri& /*uri*/) {
  return {};
}

std::string check_udp(const InterfaceUri& uri) {
  return udp_options(uri).error;
}

std::string check_virtual(const InterfaceUri& uri) {
  return virtual_faults(uri).error;
}

std::string check_replay(const InterfaceUri& uri) {
  return replay_options(uri).error;
}

constexpr std::array<Scheme, 4> kSchemes{
    {{"socketcan", "socketcan:can0", check_short_name, check_socketcan},
     {"virtual", "virtual:line1", check_short_name, check_virtual},
     {"replay", "replay:press.log", check_path, check_replay},
     {"udp", "udp:239.74.163.2:43113", any_name, check_udp}}};

std::string known_schemes() {
  std::string out;
  for (std::size_t i = 0; i < kSchemes.size(); ++i) {
    out += (i == 0 ? "" : i + 1 == kSchemes.size() ? " and " : ", ") + quoted(kSchemes[i].name);
  }
  return out;
}

}  // namespace

std::string split_options(std::string_view text, std::vector<UriOption>& out) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('&'), text.size());
    const std::string_view part = text.substr(0, end);
    const std::size_t equals = part.find('=');
    if (equals == 0 || equals == std::string_view::npos) {
      return "option " + quoted(part) + " of an interface is not written key=value";
    }
    UriOption option{std::string(part.substr(0, equals)), std::string(part.substr(equals + 1))};
    if (std::any_of(out.begin(), out.end(), [&](const auto& o) { return o.key == option.key; })) {
      return "option " + quoted(option.key) + " of an interface is there twice";
    }
    out.push_back(std::move(option));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return {};
}

std::optional<std::string_view> InterfaceUri::option(std::string_view key) const {
  const auto found = std::find_if(options.begin(), options.end(),
                                  [&](const UriOption& other) { return other.key == key; });
  return found == options.end() ? std::nullopt : std::optional<std::string_view>(found->value);
}

ParsedUri parse_uri(std::string_view text) {
  ParsedUri parsed;
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) {
    parsed.error = "interface " + quoted(text) +
                   " has no scheme: write \"socketcan:" + std::string(text) +
                   "\" or \"virtual:" + std::string(text) + "\"";
    return parsed;
  }
  const std::string_view rest = text.substr(colon + 1);
  const std::size_t question = std::min(rest.find('?'), rest.size());
  parsed.uri.scheme = text.substr(0, colon);
  parsed.uri.name = rest.substr(0, question);
  const auto scheme = std::find_if(kSchemes.begin(), kSchemes.end(), [&](const Scheme& known) {
    return known.name == parsed.uri.scheme;
  });
  if (scheme == kSchemes.end()) {
    parsed.error =
        "unknown interface scheme " + quoted(parsed.uri.scheme) + ": known are " + known_schemes();
    return parsed;
  }
  parsed.error = scheme->check_name(*scheme, parsed.uri);
  if (parsed.ok()) {
    parsed.error =
        split_options(rest.substr(std::min(question + 1, rest.size())), parsed.uri.options);
  }
  if (parsed.ok()) {
    parsed.error = scheme->check_options(parsed.uri);
  }
  return parsed;
}

}  // namespace linegate::can_bridge

// SPDX-License-Identifier: Apache-2.0
// The requests of clients: those of a line (stack/line/requests.h), and those that the gateway
// executes itself.
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>

#include "bridges/request/journal.h"
#include "stack/line/command.h"

namespace linegate::request {

// --- executed by the gateway ---------------------------------------------------------------------
// Their numbers are those of the DDS contract, which line::CommandKind leaves out.

// The versions of the program and its libraries. Reply: text. Needs no line.
struct Versions {
  static constexpr line::CommandKind kKind{7};
  static constexpr std::string_view kName = "versions";
};

// Restarts the CAN controller of a line after bus-off.
struct BusRestart {
  static constexpr line::CommandKind kKind{10};
  static constexpr std::string_view kName = "bus-restart";
};

// Changes the faults of a virtual bus. Reply: text.
struct BusFault {
  static constexpr line::CommandKind kKind{13};
  static constexpr std::string_view kName = "bus-fault";
  std::string change{};
};

// JournalRead: journal.h. Needs no line, as Versions.
using GatewayRequest = std::variant<Versions, BusRestart, BusFault, JournalRead>;

// As line::Command. A time-out would have no effect: none of them waits for the network.
struct GatewayCommand {
  std::uint64_t tag = 0;     // chosen by the caller, returned in line::Reply
  std::uint32_t client = 0;  // as line::Command::client
  bool audited = false;      // as line::Command::audited
  GatewayRequest request{};
};

// --- both ----------------------------------------------------------------------------------------

using Request = std::variant<line::Request, GatewayRequest>;

inline constexpr auto kGatewayKinds =
    []<class... Kinds>(std::type_identity<std::variant<Kinds...>>) {
      return std::array{Kinds::kKind...};
    }(std::type_identity<GatewayRequest>{});

// Number of kinds in the DDS contract.
inline constexpr std::size_t kCommandKinds = line::kRequestKinds.size() + kGatewayKinds.size();
static_assert(
    [] {
      for (std::size_t number = 0; number < kCommandKinds; ++number) {
        const auto kind = static_cast<line::CommandKind>(number);
        if (std::ranges::count(line::kRequestKinds, kind) +
                std::ranges::count(kGatewayKinds, kind) !=
            1) {
          return false;
        }
      }
      return true;
    }(),
    "each number of the contract belongs to one kind");

line::CommandKind kind(const GatewayRequest& request);
line::CommandKind kind(const Request& request);
// Commands that write nothing to a device, and may be carried out twice.
bool only_reads(line::CommandKind kind);
// "bus-restart". As line::name(), and for the kinds of the gateway.
std::string_view command_name(line::CommandKind kind);
// A request of the kind with that number and default parameters; nullopt if the number has no kind.
std::optional<Request> empty_request(std::uint8_t number);

}  // namespace linegate::request

// SPDX-License-Identifier: Apache-2.0
#include "bridges/request/request.h"

namespace linegate::request {
namespace {

// A request of the gateway with that kind; nullopt: it is not one of the gateway.
template <class... Kinds>
std::optional<GatewayRequest> find(line::CommandKind kind,
                                   std::type_identity<std::variant<Kinds...>> /*of*/) {
  std::optional<GatewayRequest> found;
  ((Kinds::kKind == kind ? void(found = Kinds{}) : void()), ...);
  return found;
}

}  // namespace

line::CommandKind kind(const GatewayRequest& request) {
  return kGatewayKinds[request.index()];
}

line::CommandKind kind(const Request& request) {
  return std::visit([](const auto& of_sort) { return kind(of_sort); }, request);
}

bool only_reads(line::CommandKind kind) {
  using enum line::CommandKind;
  constexpr std::array kReads{sdo_read,        network_read,    local_read,        scan,
                              connection_list, Versions::kKind, JournalRead::kKind};
  return std::ranges::find(kReads, kind) != kReads.end();
}

std::string_view command_name(line::CommandKind kind) {
  const auto found = find(kind, std::type_identity<GatewayRequest>{});
  return found ? std::visit([](const auto& request) { return request.kName; }, *found)
               : line::name(kind);
}

std::optional<Request> empty_request(std::uint8_t number) {
  const auto kind = static_cast<line::CommandKind>(number);
  if (line::index_of(kind) < line::kRequestKinds.size()) {
    return line::empty_request(kind);
  }
  return find(kind, std::type_identity<GatewayRequest>{});
}

}  // namespace linegate::request

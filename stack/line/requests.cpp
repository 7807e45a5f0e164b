// SPDX-License-Identifier: Apache-2.0
#include "stack/line/requests.h"

#include <utility>

#include "stack/base/assert.h"

namespace linegate::line {

Request::Request() = default;
Request::Request(const Request& from) = default;
Request::Request(Request&& from) noexcept = default;
Request& Request::operator=(const Request& from) = default;
Request& Request::operator=(Request&& from) noexcept = default;
Request::~Request() = default;

Request empty_request(CommandKind kind) {
  constexpr auto kMake = []<class... Kinds>(std::type_identity<std::variant<Kinds...>>) {
    return std::array<Request (*)(), sizeof...(Kinds)>{[] { return Request(Kinds{}); }...};
  }(std::type_identity<AnyRequest>{});
  LINEGATE_ASSERT(index_of(kind) < kMake.size(), "it is a kind of request");
  return kMake[index_of(kind)]();
}

std::uint8_t node_of(const Request& request) {
  return std::visit(
      [](const auto& of_kind) {
        if constexpr (requires { of_kind.node; }) {
          return of_kind.node;
        } else {
          return std::uint8_t{0};
        }
      },
      request);
}

}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/request_codec.h"

#include <utility>

#include "bridges/dds/object_request_codecs.h"
#include "bridges/dds/service_request_codecs.h"

namespace linegate::dds {
namespace {

// The numbers of the kinds are those of the contract.
template <class... Requests>
constexpr bool same_numbers(std::type_identity<std::variant<Requests...>> /*of*/) {
  return ((static_cast<unsigned>(RequestCodec<Requests>::kKind) ==
           static_cast<unsigned>(Requests::kKind)) &&
          ...);
}
static_assert(same_numbers(std::type_identity<line::AnyRequest>{}));
static_assert(same_numbers(std::type_identity<request::GatewayRequest>{}));

template <class Kind>
RequestCodec<std::remove_cvref_t<Kind>> codec_of(const Kind& /*request*/) {
  return {};
}

// Calls `use` with the request of its kind. Request: request::Request, const or not.
template <class Request, class Use>
auto visit_kind(Request& request, const Use& use) {
  return std::visit([&use](auto& of_sort) { return std::visit(use, of_sort); }, request);
}

}  // namespace

void write_members(const request::Request& from, v1::CommandRequest& to) {
  to.kind(static_cast<std::uint8_t>(request::kind(from)));
  to.node(0);
  to.index(0);
  to.sub(0);
  to.nmt(0);
  to.code(0);
  to.error_register(0);
  to.entry(0);
  visit_kind(from, [&to](const auto& request) { codec_of(request).write(request, to); });
}

std::vector<std::byte> encode_data(const request::Request& from) {
  return visit_kind(from, [](const auto& request) { return codec_of(request).encode(request); });
}

const char* read_members(const v1::CommandRequest& from, request::Request& to) {
  auto empty = request::empty_request(from.kind());
  if (!empty)
    return "kind is not a CommandKind";
  to = *std::move(empty);
  return visit_kind(to, [&from](auto& request) { return codec_of(request).read(from, request); });
}

const char* decode_data(std::vector<std::byte> data, request::Request& to) {
  return visit_kind(
      to, [&data](auto& request) { return codec_of(request).decode(std::move(data), request); });
}

}  // namespace linegate::dds

// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/request_codec.h"

#include <utility>

#include "bridges/dds/object_request_codecs.h"
#include "bridges/dds/service_request_codecs.h"

namespace linegate::dds {
namespace {

// The numbers of the stack are those of the contract.
template <class... Requests>
constexpr bool same_numbers(std::type_identity<std::variant<Requests...>> /*of*/) {
  return ((static_cast<unsigned>(RequestCodec<Requests>::kKind) ==
           static_cast<unsigned>(Requests::kKind)) &&
          ...);
}
static_assert(same_numbers(std::type_identity<line::Request>{}));

template <class Request>
RequestCodec<std::remove_cvref_t<Request>> codec_of(const Request& /*request*/) {
  return {};
}

}  // namespace

void write_members(const line::Request& from, v1::CommandRequest& to) {
  to.kind(static_cast<std::uint8_t>(line::kind(from)));
  to.node(0);
  to.index(0);
  to.sub(0);
  to.nmt(0);
  to.code(0);
  to.error_register(0);
  to.entry(0);
  std::visit([&to](const auto& request) { codec_of(request).write(request, to); }, from);
}

std::vector<std::byte> encode_data(const line::Request& from) {
  return std::visit([](const auto& request) { return codec_of(request).encode(request); }, from);
}

const char* read_members(const v1::CommandRequest& from, line::Request& to) {
  if (from.kind() >= line::kCommandKinds)
    return "kind is not a CommandKind";
  to = line::empty_request(static_cast<line::CommandKind>(from.kind()));
  return std::visit([&from](auto& request) { return codec_of(request).read(from, request); }, to);
}

const char* decode_data(std::vector<std::byte> data, line::Request& to) {
  return std::visit(
      [&data](auto& request) { return codec_of(request).decode(std::move(data), request); }, to);
}

}  // namespace linegate::dds

// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/accept.h"

#include <array>
#include <cstdio>
#include <optional>
#include <ostream>

#include "bridges/console/answer.h"
#include "bridges/console/boot.h"
#include "bridges/console/lookup.h"
#include "bridges/console/model.h"
#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

namespace linegate::console {
namespace {

struct IdentityPart {
  od::Address seen;        // object of the device
  std::uint16_t expected;  // object of the manager; its sub-index is the node-ID
  const char* name;
};
constexpr std::array<IdentityPart, 5> kIdentity{{
    {{od::objects::kDeviceType, 0}, od::objects::kExpectedDeviceType, "device type"},
    {od::objects::kVendorId, od::objects::kExpectedVendor, "vendor-ID"},
    {od::objects::kProductCode, od::objects::kExpectedProduct, "product code"},
    {od::objects::kRevisionNumber, od::objects::kExpectedRevision, "revision number"},
    {od::objects::kSerialNumber, od::objects::kExpectedSerial, "serial number"},
}};
constexpr std::size_t kSerialNumber = 4;

using IdentityValues = std::array<std::uint32_t, kIdentity.size()>;

bool is_missing(const Error& error) {
  return error.domain == Domain::sdo &&
         (error.code == static_cast<std::uint32_t>(AbortCode::no_object) ||
          error.code == static_cast<std::uint32_t>(AbortCode::no_sub_index));
}

// Returns 0, which the manager does not compare, if the device lacks the object.
std::optional<std::uint32_t> read_part(Context& context, Model& model, const Line& line,
                                       std::uint8_t node, const IdentityPart& part) {
  const line::Command command{.timeout = context.timeout,
                              .request = line::SdoRead{.node = node, .address = part.seen}};
  const Client::Answer answer = ask_line(context, model, line, command);
  const std::vector<std::byte>& value = answer.reply.bytes();
  if (answer.reply.ok() && value.size() == sizeof(std::uint32_t)) {
    return load_le<std::uint32_t>(value.data());
  }
  if (part.seen.sub > 1 && is_missing(answer.reply.error)) {
    return 0;
  }
  context.err << part.name << " of node " << unsigned{node} << ": "
              << (answer.reply.ok() ? "not 4 bytes" : answer.text) << '\n';
  return std::nullopt;
}

bool write_part(Context& context, Model& model, const Line& line, std::uint8_t node,
                const IdentityPart& part, std::uint32_t value) {
  line::LocalWrite write{.address = {part.expected, node}, .data = {}};
  write.data.resize(sizeof value);
  store_le(write.data.data(), value);
  const Client::Answer answer =
      ask_line(context, model, line, {.timeout = context.timeout, .request = std::move(write)});
  if (!answer.reply.ok()) {
    context.err << "expected " << part.name << " of node " << unsigned{node} << ": " << answer.text
                << '\n';
  }
  return answer.reply.ok();
}

void print_identity(Context& context, std::uint8_t node, const IdentityValues& values) {
  std::array<char, 160> text{};
  std::snprintf(text.data(), text.size(),
                "node %u: device type %08Xh, vendor-ID %08Xh, product code %08Xh, revision number "
                "%08Xh, serial number %u",
                unsigned{node}, values[0], values[1], values[2], values[3], values[kSerialNumber]);
  context.err << text.data()
              << "\nis expected until the gateway restarts. To keep this, plant.yaml needs the "
                 "device file of this device";
  if (values[kSerialNumber] != 0) {
    context.err << ", and \"serial: " << values[kSerialNumber] << "\" if it names one";
  }
  context.err << ".\n";
}

}  // namespace

int accept(Context& context, const std::string& what) {
  auto target = parse_node(what);
  if (!target || target->own || target->all) {
    context.err << "'" << what << "' is not LINE:NODE, with a node-ID 1..127 or a name\n";
    return kUsage;
  }
  const int written = on_line(context, target->line, [&](Model& model, const Line& line) {
    if (!resolve_node(context, model, line, *target)) {
      return kFailed;
    }
    IdentityValues values{};
    for (std::size_t i = 0; i < kIdentity.size(); ++i) {
      const auto value = read_part(context, model, line, target->node, kIdentity[i]);
      if (!value) {
        return kFailed;
      }
      values[i] = *value;
    }
    for (std::size_t i = 0; i < kIdentity.size(); ++i) {
      if (!write_part(context, model, line, target->node, kIdentity[i], values[i])) {
        return kFailed;
      }
    }
    print_identity(context, target->node, values);
    return kDone;
  });
  return written == kDone ? boot(context, what) : written;
}

}  // namespace linegate::console

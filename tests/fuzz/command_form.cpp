// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/command_form.h"

#include <algorithm>
#include <utility>

namespace linegate::fuzz {
namespace {

using std::chrono::milliseconds;
using std::chrono::seconds;

od::Address address_of(const CommandForm& form) {
  return {form.index, form.sub};
}

// One for each kind of request: without it the build fails.
void fill(CommandForm& form, line::SdoRead& out) {
  out = {.node = form.node,
         .address = address_of(form),
         .from_image = (form.code & kFormFromImage) != 0,
         .from_scan = (form.code & kFormFromScan) != 0,
         .repeats = form.repeats};
}
void fill(CommandForm& form, line::SdoWrite& out) {
  out = {.node = form.node,
         .address = address_of(form),
         .data = std::move(form.data),
         .repeats = form.repeats};
}
void fill(CommandForm& form, line::NetworkRead& out) {
  out = {.network = form.network,
         .node = form.node,
         .address = address_of(form),
         .as_device = (form.entry & 1U) != 0,
         .repeats = form.repeats,
         .hops = static_cast<std::uint8_t>(form.entry >> 8U)};
}
void fill(CommandForm& form, line::NetworkWrite& out) {
  out = {.network = form.network,
         .node = form.node,
         .address = address_of(form),
         .as_device = (form.entry & 1U) != 0,
         .data = std::move(form.data),
         .repeats = form.repeats,
         .hops = static_cast<std::uint8_t>(form.entry >> 8U)};
}
void fill(CommandForm& form, line::ObjectWrite& out) {
  out = {.node = form.node,
         .address = address_of(form),
         .data = std::move(form.data),
         .force_sdo = (form.code & kFormForceSdo) != 0,
         .keep_pdo = (form.code & kFormKeepPdo) != 0};
}
void fill(CommandForm& form, line::LocalRead& out) {
  out = {.node = form.node, .what = address_of(form)};
  if ((form.code & kFormRange) != 0) {
    out.what = line::ObjectRange{form.index, static_cast<std::uint16_t>(form.entry)};
  }
}
void fill(CommandForm& form, line::LocalWrite& out) {
  out = {.node = form.node,
         .address = address_of(form),
         .as_owner = (form.code & kFormAsOwner) != 0,
         .data = std::move(form.data)};
}
void fill(CommandForm& form, line::SingleOutput& out) {
  out = {.entry = form.entry, .data = std::move(form.data)};
}
void fill(CommandForm& form, line::EmcySend& out) {
  out = {.node = form.node, .code = form.code, .error_register = form.sub};
  const std::size_t size = std::min(form.data.size(), out.manufacturer.size());
  std::copy_n(form.data.begin(), size, out.manufacturer.begin());
}
void fill(CommandForm& form, line::NmtRequest& out) {
  out = {.node = form.node, .command = form.nmt};
}
void fill(CommandForm& form, line::SleepRequest& out) {
  out = {.action = static_cast<line::SleepAction>(form.code)};
}
void fill(CommandForm& form, line::RoutingTrace& out) {
  out = {.duration = seconds(form.code)};
}
void fill(CommandForm& form, line::Scan& out) {
  out = {.node = form.node};
}
void fill(CommandForm& form, line::ScanApply& out) {
  out = {.node = form.node,
         .set_up = (form.code & kFormSetUp) != 0,
         .restore = (form.code & kFormRestore) != 0};
}
void fill(CommandForm& form, line::Boot& out) {
  out = {.node = form.node};
}
void fill(CommandForm& form, line::Configure& out) {
  out = {.node = form.node, .apply = (form.code & 1U) != 0};
}
void fill(CommandForm& form, line::ProgramDownload& out) {
  out = {.node = form.node, .number = form.sub, .program = std::move(form.data)};
}
void fill(CommandForm& form, line::LssRequest& out) {
  out = {.procedure = static_cast<lss::Procedure>(form.code % lss::kProcedures),
         .arguments = std::move(form.data)};
}
void fill(CommandForm& form, line::PdoTrigger& out) {
  out = {.node = form.node, .number = form.code};
  if (form.node == 0 && form.code == 0) {
    out.output_byte = form.entry;
  }
}
void fill(CommandForm& form, line::PdoRequest& out) {
  out = {.node = form.node, .number = form.code};
}
void fill(CommandForm& form, line::MpdoWrite& out) {
  out = {.node = form.node,
         .address = address_of(form),
         .data = std::move(form.data),
         .tpdo = form.code};
}
void fill(CommandForm& form, line::ConnectionOpen& out) {
  out = {.node = form.node, .server = static_cast<std::uint8_t>(form.code)};
}
void fill(CommandForm& form, line::ConnectionClose& out) {
  out = {.number = form.entry};
}
void fill(CommandForm& /*form*/, line::ConnectionList& /*out*/) {
}
// Lengths and flags that no frame has are among them.
void fill(CommandForm& form, line::CanSend& out) {
  const bool remote = (form.entry & kFormRemote) != 0;
  out.frame.id = form.entry & ~(kFormExtended | kFormRemote);
  out.frame.flags = static_cast<std::uint8_t>(
      ((form.entry & kFormExtended) != 0 ? can::Frame::kExtended : 0) |
      (remote ? can::Frame::kRemote : 0) | (form.sub != 0 ? can::Frame::kFd : 0) |
      (form.sub == 5 ? can::Frame::kBitRateSwitch : 0));
  const std::size_t size = std::min(form.data.size(), out.frame.data.size());
  out.frame.length = static_cast<std::uint8_t>(remote ? form.code : size);
  std::copy_n(form.data.begin(), size, out.frame.data.begin());
}
void fill(CommandForm& form, line::CanListen& out) {
  out.identifier = form.entry & ~kFormExtended;
  out.extended = (form.entry & kFormExtended) != 0;
  out.duration = seconds(form.code);
  if (!form.data.empty()) {
    out.mask = std::to_integer<std::uint32_t>(form.data.front());
    out.extended.reset();
  }
}
// data: type, access, flags (1 mappable, 2 stored, 4 in the image), then the default.
void fill(CommandForm& form, line::ObjectCreate& out) {
  if (form.code == kFormRemoval) {
    out.what = line::ObjectRemoval{form.index};
    return;
  }
  constexpr std::size_t kHead = 3;
  line::OwnObject object{.index = form.index, .offset = form.entry};
  object.variable.sub = form.sub;
  object.variable.name = "own";
  if (form.data.size() >= kHead) {
    object.variable.type = static_cast<od::DataType>(form.data[0]);
    object.variable.access = static_cast<od::Access>(std::to_integer<unsigned>(form.data[1]) % 6U);
    const auto flags = std::to_integer<unsigned>(form.data[2]);
    object.variable.mappable = (flags & 1U) != 0;
    object.variable.store = (flags & 2U) != 0;
    object.in_image = (flags & 4U) != 0;
    object.variable.value.assign(form.data.begin() + kHead, form.data.end());
  }
  out.what = std::move(object);
}

}  // namespace

Duration time_out(std::uint8_t byte) {
  if (byte == 0xFF) {
    return Duration::max();
  }
  if (byte == 0xFE) {
    return milliseconds(-1);
  }
  return byte < 0x80 ? milliseconds(byte) : milliseconds(100) * (byte - 0x80);
}

std::vector<std::byte> read_data(Input& input) {
  constexpr std::size_t kMostGiven = 64;
  const std::size_t size = input.byte();
  if (size < kMostGiven) {
    return input.bytes(size);
  }
  std::vector<std::byte> out(size * 8);
  std::ranges::copy(input.bytes(4), out.begin());
  return out;
}

CommandForm read_form(Input& input) {
  CommandForm out;
  const std::uint8_t number = input.byte();
  const std::size_t index = line::index_of(static_cast<line::CommandKind>(number));
  out.kind =
      line::kRequestKinds[index < line::kRequestKinds.size() ? index
                                                             : number % line::kRequestKinds.size()];
  out.node = input.byte();
  out.index = input.word();
  out.sub = input.byte();
  out.nmt = static_cast<nmt::Command>(input.byte());
  out.code = input.word();
  out.entry = input.word();
  out.entry |= static_cast<std::uint32_t>(input.word()) << 16U;
  out.network = input.byte();
  out.timeout = time_out(input.byte());
  out.repeats = input.byte();
  out.data = read_data(input);
  return out;
}

line::Command to_command(CommandForm form) {
  line::Command out{.timeout = form.timeout, .request = line::empty_request(form.kind)};
  std::visit([&form](auto& request) { fill(form, request); }, out.request);
  return out;
}

}  // namespace linegate::fuzz

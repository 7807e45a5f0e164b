// SPDX-License-Identifier: Apache-2.0
#include "bridges/console/explain.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <span>
#include <string_view>
#include <utility>

#include "bridges/console/explain_own_node.h"
#include "bridges/console/explain_usdo.h"
#include "bridges/console/explain_words.h"
#include "bridges/console/value_text.h"
#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/emcy/message.h"
#include "stack/image/layout.h"
#include "stack/image/scaling.h"
#include "stack/nmt/state.h"
#include "stack/od/description.h"
#include "stack/od/objects.h"
#include "stack/pdo/mpdo.h"
#include "stack/routing/emcy_frame.h"
#include "stack/time/message.h"
#include "stack/usdo/protocol.h"

namespace linegate::console {
namespace {

constexpr std::uint32_t kExtendedKey = 0x8000'0000;
constexpr std::uint32_t kLssAnswer = 0x7E4;
constexpr std::uint32_t kLssRequest = 0x7E5;
constexpr std::uint8_t kToggle = 0x80;
constexpr std::string_view kIfPredefined = ", if identifiers are the pre-defined ones";

std::uint32_t identifier_key(std::uint32_t identifier, bool extended) {
  return identifier | (extended ? kExtendedKey : 0);
}

std::uint8_t byte_of(const can::Frame& frame, std::size_t at) {
  return std::to_integer<std::uint8_t>(frame.data[at]);
}

std::string wrong_length(const can::Frame& frame, std::string_view what) {
  return "no " + std::string(what) + ": " + std::to_string(frame.length) + " bytes";
}

// Two digits each; the day counts from 1984-01-01.
std::string time_text(const time::TimeOfDay& time) {
  const auto utc = std::chrono::sys_time<Duration>(time::to_utc(time));
  const auto day = std::chrono::floor<std::chrono::days>(utc);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(
      std::chrono::duration_cast<std::chrono::milliseconds>(utc - day));
  char text[48];
  std::snprintf(
      text, sizeof text, "%04d-%02u-%02u %02d:%02d:%02d.%03d", static_cast<int>(date.year()),
      static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
      static_cast<int>(clock.hours().count()), static_cast<int>(clock.minutes().count()),
      static_cast<int>(clock.seconds().count()), static_cast<int>(clock.subseconds().count()));
  return text;
}

// Extracts `bits` bits of a PDO from bit `offset` on, little-endian.
std::vector<std::byte> bits_of(const can::Frame& frame, std::size_t offset, std::size_t bits) {
  std::vector<std::byte> out((bits + 7) / 8);
  for (std::size_t i = 0; i < bits; ++i) {
    const std::size_t at = offset + i;
    const auto bit = std::to_integer<unsigned>(frame.data[at / 8]) >> (at % 8) & 1U;
    out[i / 8] |= static_cast<std::byte>(bit << (i % 8));
  }
  return out;
}

}  // namespace

std::string object_text(const od::DeviceDescription* device, od::Address address) {
  std::string out = od::to_text(address);
  const od::ObjectDescription* object = device == nullptr ? nullptr : device->find(address.index);
  if (object == nullptr) {
    return out;
  }
  const od::VariableDescription* variable = device->find(address);
  const bool single =
      object->variables.size() == 1 || variable == nullptr || variable->name.empty();
  if (variable != nullptr && !variable->alias.empty()) {
    return out + " " + variable->alias;
  }
  out += " " + object->name;
  return single || variable->name == object->name ? out : out + ", " + variable->name;
}

std::string value_of(const od::DeviceDescription* device, od::Address address,
                     std::span<const std::byte> value) {
  const auto* variable = device == nullptr ? nullptr : device->find(address);
  if (variable == nullptr || variable->type == od::DataType::none) {
    return to_hex(value);
  }
  if (!to_number(variable->type, value)) {
    return to_text(variable->type, value);
  }
  image::Entry entry{.bit_length = static_cast<std::uint16_t>(8 * value.size()),
                     .type = variable->type,
                     .name = variable->alias.empty() ? variable->name : variable->alias};
  image::describe_value(*variable, entry);
  return text_with_unit(entry, value);
}

// --- devices ------------------------------------------------------------------------------------

void Explainer::add(const line::NodeConfig& device) {
  devices_[device.id] = device;
  channels_.erase(device.id);
  note_pdos(device.id, channel(device.id).pdos);
  note_emcy(device.id, channel(device.id).emcy);
}

void Explainer::add_own_node(const line::LineConfig& line) {
  if (line.routing.interface != 0) {
    gateways_.insert(line.node_id);
    gateways_.insert(line.routing.gateways.begin(), line.routing.gateways.end());
    for (const routing::Route& route : line.routing.routes) {
      if (route.interface == line.routing.interface && route.gateway != 0) {
        gateways_.insert(route.gateway);
      }
    }
  }
  od::DeviceDescription own = describe_own_node(line);
  if (!own.objects.empty()) {
    add({.id = line.node_id, .name = "own node", .device = std::move(own)});
  }
}

void Explainer::note_pdos(unsigned id, const PdoFollower& pdos) {
  for (auto& [key, of_key] : pdos_) {
    std::erase_if(of_key, [id](const Pdo& pdo) { return pdo.node == id; });
  }
  std::erase_if(pdos_, [](const auto& entry) { return entry.second.empty(); });
  for (const bool transmitted : {true, false}) {
    const auto kind = transmitted ? pdo::PdoKind::tpdo : pdo::PdoKind::rpdo;
    for (const observer::KnownPdo& known : pdos.pdos()) {
      if (known.kind == kind) {
        const can::CobId cob_id = known.parameters.cob_id;
        pdos_[identifier_key(cob_id.id(), cob_id.extended())].push_back(
            {id, known.parameters, transmitted});
      }
    }
  }
}

void Explainer::note_emcy(unsigned id, const EmcyIdentifier& emcy) {
  for (auto& [key, nodes] : emcys_) {
    nodes.erase(id);
  }
  std::erase_if(emcys_, [](const auto& entry) { return entry.second.empty(); });
  const std::optional<can::CobId> cob_id = emcy.cob_id();
  if (cob_id && cob_id->valid()) {
    emcys_[identifier_key(cob_id->id(), cob_id->extended())].insert(id);
  }
}

Explainer::Channel& Explainer::channel(unsigned id) {
  const auto found = channels_.find(id);
  if (found != channels_.end()) {
    return found->second;
  }
  const od::DeviceDescription* known = description(id);
  const od::DeviceDescription empty;
  PdoFollower pdos(known == nullptr ? empty : *known, static_cast<std::uint8_t>(id));
  return channels_.emplace(id, Channel{{}, {}, std::move(pdos), EmcyIdentifier(device(id))})
      .first->second;
}

const od::DeviceDescription* Explainer::description(unsigned id) const {
  const line::NodeConfig* const known = device(id);
  return known == nullptr ? nullptr : &known->device;
}

const line::NodeConfig* Explainer::device(unsigned id) const {
  const auto found = devices_.find(id);
  return found == devices_.end() ? nullptr : &found->second;
}

std::string Explainer::node(unsigned id) const {
  const line::NodeConfig* known = device(id);
  const std::string number = "node " + std::to_string(id);
  return known == nullptr || known->name.empty() ? number : number + " (" + known->name + ")";
}

// --- services -----------------------------------------------------------------------------------

std::string Explainer::follow_nmt(nmt::Command command, std::uint8_t to) {
  std::string out;
  for (auto& [id, channel] : channels_) {
    if (to != 0 && id != to) {
      continue;
    }
    std::string news;
    if (nmt::is_reset(command)) {
      news = channel.pdos.reset();
      channel.emcy.reset();
      channel.sdo.reset();
      usdo_.reset(static_cast<std::uint8_t>(id));
      note_emcy(id, channel.emcy);
    } else if (command == nmt::Command::start) {
      news = channel.pdos.start();
    }
    if (!news.empty()) {
      out += "; " + (to == 0 ? node(id) + ": " + news : news);
      note_pdos(id, channel.pdos);
    }
  }
  return out;
}

std::string Explainer::nmt(const can::Frame& frame) {
  if (frame.length != 2) {
    return wrong_length(frame, "NMT command");
  }
  const std::uint8_t command = byte_of(frame, 0);
  const std::uint8_t id = byte_of(frame, 1);
  const std::string to = id == 0 ? "all nodes" : node(id);
  if (!nmt::is_command(command) || id > can::kMaxNodeId) {
    return "NMT: no command there is: " + hex_digits(command, 2) + "h to " + to;
  }
  const auto known = static_cast<nmt::Command>(command);
  return "NMT: " + std::string(name(known)) + " " + to + follow_nmt(known, id);
}

std::string Explainer::error_control(const can::Frame& frame, unsigned id) {
  if (frame.remote()) {
    return "node guarding: requests the state of " + node(id);
  }
  if (frame.length != 1) {
    return wrong_length(frame, "heartbeat");
  }
  const std::uint8_t state = byte_of(frame, 0);
  if (state == 0) {
    Channel& of = channel(id);
    const std::string news = of.pdos.boot_up();
    note_pdos(id, of.pdos);
    of.emcy.boot_up();
    of.sdo.reset();
    usdo_.reset(static_cast<std::uint8_t>(id));
    note_emcy(id, of.emcy);
    return node(id) + " booted up" + (news.empty() ? "" : "; " + news);
  }
  const auto code = static_cast<nmt::State>(state & ~kToggle);
  const std::string text = node(id) + " is " + std::string(name(code));
  return (state & kToggle) != 0 ? text + " (answer to node guarding, toggle bit 1)" : text;
}

std::string Explainer::emcy(const can::Frame& frame, unsigned id, bool assumed) const {
  auto message = emcy::decode(frame);
  if (!message) {
    message = emcy::decode_fd(frame);
  }
  if (!message) {
    return wrong_length(frame, "EMCY");
  }
  std::string out = "EMCY of " + node(id) + std::string(assumed ? kIfPredefined : "") + ": " +
                    describe_error_code(message->code) + " (" + hex_digits(message->code, 4) + "h)";
  if (message->error_register != 0) {
    out += ", error register: " + describe_error_register(message->error_register);
  }
  if (message->fd.any) {
    out += emcy::fd_text(message->fd);
  }
  if (gateways_.contains(id)) {
    // An EMCY of the gateway itself may have such bytes, too.
    if (const auto forwarded = routing::decode(*message)) {
      out += ", forwarded, unless it is of the gateway itself: of node " +
             std::to_string(forwarded->node) + " in network " + std::to_string(forwarded->network) +
             ", hop " + std::to_string(forwarded->hops);
    }
  }
  for (const std::byte info : message->info) {
    if (info != std::byte{0}) {
      return out + ", manufacturer's bytes " + to_hex(message->info);
    }
  }
  return out;
}

std::string Explainer::follow_doubt(unsigned id, Channel& with, od::Address object) {
  if (object == od::Address{od::objects::kEmcyCobId, 0}) {
    with.emcy.doubt();
    note_emcy(id, with.emcy);
  }
  const std::string news = with.pdos.doubt(object);
  note_pdos(id, with.pdos);
  return news.empty() ? news : "; " + news;
}

// Of a line of CANopen FD: the identifier has the node-ID of the sender, byte 0 that of the
// receiver.
std::string Explainer::usdo(const can::Frame& frame, unsigned id, bool request) {
  std::string out = std::string(request ? "USDO request" : "USDO answer") + " of " + node(id);
  if (!usdo::well_formed(frame) ||
      (usdo::is_known(usdo::command_of(frame)) && !usdo::has_fields(frame))) {
    return out + ", but it is no USDO frame: " + std::to_string(frame.length) + " bytes";
  }
  const auto sender = static_cast<std::uint8_t>(id);
  const std::uint8_t receiver = usdo::receiver_of(frame);
  const std::uint8_t server = request ? receiver : sender;
  const std::uint8_t client = request ? sender : receiver;
  const auto object = usdo_.object_of(client, server, usdo::session_of(frame));
  out += " to " + (receiver == 0 ? "all nodes" : node(receiver)) + ": " +
         explain_usdo(frame, description(server), object);
  const auto ended = request ? usdo_.request(sender, frame) : usdo_.answer(sender, frame);
  while (const auto lost = usdo_.pop_unanswered()) {
    out += "; whether " + object_text(description(lost->server), lost->object) +
           " was written is not known" +
           follow_doubt(lost->server, channel(lost->server), lost->object);
  }
  if (!ended || !ended->transfer.complete()) {
    return out;
  }
  const usdo::Command command = usdo::command_of(frame);
  if (command == usdo::Command::end_response || command == usdo::Command::upload_end) {
    const observer::Transfer& all = ended->transfer;
    out += "; all of it = " + value_of(description(server), all.address, all.kept());
  }
  return out + follow_transfer(server, channel(server), ended->transfer);
}

// Returns the changes of its PDOs in words.
std::string Explainer::follow_transfer(unsigned id, Channel& with,
                                       const observer::Transfer& transfer) {
  with.emcy.follow(transfer);
  note_emcy(id, with.emcy);
  const std::string news = with.pdos.follow(transfer);
  if (news.empty()) {
    return news;
  }
  note_pdos(id, with.pdos);
  return "; " + news;
}

std::string Explainer::sdo(const can::Frame& frame, unsigned id, bool request) {
  Channel& with = channel(id);
  std::string out = "SDO " + std::string(request ? "to " : "of ") + node(id) + ": " +
                    with.sdo.explain(frame, description(id), request);
  if (const auto object = with.sdo.pop_unanswered()) {
    out += "; whether " + object_text(description(id), *object) + " was written is not known" +
           follow_doubt(id, with, *object);
  }
  const auto transfer = request ? with.transfers.request(frame) : with.transfers.answer(frame);
  if (!transfer || !transfer->complete()) {
    return out;
  }
  return out + follow_transfer(id, with, *transfer);
}

std::string Explainer::pdo(const can::Frame& frame, const Pdo& pdo) const {
  std::string out = (pdo.transmitted ? "TPDO " : "RPDO ") + std::to_string(pdo.parameters.number) +
                    (pdo.transmitted ? " of " : " to ") + node(pdo.node);
  const od::DeviceDescription* device = description(pdo.node);
  if (frame.remote()) {
    return out + " is requested";
  }
  if (pdo.parameters.mpdo != pdo::MpdoMode::none) {
    return out + mpdo(frame);
  }
  std::size_t offset = 0;
  for (const pdo::Mapping& mapping : pdo.parameters.mapping) {
    if (offset + mapping.bits > 8U * frame.length) {
      return out + ", but " + std::to_string(frame.length) + " bytes are too short for " +
             object_text(device, mapping.address);
    }
    if (mapping.address.index >= 0x20) {  // indices below 20h are dummy entries
      out += offset == 0 ? ": " : "; ";
      out += object_text(device, mapping.address) + " = " +
             value_of(device, mapping.address, bits_of(frame, offset, mapping.bits));
    }
    offset += mapping.bits;
  }
  return out;
}

// The value has the size of the object's data type, or four bytes if that is unknown.
std::string Explainer::mpdo(const can::Frame& frame) const {
  const auto content = pdo::decode_mpdo(frame);
  if (!content) {
    return ", but it is no MPDO";
  }
  const bool to_all = content->mode == pdo::MpdoMode::destination && content->node == 0;
  const od::DeviceDescription* const device = to_all ? nullptr : description(content->node);
  const auto* const variable = device == nullptr ? nullptr : device->find(content->address);
  const std::size_t of_type = variable == nullptr ? 0 : od::byte_size(variable->type);
  const std::size_t size =
      of_type != 0 && of_type <= content->value.size() ? of_type : content->value.size();
  return std::string(content->mode == pdo::MpdoMode::source ? ", MPDO: of " : ", MPDO: to ") +
         (to_all ? "all nodes" : node(content->node)) + ", " +
         object_text(device, content->address) + " = " +
         value_of(device, content->address, std::span(content->value).first(size));
}

// --- which service -------------------------------------------------------------------------------

std::string Explainer::by_identifier(const can::Frame& frame) {
  const unsigned id = frame.id & 0x7FU;
  if (frame.id == can::kNmtId) {
    return nmt(frame);
  }
  if (frame.id == can::kSyncId) {
    return frame.length == 0 ? "SYNC" : "SYNC " + std::to_string(byte_of(frame, 0));
  }
  if (frame.id == can::kTimeId) {
    const auto time = time::decode(frame);
    return time ? "TIME: " + time_text(*time) : wrong_length(frame, "TIME message");
  }
  if (frame.id == kLssRequest || frame.id == kLssAnswer) {
    return explain_lss(frame, frame.id == kLssRequest);
  }
  switch (id == 0 ? 0 : frame.id - id) {
    case can::kEmcyBase:
      return emcy(frame, id, true);
    case can::kSdoResponseBase:
      return frame.fd() ? usdo(frame, id, false) : sdo(frame, id, false);
    case can::kSdoRequestBase:
      return frame.fd() ? usdo(frame, id, true) : sdo(frame, id, true);
    case can::kErrorControlBase:
      return error_control(frame, id);
    default:
      break;
  }
  if (id != 0 && frame.id >= can::default_tpdo_id(1, 0) && frame.id < can::kSdoResponseBase) {
    const unsigned number = (frame.id - can::default_tpdo_id(1, 0)) / 0x100 + 1;
    const bool transmitted = (frame.id - can::default_tpdo_id(1, 0)) % 0x100 < 0x80;
    return std::string(transmitted ? "TPDO " : "RPDO ") + std::to_string(number) +
           (transmitted ? " of " : " to ") + node(id) + std::string(kIfPredefined);
  }
  return "no identifier of CANopen's pre-defined ones";
}

std::string Explainer::by_known_identifier(const can::Frame& frame) {
  const std::uint32_t key = identifier_key(frame.id, frame.extended());
  std::string out;
  if (const auto found = pdos_.find(key); found != pdos_.end()) {
    for (const Pdo& known : found->second) {
      out += (out.empty() ? "" : " | ") + pdo(frame, known);
    }
    if (std::ranges::count(found->second, true, &Pdo::transmitted) > 1) {
      out += "; these TPDOs have the same COB-ID: the frame is one of them";
    }
  }
  if (const auto found = emcys_.find(key); found != emcys_.end() && !frame.remote()) {
    for (const unsigned id : found->second) {
      out += (out.empty() ? "" : " | ") + emcy(frame, id, false);
    }
  }
  return out;
}

std::string Explainer::explain(const can::Frame& frame) {
  if (std::string known = by_known_identifier(frame); !known.empty()) {
    return known;
  }
  return frame.extended() ? "not one of the known 29-bit identifiers" : by_identifier(frame);
}

}  // namespace linegate::console

// SPDX-License-Identifier: Apache-2.0
#include "tests/plant/silence_model.h"

#include <algorithm>
#include <iomanip>
#include <optional>
#include <sstream>

#include "stack/base/byte_order.h"
#include "stack/can/cob_id.h"
#include "stack/pdo/parameters.h"

#include "tests/plant/output_fields.h"
#include "tests/plant/request_fields.h"
#include "tests/plant/usdo_fields.h"

namespace linegate::plant {
namespace {

constexpr std::uint32_t kLssToMaster = 0x7E4;
constexpr std::uint32_t kLssToSlaves = 0x7E5;
constexpr std::uint32_t kSync = 0x080;
constexpr std::uint32_t kTime = 0x100;
constexpr std::uint16_t kStartup = 0x1F80;

std::uint32_t place(std::uint32_t node, std::uint32_t index, std::uint32_t sub) {
  return node << 24U | index << 8U | sub;
}

std::uint32_t byte_of(const can::Frame& frame, std::size_t at) {
  return std::to_integer<std::uint32_t>(frame.data[at]);
}

// An expedited download of four bytes (CiA 301 7.2.4.3.3), by SDO or USDO.
struct Download {
  std::uint32_t node = 0;
  std::uint32_t index = 0;
  std::uint32_t sub = 0;
  can::CobId cob_id;
};

// Empty for other frames.
std::optional<Download> download_of(const can::Frame& frame) {
  const std::uint32_t node = frame.id - can::kSdoRequestBase;
  if (frame.extended() || frame.remote() || frame.id <= can::kSdoRequestBase ||
      node > can::kMaxNodeId) {
    return std::nullopt;
  }
  if (frame.fd()) {
    const bool is_one = is_usdo(frame, can::kSdoRequestBase) &&
                        usdo_command(frame) == kUsdoDownload &&
                        usdo_data(frame).size() == sizeof(std::uint32_t);
    return is_one ? std::optional(Download{
                        usdo_receiver(frame), usdo_object(frame).index, usdo_object(frame).sub,
                        can::CobId{load_le<std::uint32_t>(usdo_data(frame).data())}})
                  : std::nullopt;
  }
  const bool is_one = frame.length == can::kMaxClassicData && (byte_of(frame, 0) & 0xE2U) == 0x22;
  return is_one ? std::optional(Download{node, load_le<std::uint16_t>(frame.data.data() + 1),
                                         byte_of(frame, 3),
                                         can::CobId{load_le<std::uint32_t>(frame.data.data() + 4)}})
                : std::nullopt;
}

// The restricted ranges of the table in CiA 301 7.3.5.
bool is_restricted_id(std::uint32_t id) {
  constexpr std::array<std::array<std::uint32_t, 2>, 8> kRestricted{{{0x000, 0x000},
                                                                     {0x001, 0x07F},
                                                                     {0x101, 0x180},
                                                                     {0x581, 0x5FF},
                                                                     {0x601, 0x67F},
                                                                     {0x6E0, 0x6FF},
                                                                     {0x701, 0x77F},
                                                                     {0x780, 0x7FF}}};
  return std::ranges::any_of(kRestricted,
                             [id](const auto& range) { return id >= range[0] && id <= range[1]; });
}

// SYNC and TIME have no bit that makes them invalid; the default SDO server is read-only.
bool holds_cob_id(std::uint32_t index, std::uint32_t sub) {
  if (sub == 0) {
    return index == 0x1005 || index == 0x1012 || index == 0x1014;
  }
  const bool sdo = index >= 0x1201 && index <= 0x12FF && (sub == 1 || sub == 2);
  const bool pdo = (index >= 0x1400 && index < 0x1600) || (index >= 0x1800 && index < 0x1A00);
  return sdo || (pdo && sub == 1);
}

// USDO frames are FD frames; NMT, SYNC and error control are as in CANopen.
bool is_of_canopen_fd(const can::Frame& frame) {
  const std::uint32_t service = frame.id & ~std::uint32_t{can::kMaxNodeId};
  const bool usdo = service == can::kSdoRequestBase || service == can::kSdoResponseBase;
  const bool classical =
      frame.id == can::kNmtId || frame.id == kSync || service == can::kErrorControlBase;
  return !frame.remote() && (!usdo || frame.fd()) && (!classical || !frame.fd());
}

std::string text_of(const can::Frame& frame) {
  std::ostringstream out;
  out << std::hex << std::uppercase << std::setfill('0') << std::setw(3) << frame.id << '#';
  for (std::size_t i = 0; i < frame.length && !frame.remote(); ++i) {
    out << std::setw(2) << byte_of(frame, i);
  }
  return out.str();
}

}  // namespace

SilenceModel::SilenceModel(const line::LineConfig& config)
    : fd_(config.canopen_fd), client_(config.node_id) {
  boots_as_master_ = config.role == line::Role::manager;
  for (const line::ObjectValue& value : config.own_values) {
    if (value.address == od::Address{kStartup, 0} && !value.data.empty()) {
      boots_as_master_ &= (value.data.front() & std::byte{1}) != std::byte{0};
    }
  }
  is_master_ = boots_as_master_;
  if (config.role == line::Role::manager || config.devices.empty()) {
    own_[config.node_id] = true;
  }
  for (const line::DeviceConfig& device : config.devices) {
    own_[device.id] = true;
    allow_pdos(device.device, false);
  }
  for (std::uint8_t id = can::kMinNodeId; id <= can::kMaxNodeId; ++id) {
    if (own_[id]) {
      allowed_.set(kSync + id);
      allowed_.set(can::kSdoResponseBase + id);
      allowed_.set(can::kErrorControlBase + id);
    }
    // As SDO manager; the identifier of a USDO request has the node-ID of the client
    allowed_.set(can::kSdoRequestBase + id, boots_as_master_ && (!fd_ || id == client_));
  }
  allowed_.set(kSync, config.sync_period > Duration::zero());
  allowed_.set(kTime, config.time_period > Duration::zero());
  if (config.sleep.exists()) {
    allowed_.set(config.sleep.request);
    allowed_.set(config.sleep.objection);
  }
  allowed_.set(kLssToSlaves, config.lss.assign);
  allowed_.set(kLssToMaster, std::ranges::any_of(config.devices, &line::DeviceConfig::lss));
  for (const line::NodeConfig& node : config.nodes) {
    allow_pdos(node.device, true);
    note_tpdos(node);
  }
  for (const pdo::Parameters& own : config.forwarding.tpdos) {
    allow(own.cob_id);
  }
}

void SilenceModel::allow(const can::CobId& cob_id) {
  if (cob_id.extended()) {
    allowed_extended_.insert(cob_id.id());
  } else {
    allowed_.set(cob_id.id() & 0x7FFU);
  }
}

void SilenceModel::note_tpdos(const line::NodeConfig& node) {
  const Loaded<pdo::DevicePdos> described = pdos_in(node.device, fd_);
  if (!described.ok()) {
    return;
  }
  for (const pdo::Parameters& pdo : described.value->tpdos) {
    tpdos_[{node.id, pdo.number}] = pdo.cob_id.id();
  }
}

// rpdos: allow the RPDOs of a device, which the line sends; else the TPDOs, which the device itself
// sends.
void SilenceModel::allow_pdos(const od::DeviceDescription& device, bool rpdos) {
  const Loaded<pdo::DevicePdos> described = pdos_in(device, fd_);
  if (!described.ok()) {
    return;
  }
  for (const pdo::Parameters& pdo : rpdos ? described.value->rpdos : described.value->tpdos) {
    allow(pdo.cob_id);
  }
}

void SilenceModel::commanded(const line::Command& command) {
  constexpr std::uint16_t kFrameRecord = 0x5F4C;  // of CANopenIA: sends a frame of no service
  const std::uint8_t node = line::node_of(command);
  const od::Address address = address_of(command);
  const auto* const write = as<line::SdoWrite>(command);
  if (write != nullptr && node <= can::kMaxNodeId && own_[node]) {
    if (address.index == kStartup && !write->data.empty() && !fd_) {
      is_master_ = (write->data.front() & std::byte{1}) != std::byte{0};
    }
    if (address.index == kFrameRecord && write->data.size() >= sizeof(std::uint16_t)) {
      allowed_.set(load_le<std::uint16_t>(write->data.data()) & 0x7FFU);
    }
  }
  if (const auto* const control = as<line::NmtRequest>(command)) {
    follow_own_reset(static_cast<std::uint8_t>(control->command), control->node);
  }
  if (write != nullptr || as<line::SdoRead>(command) || as<line::ObjectWrite>(command)) {
    allowed_.set(can::kSdoRequestBase + (fd_ ? client_ : node % 128U));
    commanded_writes_.insert(place(node, address.index, address.sub));
  }
  if (const auto* const send = as<line::CanSend>(command)) {
    allowed_.set(send->frame.id & 0x7FFU);
  }
  if (const auto* const request = as<line::PdoRequest>(command)) {
    const auto found = tpdos_.find({request->node, request->number});
    requested_.set(found != tpdos_.end() ? found->second & 0x7FFU : 0);
  }
  if (as<line::LssRequest>(command) != nullptr) {
    allowed_.set(kLssToSlaves);
  }
}

// A value written to 1F80h is reset.
void SilenceModel::follow_own_reset(std::uint8_t command, std::uint8_t node) {
  const bool to_own = node == 0 || own_[node % own_.size()];
  if (to_own && nmt::is_reset(static_cast<nmt::Command>(command))) {
    is_master_ = boots_as_master_;
  }
}

void SilenceModel::before_receive(const can::Frame& frame) {
  if (frame.extended() || frame.remote()) {
    return;
  }
  if (frame.id == 0 && frame.length == 2) {
    follow_own_reset(static_cast<std::uint8_t>(byte_of(frame, 0)),
                     static_cast<std::uint8_t>(byte_of(frame, 1)));
  }
  // Another node configures the own node.
  const std::optional<Download> download = download_of(frame);
  if (download && download->node < own_.size() && own_[download->node] &&
      holds_cob_id(download->index, download->sub)) {
    allow(download->cob_id);
  }
}

bool SilenceModel::is_of_protocol(const can::Frame& frame) const {
  return fd_ ? is_of_canopen_fd(frame) : !frame.fd();
}

bool SilenceModel::is_allowed(const can::Frame& frame) const {
  if (frame.extended()) {
    return allowed_extended_.contains(frame.id);
  }
  if (frame.remote()) {  // a PDO, or a guarding request
    return requested_.test(frame.id & 0x7FFU) ||
           (boots_as_master_ && frame.id > can::kErrorControlBase &&
            frame.id <= can::kErrorControlBase + can::kMaxNodeId);
  }
  return frame.id < allowed_.size() && allowed_.test(frame.id);
}

std::string SilenceModel::sends(const can::Frame& frame) {
  if (!is_of_protocol(frame)) {
    return "its protocol does not have " + text_of(frame);
  }
  if (frame.id == 0 && !frame.extended()) {
    follow_own_reset(static_cast<std::uint8_t>(byte_of(frame, 0)),
                     static_cast<std::uint8_t>(byte_of(frame, 1)));
    return is_master_ ? std::string()
                      : "it is not NMT master and sends the NMT command " + text_of(frame);
  }
  if (!is_allowed(frame)) {
    return "nothing is configured that sends " + text_of(frame);
  }
  return check_download(frame);
}

std::string SilenceModel::check_download(const can::Frame& frame) const {
  const std::optional<Download> download = download_of(frame);
  if (!download) {
    return {};
  }
  const auto& [node, index, sub, cob_id] = *download;
  const bool has_valid_bit = index != 0x1005 && index != 0x1012;
  if (!holds_cob_id(index, sub) || commanded_writes_.contains(place(node, index, sub)) ||
      (has_valid_bit && !cob_id.valid()) || cob_id.extended() || !is_restricted_id(cob_id.id())) {
    return {};
  }
  return "it writes a valid COB-ID that is restricted: " + text_of(frame);
}

}  // namespace linegate::plant

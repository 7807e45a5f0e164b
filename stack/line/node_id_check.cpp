// SPDX-License-Identifier: Apache-2.0
#include "stack/line/node_id_check.h"

#include <algorithm>
#include <array>

#include "stack/base/time.h"
#include "stack/can/cob_id.h"
#include "stack/line/build.h"
#include "stack/od/objects.h"

namespace linegate::line {
namespace {

// More than one, because a lost frame does not prove that the node-ID is free.
constexpr int kUploads = 2;
constexpr od::Address kDeviceTypeObject{od::objects::kDeviceType, 0};
constexpr std::uint32_t kNodeBits = 0x7F;
// A device has at least this fraction of the upload's time for its response.
constexpr int kInTime = 2;

// Identifiers that a node sends: EMCY, TPDO 1 to 4, responses of its SDO server, error control.
bool is_sent_by_node(std::uint32_t id) {
  switch (id & ~kNodeBits) {
    case 0x080:
    case 0x180:
    case 0x280:
    case 0x380:
    case 0x480:
    case can::kSdoResponseBase:
    case 0x700:
      return (id & kNodeBits) != 0;
    default:
      return false;
  }
}

bool is_upload(const can::Frame& frame) {
  constexpr std::array kRequest{std::byte{0x40}, std::byte{0x00}, std::byte{0x10}, std::byte{0x00}};
  return !frame.extended() && !frame.remote() && (frame.id & ~kNodeBits) == can::kSdoRequestBase &&
         std::equal(kRequest.begin(), kRequest.end(), frame.data.begin());
}

}  // namespace

NodeIdCheck::NodeIdCheck(const LineConfig& config, const Services& services,
                         sdo::TransferOwner& owner, std::span<const pdo::LinkedPdo> inputs)
    : config_(config), services_(services), owner_(owner) {
  const auto note = [this](const can::CobId& cob_id, std::uint8_t node) {
    if (cob_id.valid() && !cob_id.extended() && is_sent_by_node(cob_id.id()) &&
        (cob_id.id() & kNodeBits) != node) {
      of_others_.push_back(cob_id.id());
    }
  };
  for (const pdo::LinkedPdo& input : inputs) {
    note(input.parameters.cob_id, input.node);
  }
  for (const NodeConfig& node : config.nodes) {
    note(emcy_cob_id(node), node.id);
  }
  std::ranges::sort(of_others_);
}

const NodeConfig* NodeIdCheck::find(std::uint8_t node) const {
  const auto found = std::ranges::find(config_.nodes, node, &NodeConfig::id);
  return found != config_.nodes.end() ? &*found : nullptr;
}

bool NodeIdCheck::may_ask() const {
  return services_.host.own_state() != nmt::State::stopped;
}

// The same condition as for the manager's reset at the start of the network.
bool NodeIdCheck::may_reset(const NodeConfig* config) const {
  return config != nullptr && !config->keep_alive && manager_options(config_).reset_nodes;
}

// A stopped node does not answer SDO; only its error control shows whether it is present.
bool NodeIdCheck::is_hidden(std::uint8_t node) const {
  const bool lost = services_.manager.has_error_control(node) &&
                    services_.manager.node(node).presence == Presence::missing;
  return stopped_[node] && !lost;
}

Duration NodeIdCheck::upload_time(const NodeConfig* config) const {
  const bool own = config != nullptr && config->sdo_timeout > Duration::zero();
  return own ? config->sdo_timeout : config_.sdo_timeout;
}

void NodeIdCheck::begin(std::uint8_t node, bool before_boot, Instant now, std::uint32_t client) {
  Check& check = checks_[node];
  if (check.use != Use::unknown) {
    return;
  }
  begun_.push_back(node);
  check.use = Use::checking;
  check.client = client;
  const NodeConfig* const config = find(node);
  Duration time = kUploads * upload_time(config);
  if (before_boot && may_reset(config)) {
    services_.host.send_nmt(nmt::Command::reset_communication, node, now);
    time = std::max(time, config->reset_time);
  } else if (config != nullptr && services_.manager.node(node).presence != Presence::missing) {
    time = std::max(time, consumer_time(*config));
  }
  if (node == config_.node_id || !may_ask() || is_hidden(node)) {
    check.use = node == config_.node_id || may_ask() ? Use::used : Use::cannot_ask;
    return;
  }
  check.time = time;
  check.until = deadline(now, time);
  ask(node, now);
}

void NodeIdCheck::ask(std::uint8_t node, Instant now) {
  Check& check = checks_[node];
  check.upload = ++uploads_;
  check.number = 0;
  check.sent = kNever;
  services_.heartbeats.ask(node);
  if (!services_.sdo.submit({.owner = &owner_,
                             .number = check.upload,
                             .node = node,
                             .address = kDeviceTypeObject,
                             .timeout = upload_time(find(node)),
                             .priority = sdo::Priority::boot,
                             .client = check.client},
                            now)) {
    check.use = Use::cannot_ask;
  }
}

void NodeIdCheck::completed(const sdo::Completion& completion, Instant now) {
  Check& check = checks_[completion.node];
  if (check.use != Use::checking || check.upload != completion.number) {
    return;
  }
  const bool asked =
      check.sent <= now && now - check.sent >= upload_time(find(completion.node)) / kInTime;
  if (completion.abort == AbortCode::none || completion.refused) {
    check.use = Use::used;
  } else if (completion.abort != AbortCode::timeout || !may_ask()) {
    check.use = Use::cannot_ask;
  } else if (asked && now >= check.until) {
    check.use = Use::free;
  } else {
    check.until = asked ? check.until : deadline(now, check.time);
    ask(completion.node, now);
  }
}

void NodeIdCheck::handed_out(const can::Frame& frame, std::uint64_t number, Instant now) {
  const auto node = static_cast<std::uint8_t>(frame.id & kNodeBits);
  if (!is_upload(frame) || checks_[node].use != Use::checking) {
    return;
  }
  if (number == 0) {
    note_sent(node, now);
  } else {
    checks_[node].number = number;
  }
}

void NodeIdCheck::acknowledged(std::uint64_t number, Instant now) {
  for (const std::uint8_t node : begun_) {
    if (checks_[node].number != 0 && checks_[node].number <= number) {
      note_sent(node, now);
    }
  }
}

void NodeIdCheck::lost(std::uint64_t first, std::uint64_t last) {
  for (const std::uint8_t node : begun_) {
    if (checks_[node].number >= first && checks_[node].number <= last) {
      checks_[node].number = 0;
    }
  }
}

void NodeIdCheck::note_sent(std::uint8_t node, Instant now) {
  Check& check = checks_[node];
  check.number = 0;
  check.sent = earlier(check.sent, now);
}

void NodeIdCheck::hear(std::span<const can::Frame> frames) {
  for (const can::Frame& frame : frames) {
    if (frame.extended() || frame.remote() || !is_sent_by_node(frame.id) ||
        std::ranges::binary_search(of_others_, frame.id)) {
      continue;
    }
    Check& check = checks_[frame.id & kNodeBits];
    if (check.use != Use::unknown) {
      check.use = Use::used;
    }
  }
}

void NodeIdCheck::commanded(nmt::Command command, std::uint8_t node) {
  if (node == 0) {
    command == nmt::Command::stop ? stopped_.set() : stopped_.reset();
  } else {
    stopped_.set(node, command == nmt::Command::stop);
  }
}

void NodeIdCheck::end() {
  for (const std::uint8_t node : begun_) {
    if (checks_[node].use == Use::checking) {
      services_.sdo.cancel(owner_, node, checks_[node].upload);
    }
    checks_[node] = {};
  }
  begun_.clear();
}

}  // namespace linegate::line

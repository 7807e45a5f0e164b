// SPDX-License-Identifier: Apache-2.0
#include "stack/manager/startup_objects.h"

#include <array>
#include <optional>

#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/od/objects.h"

namespace linegate::manager {
namespace {

constexpr std::uint8_t kAll = 128;  // sub-index of 1F82h and 1F83h
constexpr std::uint8_t kMissing = 1;

constexpr std::array kIndices{od::objects::kNmtStartup, od::objects::kSlaveAssignment,
                              od::objects::kRequestNmt, od::objects::kRequestGuarding};

std::optional<nmt::Command> command_of(std::uint8_t value) {
  switch (value) {
    case 4:
      return nmt::Command::stop;
    case 5:
      return nmt::Command::start;
    case 6:
      return nmt::Command::reset_node;
    case 7:
      return nmt::Command::reset_communication;
    case 127:
      return nmt::Command::enter_pre_operational;
    default:
      return std::nullopt;
  }
}

}  // namespace

StartupObjects::StartupObjects(od::Dictionary& dictionary, std::uint8_t own_node, Manager& manager,
                               Host& host)
    : dictionary_(dictionary), own_(own_node), manager_(manager), host_(host) {
  for (const std::uint16_t index : kIndices) {
    LINEGATE_ASSERT(dictionary_.set_hook(index, this).ok(), "the object exists");
  }
}

StartupObjects::~StartupObjects() {
  for (const std::uint16_t index : kIndices) {
    LINEGATE_ASSERT(dictionary_.set_hook(index, nullptr).ok(), "the object exists");
  }
}

bool StartupObjects::wants_manager() const {
  const std::uint64_t value = dictionary_.number({od::objects::kNmtStartup, 0}).value_or(0);
  return kept_role_.value_or((value & startup::kMaster) != 0);
}

AbortCode StartupObjects::before_read(od::Address address, const od::Variable& variable) {
  if (address.sub == 0) {
    return AbortCode::none;
  }
  if (address.index == od::objects::kRequestNmt) {
    *variable.data = std::byte{state_of(address.sub)};
  } else if (address.index == od::objects::kRequestGuarding) {
    const bool watched = address.sub < kAll && manager_.node(address.sub).heartbeat_monitored;
    *variable.data = std::byte{watched};
  }
  return AbortCode::none;
}

std::uint8_t StartupObjects::state_of(std::uint8_t node) const {
  if (node >= kAll) {
    return 0;
  }
  if (node == own_) {
    return static_cast<std::uint8_t>(host_.own_state());
  }
  const NodeState& state = manager_.node(node);
  if (state.presence == Presence::missing) {
    return kMissing;
  }
  return state.state == nmt::State::unknown ? std::uint8_t{0}
                                            : static_cast<std::uint8_t>(state.state);
}

AbortCode StartupObjects::check_write(od::Address address, std::span<const std::byte> value) {
  const auto number = static_cast<std::uint32_t>(load_le(value));
  switch (address.index) {
    case od::objects::kNmtStartup:
      return check_startup(number);
    case od::objects::kSlaveAssignment:
      return address.sub == own_ && (number & assignment::kListed) != 0 ? AbortCode::invalid_value
                                                                        : AbortCode::none;
    default:
      return check_request(address, static_cast<std::uint8_t>(number));
  }
}

AbortCode StartupObjects::check_startup(std::uint32_t value) const {
  const bool flies = (value & startup::kFlyingMaster) != 0;
  const bool manager = (value & startup::kMaster) != 0;
  const bool can_fly =
      dictionary_.number({od::objects::kFlyingMasterTiming, 0}).has_value() && manager;
  const bool good = (value & ~(startup::kSupported | startup::kFlyingMaster)) == 0;
  const bool stays = kept_role_.value_or(manager) == manager;
  return good && stays && (can_fly || !flies) ? AbortCode::none : AbortCode::invalid_value;
}

AbortCode StartupObjects::check_request(od::Address address, std::uint8_t value) const {
  if (!manager_.active()) {
    return AbortCode::local_control;
  }
  const bool listed =
      address.sub == kAll || (address.sub < kAll && manager_.node(address.sub).configured);
  if (address.index == od::objects::kRequestNmt) {
    return command_of(value) && (listed || address.sub == own_) ? AbortCode::none
                                                                : AbortCode::invalid_value;
  }
  const bool possible =
      value == 0 ||
      (value == 1 && (address.sub == kAll || manager_.has_error_control(address.sub)));
  return listed && possible ? AbortCode::none : AbortCode::invalid_value;
}

void StartupObjects::written(od::Address address) {
  const auto value = static_cast<std::uint8_t>(dictionary_.number(address).value_or(0));
  if (address.index == od::objects::kSlaveAssignment) {
    manager_.list_changed(address.sub);
  } else if (address.index == od::objects::kRequestNmt ||
             address.index == od::objects::kRequestGuarding) {
    requests_.push_back({address, value});
  }
}

void StartupObjects::advance(Instant now, std::uint32_t client) {
  for (const Request& request : std::exchange(requests_, {})) {
    if (request.address.index == od::objects::kRequestGuarding) {
      watch(request, now);
    } else {
      send(request, now, client);
    }
  }
}

void StartupObjects::watch(const Request& request, Instant now) {
  if (!manager_.active()) {
    return;  // another node is the master since it was written
  }
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    if (request.address.sub == kAll || request.address.sub == node) {
      manager_.watch(node, request.value != 0, now);
    }
  }
}

void StartupObjects::send(const Request& request, Instant now, std::uint32_t client) {
  const auto command = command_of(request.value);
  if (!command) {
    return;
  }
  if (request.address.sub == own_) {
    host_.command_own(*command, now);
    if (nmt::is_reset(*command)) {
      manager_.own_reset(client);
    }
    return;
  }
  if (!manager_.active()) {
    return;  // 1F80h was written meanwhile
  }
  const std::uint8_t node = request.address.sub == kAll ? std::uint8_t{0} : request.address.sub;
  host_.send_nmt(*command, node, now);
  manager_.commanded(*command, node, now, client);
}

}  // namespace linegate::manager

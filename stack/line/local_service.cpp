// SPDX-License-Identifier: Apache-2.0
#include "stack/line/local_service.h"

#include <algorithm>
#include <array>
#include <utility>

#include "stack/line/command_checks.h"

namespace linegate::line {
namespace {

Error error_of(AbortCode code) {
  return code == AbortCode::none ? Error{} : to_error(code);
}

}  // namespace

std::span<const CommandKind> LocalService::commands() const {
  static constexpr std::array kCommands{CommandKind::local_read, CommandKind::local_write,
                                        CommandKind::object_create};
  return kCommands;
}

void LocalService::execute(Command command, Instant now) {
  if (command.kind == CommandKind::local_read) {
    read(command);
  } else if (command.kind == CommandKind::local_write) {
    write(std::move(command));
  } else {
    host().answer(command, create_object(command), {}, now);
  }
}

void LocalService::read(const Command& command) {
  const bool of_node =
      (command.code & kListObjects) != 0 && command.node != 0 && command.node != config_.node_id;
  std::vector<std::byte> data;
  const Error error =
      of_node ? list_device_file(command, data) : read_object(dictionary_, command, data);
  host().reply(command.tag, error, std::move(data));
}

void LocalService::write(Command command) {
  od::Ticket ticket = 0;
  const OwnObjects::OwnWrites by_itself(own_objects_);
  const AbortCode code = dictionary_.write({command.index, command.sub}, command.data, ticket);
  if (code == od::kLater) {
    writes_.push_back({ticket, command.tag, std::move(command.data)});
  } else {
    host().reply(command.tag, error_of(code), {});
  }
}

Error LocalService::list_device_file(const Command& command, std::vector<std::byte>& data) const {
  const auto found = std::ranges::find(config_.nodes, command.node, &NodeConfig::id);
  if (found == config_.nodes.end() || found->device.objects.empty()) {
    return to_error(Refusal::bad_request);
  }
  data = list_objects(found->device, command.index, last_of_list(command));
  return {};
}

Error LocalService::create_object(const Command& command) {
  if (command.code == kRemoveObject) {
    return own_objects_.remove(dictionary_, command.index);
  }
  auto object = decode_own_object(command);
  if (command.code != kCreateObject || !object) {
    return to_error(Refusal::bad_request);
  }
  return own_objects_.create(dictionary_, *std::move(object));
}

void LocalService::advance(Instant /*now*/) {
  std::erase_if(writes_, [this](const Write& write) {
    if (!dictionary_.outcome(write.ticket)) {
      return false;
    }
    host().reply(write.tag, error_of(dictionary_.finish_write(write.ticket, write.data)), {});
    return true;
  });
}

void LocalService::end(Refusal why, Instant /*now*/) {
  for (const Write& write : std::exchange(writes_, {})) {
    dictionary_.cancel(write.ticket);
    host().reply(write.tag, to_error(why), {});
  }
}

}  // namespace linegate::line

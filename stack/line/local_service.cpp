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
  if (const auto* const read_request = std::get_if<LocalRead>(&command.request)) {
    read(command.tag, *read_request);
  } else if (auto* const write_request = std::get_if<LocalWrite>(&command.request)) {
    write(command.tag, std::move(*write_request));
  } else {
    auto& create = std::get<ObjectCreate>(command.request);
    host().answer(command, create_object(std::move(create)), {}, now);
  }
}

void LocalService::read(std::uint64_t tag, const LocalRead& request) {
  const auto* const range = std::get_if<ObjectRange>(&request.what);
  const bool of_node = range != nullptr && request.node != 0 && request.node != config_.node_id;
  ReplyData data;
  const Error error = of_node ? list_device_file(request.node, *range, data)
                              : read_object(dictionary_, request.what, data);
  host().reply(tag, error, std::move(data));
}

void LocalService::write(std::uint64_t tag, LocalWrite request) {
  od::Ticket ticket = 0;
  const OwnObjects::OwnWrites by_itself(own_objects_);
  const AbortCode code = dictionary_.write(request.address, request.data, ticket);
  if (code == od::kLater) {
    writes_.push_back({ticket, tag, std::move(request.data)});
  } else {
    host().reply(tag, error_of(code), {});
  }
}

Error LocalService::list_device_file(std::uint8_t node, ObjectRange range, ReplyData& data) const {
  const auto found = std::ranges::find(config_.nodes, node, &NodeConfig::id);
  if (found == config_.nodes.end() || found->device.objects.empty()) {
    return to_error(Refusal::bad_request);
  }
  data = list_objects(found->device, range);
  return {};
}

Error LocalService::create_object(ObjectCreate request) {
  if (const auto* const removal = std::get_if<ObjectRemoval>(&request.what)) {
    return own_objects_.remove(dictionary_, removal->index);
  }
  return own_objects_.create(dictionary_, std::move(std::get<OwnObject>(request.what)));
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

// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/client_directory.h"

#include <algorithm>

#include "gateway/publish/foreign_text.h"

namespace linegate::gateway {

std::uint32_t ClientDirectory::number(const ClientIdentity& from, std::string_view name) {
  const std::lock_guard lock(mutex_);
  auto known = clients_.find(from.id);
  if (known == clients_.end()) {
    if (clients_.size() >= kMost) {
      clients_.erase(std::ranges::min_element(
          clients_, {}, [](const auto& client) { return client.second.used; }));
    }
    known = clients_.try_emplace(from.id).first;
    known->second.number = ++numbers_;
  }
  Client& client = known->second;
  client.used = ++requests_;
  if (client.name != name) {
    client.name = name;
  }
  if (client.host != from.host) {
    client.host = from.host;
  }
  if (client.subject != from.subject) {
    client.subject = from.subject;
  }
  return client.number;
}

std::string ClientDirectory::name(std::uint32_t number) const {
  const std::lock_guard lock(mutex_);
  const auto known = std::ranges::find_if(
      clients_, [number](const auto& client) { return client.second.number == number; });
  return known == clients_.end() ? std::string() : known->second.name;
}

std::string ClientDirectory::describe(std::uint32_t number) const {
  const std::lock_guard lock(mutex_);
  const auto known = std::ranges::find_if(
      clients_, [number](const auto& client) { return client.second.number == number; });
  if (known == clients_.end()) {
    return "client " + std::to_string(number);
  }
  const Client& client = known->second;
  const std::string name = printable(client.name.empty() ? "a client" : client.name);
  const std::string at = client.host.empty() ? name : name + " at " + printable(client.host);
  return client.subject.empty() ? at : printable(client.subject) + " (" + at + ")";
}

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
// Access to the objects 1F80h to 1F83h (CiA 302-2): refusals and requests. 1F84h to 1F8Ah and 102Ah
// are plain values, see network_list.h.
//
//   1F80h  reserved bits are refused; bit 0 switches between manager and device; bit 5 (flying
//          master) needs bit 0 and the object 1F90h, and makes the active master the manager
//   1F81h  the own node cannot be listed
//   1F82h  write: 4 stop, 5 start, 6 reset node, 7 reset communication, 127 enter
//          pre-operational, for node n, or with sub-index 128 for all except the own node. Read:
//          0 unknown, 1 missing, 4, 5 or 127
//   1F83h  write: 1 monitor the error control of node n, or of all with 128, 0 end this. Read: 1 =
//          it is monitored
//
// Refused with 0800 0021h while the own node is not the manager (1F82h, 1F83h), else with 0609
// 0030h.
#pragma once

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "stack/manager/host.h"
#include "stack/manager/manager.h"
#include "stack/od/dictionary.h"
#include "stack/od/hook.h"

namespace linegate::manager {

class StartupObjects final : public od::Hook {
 public:
  // dictionary has network_objects(); all references must outlive this object.
  StartupObjects(od::Dictionary& dictionary, std::uint8_t own_node, Manager& manager, Host& host);
  ~StartupObjects() override;
  StartupObjects(const StartupObjects&) = delete;
  StartupObjects& operator=(const StartupObjects&) = delete;

  // Carries out pending requests. client: whose they are, see sdo::Pace; 0: nobody's.
  void advance(Instant now, std::uint32_t client = 0);
  Instant next_wake() const { return requests_.empty() ? kNever : Instant{}; }

  // The own node keeps this role: a write of the other value of 1F80h bit 0 is refused, and a
  // stored one has no effect.
  void keep_role(bool manager) { kept_role_ = manager; }
  // 1F80h bit 0: the own node is to be the manager; with bit 5 when it is the active master.
  bool wants_manager() const;

  AbortCode before_read(od::Address address, const od::Variable& variable) override;
  AbortCode check_write(od::Address address, std::span<const std::byte> value) override;
  void written(od::Address address) override;

 private:
  struct Request {
    od::Address address;
    std::uint8_t value = 0;
  };

  AbortCode check_startup(std::uint32_t value) const;
  AbortCode check_request(od::Address address, std::uint8_t value) const;
  std::uint8_t state_of(std::uint8_t node) const;
  void watch(const Request& request, Instant now);
  void send(const Request& request, Instant now, std::uint32_t client);

  od::Dictionary& dictionary_;
  std::uint8_t own_;
  std::optional<bool> kept_role_;  // manager
  Manager& manager_;
  Host& host_;
  std::vector<Request> requests_;
};

}  // namespace linegate::manager

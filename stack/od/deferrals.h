// SPDX-License-Identifier: Apache-2.0
// The accesses to a dictionary that wait for a hook; private to stack/od. There are few at a time:
// at most one for each SDO server.
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "stack/od/hook.h"

namespace linegate::od {

class Deferrals {
 public:
  struct Waiting {
    Ticket ticket = 0;
    Address address;
    Hook* hook = nullptr;  // to be told when it is cancelled
    std::optional<AbortCode> outcome;
  };

  // Tells the hook.
  Ticket begin(Address address, Hook& hook);
  // False if no access waits under this ticket, or it was completed before.
  bool complete(Ticket ticket, AbortCode why);
  std::optional<AbortCode> outcome(Ticket ticket) const;
  // The access is over; nothing if it is unknown.
  std::optional<Waiting> take(Ticket ticket);
  // Those that wait for this hook (any if nullptr) at this object get why instead.
  void refuse(std::uint16_t index, const Hook* hook, AbortCode why);

 private:
  std::vector<Waiting> waiting_;
  Ticket last_ = 0;
};

}  // namespace linegate::od

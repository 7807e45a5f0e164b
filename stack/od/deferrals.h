// SPDX-License-Identifier: Apache-2.0
// Accesses to a dictionary that wait for a hook; private to stack/od. Their number is small: at
// most one for each SDO server.
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
    Hook* hook = nullptr;  // informed if the access is cancelled
    std::optional<AbortCode> outcome;
  };

  // Calls put_off() of the hook.
  Ticket begin(Address address, Hook& hook);
  // Returns false if no access waits with this ticket, or it was already completed.
  bool complete(Ticket ticket, AbortCode why);
  std::optional<AbortCode> outcome(Ticket ticket) const;
  // Ends the wait and returns it; nothing if the ticket is unknown.
  std::optional<Waiting> take(Ticket ticket);
  // Refuses the accesses to this object that wait for this hook (for any hook if nullptr), with the
  // reason why.
  void refuse(std::uint16_t index, const Hook* hook, AbortCode why);

 private:
  std::vector<Waiting> waiting_;
  Ticket last_ = 0;
};

}  // namespace linegate::od

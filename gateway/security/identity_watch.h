// SPDX-License-Identifier: Apache-2.0
// When a participant must be made again, because Fast DDS 2.9.1 reads revoked.crl and checks
// certificates only when a participant starts, or authenticates another one: after revoked.crl has
// changed, or a certificate of another participant has expired.
#pragma once

#include <chrono>
#include <ctime>
#include <string>

#include "gateway/security/files.h"
#include "stack/base/time.h"

namespace linegate::security {

class IdentityWatch {
 public:
  // An identity loses its access at most kPeriod + kPause after the change, plus the time that a
  // new participant needs to start. The pause joins changes that follow each other.
  static constexpr Duration kPeriod = std::chrono::seconds(5);
  static constexpr Duration kPause = std::chrono::seconds(20);

  // files: of the identity of the participant, which is created next.
  explicit IdentityWatch(Files files);

  // Why the participant must be made again; empty: it need not be. A list that is missing,
  // incomplete, or not signed by the authority is ignored: a participant would not start with it.
  // utc: the present time. next_expiry: of the certificates of the other participants, 0: none.
  // From one thread at a time.
  std::string due(Instant now, std::time_t utc, std::time_t next_expiry);
  // It is made again, for the reason that due() returned last.
  void note_replaced(Instant now);

 private:
  std::string read() const;

  const Files files_;
  std::string used_;  // SHA-256 of the list that the participant has; empty: unknown
  std::string seen_;  // of the newest list
  bool was_replaced_ = false;
  Instant replaced_{};
  bool was_read_ = false;
  Instant read_at_{};
};

}  // namespace linegate::security

// SPDX-License-Identifier: Apache-2.0
// Checks the structure of DDS-Security submessages (DDS-Security 1.1 7.3.6, 9.5.2.3). Fast
// DDS 2.9.1 uses the lengths in them without comparing them with the size of the datagram, and
// before it checks any authenticity: a datagram from any host aborts the process.
#pragma once

#include "bridges/dds/guard/reason.h"
#include "bridges/dds/guard/submessages.h"

namespace linegate::dds::guard {

// Processes the submessages of one datagram in order.
class Protection {
 public:
  // required: the governance of the domain protects RTPS messages. Then only the submessages for
  // discovery before authentication and for the handshake may be unprotected.
  explicit Protection(bool required) : required_(required) {}

  // content: result of check() in submessages.h.
  Reason next(const Submessage& submessage, const Content& content);
  // Call it after the last submessage.
  Reason end() const {
    return message_ == Part::inside || submessage_ != Part::none ? Reason::protection
                                                                 : Reason::none;
  }

 private:
  enum class Part { none, inside, after };  // position relative to a prefix and its postfix

  bool prefix(const Submessage& submessage);
  bool body(const Submessage& submessage);
  bool postfix(const Submessage& submessage);
  Reason plain(const Submessage& submessage, const Content& content);

  bool required_;
  bool first_ = true;             // no submessage was processed
  bool whole_body_ = false;       // SEC_BODY was processed as the body of the message
  Part message_ = Part::none;     // SRTPS_PREFIX: inside; SRTPS_POSTFIX: after
  Part submessage_ = Part::none;  // SEC_PREFIX: inside; its body: after; SEC_POSTFIX: none
};

}  // namespace linegate::dds::guard

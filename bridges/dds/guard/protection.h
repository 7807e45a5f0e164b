// SPDX-License-Identifier: Apache-2.0
// The structure of DDS-Security submessages (DDS-Security 1.1 7.3.6, 9.5.2.3). Fast DDS 2.9.1 reads
// lengths within them without comparing them with what was received, before it has checked any
// authenticity: a datagram of anybody ends the process.
#pragma once

#include "bridges/dds/guard/reason.h"
#include "bridges/dds/guard/submessages.h"

namespace linegate::dds::guard {

// Follows the submessages of one datagram in their order.
class Protection {
 public:
  // required: the governance of the domain protects RTPS messages. Plain are then only what
  // discovery before authentication and the handshake need.
  explicit Protection(bool required) : required_(required) {}

  // content: as check() of submessages.h gave it.
  Reason next(const Submessage& submessage, const Content& content);
  // After the last submessage.
  Reason end() const {
    return message_ == Part::inside || submessage_ != Part::none ? Reason::protection
                                                                 : Reason::none;
  }

 private:
  enum class Part { none, inside, after };  // of what a prefix begins and a postfix ends

  bool prefix(const Submessage& submessage);
  bool body(const Submessage& submessage);
  bool postfix(const Submessage& submessage);
  Reason plain(const Submessage& submessage, const Content& content);

  bool required_;
  bool first_ = true;             // no submessage came before
  bool whole_body_ = false;       // SEC_BODY as the body of the message has come
  Part message_ = Part::none;     // SRTPS_PREFIX: inside; SRTPS_POSTFIX: after
  Part submessage_ = Part::none;  // SEC_PREFIX: inside; its body: after; SEC_POSTFIX: none
};

}  // namespace linegate::dds::guard

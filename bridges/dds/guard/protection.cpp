// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/protection.h"

namespace linegate::dds::guard {
namespace {

constexpr std::size_t kCryptoHeader = 20;  // transform kind and key, session, vector suffix
constexpr std::size_t kMac = 16;
constexpr std::size_t kReceiverMac = 20;  // key ID, MAC

// Lengths and counts of DDS-Security are big endian in both octet orders (9.5.2.3.3).
Wire big_endian(const Submessage& it) {
  return {it.body.octets(), false};
}

// CryptoContent: length, that number of octets, padding.
bool content_fits(const Submessage& it) {
  const Wire body = big_endian(it);
  return body.size() >= 4 && align4(std::size_t{body.u32(0)} + 4) == align4(body.size());
}

// CryptoFooter: common MAC, count, receiver-specific MACs.
bool footer_fits(const Submessage& it) {
  const Wire body = big_endian(it);
  return body.size() >= kMac + 4 && body.u32(kMac) <= (body.size() - kMac - 4) / kReceiverMac;
}

// The end of a participant is not accepted unprotected: any host could send it (CVE-2023-50257).
// The participant is removed when its lease expires.
bool is_discovery(const Submessage& it, const Content& content) {
  if (it.kind != Kind::data || !content.has_data || content.ends_instance)
    return false;
  return content.writer == entity::kParticipants || content.writer == entity::kStateless;
}

}  // namespace

bool Protection::prefix(const Submessage& it) {
  if (it.body.size() < kCryptoHeader || submessage_ != Part::none || message_ == Part::after)
    return false;
  if (it.kind == Kind::sec_prefix) {
    submessage_ = Part::inside;
    return true;
  }
  if (!first_)
    return false;
  message_ = Part::inside;
  return true;
}

bool Protection::body(const Submessage& it) {
  if (!content_fits(it))
    return false;
  if (submessage_ == Part::inside) {
    submessage_ = Part::after;
    return true;
  }
  if (submessage_ == Part::after || message_ != Part::inside || whole_body_)
    return false;
  whole_body_ = true;
  return true;
}

bool Protection::postfix(const Submessage& it) {
  if (!footer_fits(it))
    return false;
  if (it.kind == Kind::sec_postfix) {
    const bool follows = submessage_ == Part::after;
    submessage_ = Part::none;
    return follows;
  }
  const bool follows = message_ == Part::inside && submessage_ == Part::none;
  message_ = Part::after;
  return follows;
}

// A signed submessage is between a prefix and a postfix.
Reason Protection::plain(const Submessage& it, const Content& content) {
  if (submessage_ == Part::after)
    return Reason::protection;
  if (submessage_ == Part::inside) {
    submessage_ = Part::after;
    return Reason::none;
  }
  if (!required_ || message_ == Part::inside)
    return Reason::none;
  const bool allowed = it.kind == Kind::info_ts || it.kind == Kind::info_dst ||
                       it.kind == Kind::statistics || is_discovery(it, content);
  return allowed ? Reason::none : Reason::unprotected;
}

Reason Protection::next(const Submessage& it, const Content& content) {
  bool ok = false;
  switch (it.kind) {
    case Kind::sec_prefix:
    case Kind::srtps_prefix:
      ok = prefix(it);
      break;
    case Kind::sec_body:
      ok = body(it);
      break;
    case Kind::sec_postfix:
    case Kind::srtps_postfix:
      ok = postfix(it);
      break;
    default:
      first_ = false;
      return plain(it, content);
  }
  first_ = false;
  return ok && !it.open_end ? Reason::none : Reason::protection;
}

}  // namespace linegate::dds::guard

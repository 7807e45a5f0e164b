// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/guard/submessages.h"

namespace linegate::dds::guard {
namespace {

constexpr std::size_t kSubmessageHeader = 4;
constexpr std::uint8_t kInlineQos = 0x02;  // DATA, DATA_FRAG
constexpr std::uint8_t kData = 0x04;       // DATA
constexpr std::uint8_t kKey = 0x08;        // DATA; DATA_FRAG has it at 04h

bool is_number(Number number) {
  return number >= 1 && number <= kLastNumber;
}

// A SequenceNumberSet or FragmentNumberSet: numBits at `bits_at`, bitmap, then `after` octets.
bool set_fits(const Wire& body, std::size_t bits_at, std::size_t after) {
  const std::uint32_t bits = body.u32(bits_at);
  return bits <= kSetBits && body.size() >= bits_at + 4 + (bits + 31) / 32 * 4 + after;
}

// ACKNACK: reader, writer, readerSNState, count. A preemptive one has base 0 and no bits.
Reason check_acknack(const Wire& body, Content& out) {
  if (body.size() < 24)
    return Reason::submessage;
  out.reader = body.entity(0);
  out.writer = body.entity(4);
  if (!set_fits(body, 16, 4))
    return Reason::sequence_set;
  const Number base = body.number(8);
  out.first = base;
  if (base == 0 && body.u32(16) == 0)
    return Reason::none;
  return is_number(base) ? Reason::none : Reason::sequence_number;
}

// HEARTBEAT: reader, writer, firstSN, lastSN, count. lastSN is firstSN - 1 if there is no sample.
Reason check_heartbeat(const Wire& body, Content& out) {
  if (body.size() < 28)
    return Reason::submessage;
  const Number first = body.number(8);
  const Number last = body.number(16);
  if (!is_number(first) || last < first - 1 || last > kLastNumber)
    return Reason::sequence_number;
  out.reader = body.entity(0);
  out.writer = body.entity(4);
  out.highest = last;
  return Reason::none;
}

// GAP: reader, writer, gapStart, gapList.
Reason check_gap(const Wire& body, Content& out) {
  if (body.size() < 28)
    return Reason::submessage;
  const Number start = body.number(8);
  const Number base = body.number(16);
  if (!is_number(start) || !is_number(base) || base < start)
    return Reason::sequence_number;
  if (!set_fits(body, 24, 0))
    return Reason::sequence_set;
  out.reader = body.entity(0);
  out.writer = body.entity(4);
  out.highest = base - 1 + body.u32(24);
  out.first = start;
  out.listed = out.highest - start + 1;
  return Reason::none;
}

// NACK_FRAG: reader, writer, writerSN, fragmentNumberState, count.
Reason check_nack_frag(const Wire& body, Content& out) {
  if (body.size() < 28)
    return Reason::submessage;
  out.reader = body.entity(0);
  out.writer = body.entity(4);
  if (!is_number(body.number(8)))
    return Reason::sequence_number;
  return body.u32(16) != 0 && set_fits(body, 20, 4) ? Reason::none : Reason::sequence_set;
}

// HEARTBEAT_FRAG: reader, writer, writerSN, lastFragmentNum, count.
Reason check_heartbeat_frag(const Wire& body, Content& out) {
  if (body.size() < 24)
    return Reason::submessage;
  out.reader = body.entity(0);
  out.writer = body.entity(4);
  if (!is_number(body.number(8)))
    return Reason::sequence_number;
  return body.u32(16) != 0 ? Reason::none : Reason::fragment;
}

// The common part of DATA and DATA_FRAG: extraFlags, octetsToInlineQos, reader, writer, writerSN.
// `fixed`: octets of the fixed part. Sets out.payload.
Reason check_sample(const Submessage& it, std::size_t fixed, Content& out) {
  const Wire& body = it.body;
  if (body.size() < fixed)
    return Reason::submessage;
  const std::size_t skip = body.u16(2);  // counted from the end of octetsToInlineQos
  if (skip < fixed - 4 || skip > body.size() - 4)
    return Reason::submessage;
  out.reader = body.entity(4);
  out.writer = body.entity(8);
  out.highest = body.number(12);
  if (!is_number(out.highest))
    return Reason::sequence_number;
  std::size_t at = 4 + skip;
  if ((it.flags & kInlineQos) != 0) {
    const InlineQos qos = read_inline_qos(body.from(at));
    if (qos.length == 0)
      return Reason::parameters;
    out.inline_qos = body.part(at, qos.length);
    out.ends_instance = qos.ends_instance;
    out.key = qos.key;
    out.instance = qos.instance;
    at += qos.length;
  }
  out.is_sample = true;
  out.payload = body.from(at);
  return Reason::none;
}

Reason check_data(const Submessage& it, Content& out) {
  const Reason reason = check_sample(it, 20, out);
  if (reason != Reason::none)
    return reason;
  const std::uint8_t what = it.flags & (kData | kKey);
  if (what == (kData | kKey))
    return Reason::submessage;
  if (what != 0 && out.payload.size() < 4)  // encapsulation header
    return Reason::submessage;
  out.has_data = what == kData;
  out.has_key = what == kKey;
  return Reason::none;
}

// After the common part: fragmentStartingNum, fragmentsInSubmessage, fragmentSize, sampleSize. The
// payload consists of all these fragments; the last one of the sample may be shorter. Fast
// DDS 2.9.1 rounds fragmentSize to 4 octets.
Reason check_data_frag(const Submessage& it, Content& out) {
  const Reason reason = check_sample(it, 32, out);
  if (reason != Reason::none)
    return reason;
  const std::uint64_t first = it.body.u32(20);
  const std::uint64_t count = it.body.u16(24);
  const std::uint64_t size = it.body.u16(26);
  const std::uint64_t sample = it.body.u32(28);
  if (first == 0 || count == 0 || size < 4 || size % 4 != 0 || sample <= size ||
      sample > kMaxSample)
    return Reason::fragment;
  if (first + count - 1 > (sample + size - 1) / size)
    return Reason::fragment;
  const std::uint64_t wanted = std::min(count * size, sample - (first - 1) * size);
  if (out.payload.size() < wanted || out.payload.size() > align4(wanted))
    return Reason::fragment;
  out.payload = {};
  out.fragments = {it.body.u32(28), it.body.u16(26), it.body.u32(20), it.body.u16(24), wanted};
  return Reason::none;
}

}  // namespace

bool has_header(Octets datagram) {
  return datagram.size() >= kHeader && datagram[0] == 'R' && datagram[1] == 'T' &&
         datagram[2] == 'P' && datagram[3] == 'S' && datagram[4] == 2;
}

Reason split(Octets datagram, std::size_t at, Submessage& out) {
  const std::size_t left = datagram.size() - at;
  if (left < kSubmessageHeader)
    return Reason::submessage;
  out.kind = static_cast<Kind>(datagram[at]);
  out.flags = datagram[at + 1];
  out.at = at;
  const bool little = (out.flags & 1U) != 0;
  const Wire rest(datagram.subspan(at), little);
  std::size_t length = rest.u16(2);
  const std::size_t most = left - kSubmessageHeader;
  out.open_end = length == 0 && out.kind != Kind::pad && out.kind != Kind::info_ts;
  if (out.open_end)
    length = most;
  if (length > most || (length < most && length % 4 != 0))
    return Reason::submessage;
  out.body = rest.part(kSubmessageHeader, length);
  return Reason::none;
}

Reason check(const Submessage& it, Content& out) {
  const auto at_least = [&](std::size_t size) {
    return it.body.size() >= size ? Reason::none : Reason::submessage;
  };
  switch (it.kind) {
    case Kind::acknack:
      return check_acknack(it.body, out);
    case Kind::heartbeat:
      return check_heartbeat(it.body, out);
    case Kind::gap:
      return check_gap(it.body, out);
    case Kind::nack_frag:
      return check_nack_frag(it.body, out);
    case Kind::heartbeat_frag:
      return check_heartbeat_frag(it.body, out);
    case Kind::data:
      return check_data(it, out);
    case Kind::data_frag:
      return check_data_frag(it, out);
    case Kind::info_ts:
      return at_least((it.flags & kInvalidate) != 0 ? 0 : 8);
    case Kind::info_src:
      return at_least(20);
    case Kind::info_dst:
      return at_least(12);
    default:
      return Reason::none;
  }
}

}  // namespace linegate::dds::guard

// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/port_codec.h"

#include <algorithm>
#include <array>
#include <string>
#include <utility>

#include "bridges/dds/message_link.h"
#include "bridges/request/field_bytes.h"
#include "stack/base/assert.h"
#include "stack/base/byte_order.h"
#include "stack/base/short_text.h"

namespace linegate::dds {
namespace {

using request::FieldReader;
using request::FieldWriter;

constexpr std::size_t kTextLength = 2;  // octets of the length of a text
constexpr std::size_t kLongestText = 1'024;
constexpr std::size_t kTopicNumber = 4;  // octets of the number of a named topic
static_assert(std::tuple_size_v<decltype(Participant::prefix)> + 4 + kLongestHost + 8 +
                  kLongestSubject ==
              kSenderBytes);

FieldWriter begin_message(std::uint8_t kind) {
  FieldWriter out;
  out.number(kind, kMessageHead);
  return out;
}

FieldReader content_of(PortBytes message) {
  const bool has_head = kind_of(message) != 0;
  FieldReader in(has_head ? message.subspan(kMessageHead) : PortBytes());
  in.require(has_head);
  return in;
}

// What the process of the endpoints needs of it: the gateway checks the holders.
template <class SecurityOptions>
auto texts_of(SecurityOptions& of) {
  return std::array{&of.ca,          &of.certificate,      &of.key, &of.governance, &of.permissions,
                    &of.revocations, &of.request_partition};
}

void add_text(std::string_view text, FieldWriter& out) {
  out.sized(short_text(text, kLongestText), kTextLength);
}

std::string read_text(FieldReader& in, std::size_t longest) {
  std::string out = in.text(kTextLength);
  in.require(out.size() <= longest);
  return out;
}

// A name as peer_gateways.h takes it from that of a participant.
std::string read_gateway(FieldReader& in) {
  std::string out = read_text(in, kLongestName);
  in.require(!out.empty() && out.find_first_of(" /,") == std::string::npos);
  return out;
}

template <class Value>
std::optional<Value> if_complete(const FieldReader& in, Value value) {
  return in.complete() ? std::optional(std::move(value)) : std::nullopt;
}

void encode_text(std::uint8_t kind, std::string_view text, PortMessage& out) {
  FieldWriter writer = begin_message(kind);
  add_text(text, writer);
  out = writer.take();
}

}  // namespace

bool EndpointStatus::operator==(const EndpointStatus& other) const {
  const auto members = [](const EndpointStatus& of) {
    return std::tuple(of.discovery.participants, of.discovery.most, of.discovery.discovered,
                      of.discovery.gone, of.guard.endpoints, of.guard.received, of.guard.dropped,
                      of.failed, of.namesakes, of.next_expiry);
  };
  return members(*this) == members(other) && other_gateways == other.other_gateways;
}

std::uint8_t kind_of(PortBytes message) {
  const auto is_zero = [](std::byte octet) { return octet == std::byte{0}; };
  if (message.size() < kMessageHead ||
      !std::ranges::all_of(message.subspan(1, kMessageHead - 1), is_zero)) {
    return 0;
  }
  return std::to_integer<std::uint8_t>(message.front());
}

void encode(ToEndpoints kind, std::string_view text, PortMessage& out) {
  encode_text(static_cast<std::uint8_t>(kind), text, out);
}

void encode(FromEndpoints kind, std::string_view text, PortMessage& out) {
  encode_text(static_cast<std::uint8_t>(kind), text, out);
}

std::optional<std::string> decode_text(PortBytes message, std::size_t longest) {
  FieldReader in = content_of(message);
  std::string out = read_text(in, longest);
  return if_complete(in, std::move(out));
}

namespace {

// length 4, and the octets, with zeros up to `longest`
void add_padded(std::string_view text, std::size_t longest, FieldWriter& out) {
  const std::string_view cut = text.substr(0, longest);
  out.number(cut.size(), 4);
  out.bytes(std::as_bytes(std::span(cut)));
  const std::vector<std::byte> zeros(longest - cut.size());
  out.bytes(zeros);
}

std::string read_padded(FieldReader& in, std::size_t longest) {
  const auto length = in.number<std::uint32_t>();
  const PortBytes text = in.raw(longest);
  in.require(length <= longest);
  if (!in.good())
    return {};
  const auto is_zero = [](std::byte octet) { return octet == std::byte{0}; };
  in.require(std::ranges::all_of(text.subspan(length), is_zero));
  return {reinterpret_cast<const char*>(text.data()), length};
}

}  // namespace

void add_sender(const Participant& from, PortMessage& out) {
  FieldWriter writer;
  writer.bytes(std::as_bytes(std::span(from.prefix)));
  add_padded(from.host, kLongestHost, writer);
  writer.number(static_cast<std::uint8_t>(from.right), 4);
  add_padded(from.subject, kLongestSubject, writer);
  const std::vector<std::byte> sender = writer.take();
  out.insert(out.end(), sender.begin(), sender.end());
}

std::optional<PortBytes> read_sender(PortBytes message, Participant& from) {
  FieldReader in = content_of(message);
  const PortBytes prefix = in.raw(from.prefix.size());
  std::string host = read_padded(in, kLongestHost);
  const auto right = in.number<std::uint32_t>();
  in.require(right <= static_cast<std::uint32_t>(ClientRight::engineer));
  std::string subject = read_padded(in, kLongestSubject);
  if (!in.good())
    return std::nullopt;
  std::ranges::copy(prefix, std::as_writable_bytes(std::span(from.prefix)).begin());
  from.host = std::move(host);
  from.right = static_cast<ClientRight>(right);
  from.subject = std::move(subject);
  return message.subspan(kMessageHead + kSenderBytes);
}

void add_partition(std::string_view partition, PortMessage& out) {
  FieldWriter writer;
  add_padded(partition.size() <= kLongestPartition ? partition : "", kLongestPartition, writer);
  const std::vector<std::byte> octets = writer.take();
  out.insert(out.end(), octets.begin(), octets.end());
}

std::optional<PortBytes> read_partition(PortBytes message, std::string& partition) {
  FieldReader in = content_of(message);
  std::string taken = read_padded(in, kLongestPartition);
  if (!in.good())
    return std::nullopt;
  partition = std::move(taken);
  return message.subspan(kMessageHead + 4 + kLongestPartition);
}

void encode(const SharedImagesMessage& shared, PortMessage& out) {
  FieldWriter writer = begin_message(static_cast<std::uint8_t>(ToEndpoints::share_images));
  writer.number(shared.tag, 8);
  add_text(shared.line, writer);
  out = writer.take();
}

std::optional<SharedImagesMessage> decode_shared_images(PortBytes message) {
  if (kind_of(message) != static_cast<std::uint8_t>(ToEndpoints::share_images))
    return std::nullopt;
  FieldReader in = content_of(message);
  SharedImagesMessage out;
  out.tag = in.number<std::uint64_t>();
  out.line = read_text(in, kLongestName);
  return if_complete(in, std::move(out));
}

void encode(const std::vector<RemoteLine>& lines, PortMessage& out) {
  FieldWriter writer = begin_message(static_cast<std::uint8_t>(ToEndpoints::follow));
  LINEGATE_ASSERT(lines.size() <= kMostFollowed, "the other side takes no more lines");
  writer.number(lines.size(), 4);
  for (const RemoteLine& line : lines) {
    add_text(line.gateway, writer);
    add_text(line.line, writer);
  }
  out = writer.take();
}

std::optional<std::vector<RemoteLine>> decode_follow(PortBytes message) {
  FieldReader in = content_of(message);
  in.require(kind_of(message) == static_cast<std::uint8_t>(ToEndpoints::follow));
  const auto count = in.number<std::uint32_t>();
  in.require(count <= kMostFollowed);
  std::vector<RemoteLine> out;
  for (std::uint32_t i = 0; i < count && in.good(); ++i) {
    std::string gateway = read_text(in, kLongestName);
    out.push_back({std::move(gateway), read_text(in, kLongestName)});
  }
  return if_complete(in, std::move(out));
}

void encode(ToEndpoints kind, const NumberedTopic& topic, PortMessage& out) {
  FieldWriter writer = begin_message(static_cast<std::uint8_t>(kind));
  writer.number(topic.number, kTopicNumber);
  add_text(topic.topic.line, writer);
  add_text(topic.topic.topic, writer);
  add_text(topic.topic.type, writer);
  writer.number(topic.topic.max_size, 4);
  writer.sized(topic.topic.key, 2);
  writer.number(topic.topic.members.size(), 2);
  for (const named::DescribedMember& member : topic.topic.members) {
    writer.number(static_cast<std::uint64_t>(member.form), 1);
    writer.number(member.length, 2);
    add_text(member.name, writer);
  }
  out = writer.take();
}

std::optional<NumberedTopic> decode_numbered_topic(PortBytes message) {
  FieldReader in = content_of(message);
  NumberedTopic out;
  out.number = in.number<std::uint32_t>();
  out.topic.line = read_text(in, kLongestName);
  out.topic.topic = read_text(in, kLongestText);
  out.topic.type = read_text(in, kLongestText);
  out.topic.max_size = in.number<std::size_t>(4);
  in.require(out.topic.max_size <= kLongestMessage);
  out.topic.key = in.sized(2);
  const auto members = in.number<std::uint16_t>();
  for (std::uint16_t i = 0; i < members && in.good(); ++i) {
    const auto form = in.number<std::uint8_t>();
    in.require(form <= static_cast<std::uint8_t>(named::Form::octets));
    const auto length = in.number<std::uint16_t>();
    out.topic.members.push_back(
        {read_text(in, kLongestText), static_cast<named::Form>(form), length});
  }
  in.require(named::description_size(out.topic.members) <= named::kLongestDescription);
  return if_complete(in, std::move(out));
}

void encode(ToEndpoints kind, std::span<const std::uint32_t> topics, PortMessage& out) {
  FieldWriter writer = begin_message(static_cast<std::uint8_t>(kind));
  LINEGATE_ASSERT(topics.size() <= kMostEnding, "the other side takes no more topics");
  for (const std::uint32_t topic : topics)
    writer.number(topic, kTopicNumber);
  out = writer.take();
}

std::optional<std::vector<std::uint32_t>> decode_topics(PortBytes message) {
  FieldReader in = content_of(message);
  in.require(in.left() <= kMostEnding * kTopicNumber);
  std::vector<std::uint32_t> out;
  while (in.good() && in.left() != 0)
    out.push_back(in.number<std::uint32_t>());
  return if_complete(in, std::move(out));
}

namespace {

// The octets of `out` are kept up to `head`, and its capacity.
void add_numbered(const NumberedSample& sample, PortMessage& out) {
  const std::size_t head = out.size();
  out.resize(head + kTopicNumber);
  store_le(std::span(out).last(kTopicNumber), sample.topic);
  out.insert(out.end(), sample.sample.begin(), sample.sample.end());
}

std::optional<NumberedSample> read_numbered(PortBytes content) {
  FieldReader in(content);
  NumberedSample out;
  out.topic = in.number<std::uint32_t>();
  if (!in.good())
    return std::nullopt;
  out.sample = content.subspan(kTopicNumber);
  return out;
}

void begin_numbered(std::uint8_t kind, PortMessage& out) {
  out.assign(kMessageHead, std::byte{0});
  out.front() = std::byte{kind};
}

}  // namespace

void encode(const NumberedSample& sample, PortMessage& out) {
  begin_numbered(static_cast<std::uint8_t>(ToEndpoints::named_sample), out);
  add_numbered(sample, out);
}

std::optional<NumberedSample> decode_named_sample(PortBytes message) {
  return kind_of(message) == 0 ? std::nullopt : read_numbered(message.subspan(kMessageHead));
}

void encode_named_write(const Participant& from, const NumberedSample& sample, PortMessage& out) {
  begin_numbered(static_cast<std::uint8_t>(FromEndpoints::named_write), out);
  add_sender(from, out);
  add_numbered(sample, out);
}

std::optional<NumberedSample> decode_named_write(PortBytes message, Participant& from) {
  const auto content = read_sender(message, from);
  return content ? read_numbered(*content) : std::nullopt;
}

void encode(const NamedReadersMessage& readers, PortMessage& out) {
  FieldWriter writer = begin_message(static_cast<std::uint8_t>(FromEndpoints::named_readers));
  writer.number(readers.topic, kTopicNumber);
  writer.number(readers.present ? 1 : 0, 1);
  out = writer.take();
}

std::optional<NamedReadersMessage> decode_named_readers(PortBytes message) {
  FieldReader in = content_of(message);
  NamedReadersMessage out;
  out.topic = in.number<std::uint32_t>();
  const auto present = in.number<std::uint8_t>();
  in.require(present <= 1);
  out.present = present == 1;
  return if_complete(in, out);
}

void encode(const NamedMisfitMessage& misfit, PortMessage& out) {
  FieldWriter writer = begin_message(static_cast<std::uint8_t>(FromEndpoints::named_misfit));
  writer.number(misfit.topic, kTopicNumber);
  add_text(misfit.policy, writer);
  out = writer.take();
}

std::optional<NamedMisfitMessage> decode_named_misfit(PortBytes message) {
  FieldReader in = content_of(message);
  NamedMisfitMessage out;
  out.topic = in.number<std::uint32_t>();
  out.policy = read_text(in, kLongestName);
  return if_complete(in, std::move(out));
}

// gateway, incarnation 8, domain 4, profile file, number of lines 4 and their names, renew_after 8,
// participants 8, number of interfaces 4 and their names, the same of peers and of discovery
// servers, images by multicast 1, last_words 8, guard 1, partitions 1, the texts of security.
void encode(const GatewayOptions& options, PortMessage& out) {
  FieldWriter writer = begin_message(static_cast<std::uint8_t>(ToEndpoints::configure));
  add_text(options.gateway, writer);
  writer.number(options.incarnation, 8);
  writer.number(options.domain, 4);
  add_text(options.profile_file, writer);
  writer.number(options.lines.size(), 4);
  for (const std::string& line : options.lines)
    add_text(line, writer);
  writer.number(options.renew_after, 8);
  writer.number(options.participants, 8);
  for (const auto* const names :
       {&options.network.interfaces, &options.network.peers, &options.network.servers}) {
    writer.number(names->size(), 4);
    for (const std::string& name : *names)
      add_text(name, writer);
  }
  writer.number(options.network.multicast_images ? 1 : 0, 1);
  writer.number(static_cast<std::uint64_t>(options.last_words.count()), 8);
  writer.number(options.guard ? 1 : 0, 1);
  writer.number(options.partitions ? 1 : 0, 1);
  for (const std::string* text : texts_of(options.security))
    add_text(*text, writer);
  out = writer.take();
}

std::optional<GatewayOptions> decode_options(PortBytes message) {
  FieldReader in = content_of(message);
  GatewayOptions out;
  out.gateway = read_text(in, kLongestName);
  out.incarnation = in.number<std::uint64_t>();
  out.domain = in.number<std::uint32_t>();
  out.profile_file = read_text(in, kLongestText);
  const auto lines = in.number<std::uint32_t>();
  for (std::uint32_t i = 0; i < lines && in.good(); ++i)
    out.lines.push_back(read_text(in, kLongestName));
  out.renew_after = in.number<std::uint64_t>();
  out.participants = in.number<std::size_t>(8);
  for (auto* const names : {&out.network.interfaces, &out.network.peers, &out.network.servers}) {
    const auto count = in.number<std::uint32_t>();
    for (std::uint32_t i = 0; i < count && in.good(); ++i)
      names->push_back(read_text(in, kLongestText));
  }
  const auto multicast = in.number<std::uint8_t>();
  in.require(multicast <= 1);
  out.network.multicast_images = multicast == 1;
  out.last_words = Duration{in.number<std::int64_t>()};
  const auto guard = in.number<std::uint8_t>();
  in.require(guard <= 1);
  out.guard = guard == 1;
  const auto partitions = in.number<std::uint8_t>();
  in.require(partitions <= 1);
  out.partitions = partitions == 1;
  for (std::string* text : texts_of(out.security))
    *text = read_text(in, kLongestText);
  return if_complete(in, std::move(out));
}

// Number 1; each: severity 1, file, line 4, column 4, text.
void encode(FromEndpoints kind, const std::vector<Diagnostic>& diagnostics, PortMessage& out) {
  FieldWriter writer = begin_message(static_cast<std::uint8_t>(kind));
  std::vector<Diagnostic> sent = diagnostics;
  if (sent.size() > kMostDiagnostics) {
    const std::size_t left_out = sent.size() - (kMostDiagnostics - 1);
    sent.resize(kMostDiagnostics - 1);
    sent.push_back({Severity::error, {}, 0, 0, "and " + std::to_string(left_out) + " more"});
  }
  writer.number(sent.size(), 1);
  for (const Diagnostic& diagnostic : sent) {
    writer.number(static_cast<std::uint8_t>(diagnostic.severity), 1);
    add_text(diagnostic.file, writer);
    writer.number(static_cast<std::uint32_t>(diagnostic.line), 4);
    writer.number(static_cast<std::uint32_t>(diagnostic.column), 4);
    add_text(diagnostic.text, writer);
  }
  out = writer.take();
}

std::optional<std::vector<Diagnostic>> decode_diagnostics(PortBytes message) {
  FieldReader in = content_of(message);
  const auto count = in.number<std::uint8_t>();
  in.require(count <= kMostDiagnostics);
  std::vector<Diagnostic> out;
  for (std::uint8_t i = 0; i < count && in.good(); ++i) {
    Diagnostic& diagnostic = out.emplace_back();
    const auto severity = in.number<std::uint8_t>();
    in.require(severity <= static_cast<std::uint8_t>(Severity::error));
    diagnostic.severity = static_cast<Severity>(severity);
    diagnostic.file = read_text(in, kLongestText);
    diagnostic.line = static_cast<decltype(diagnostic.line)>(in.number<std::uint32_t>());
    diagnostic.column = static_cast<decltype(diagnostic.column)>(in.number<std::uint32_t>());
    diagnostic.text = read_text(in, kLongestText);
  }
  return if_complete(in, std::move(out));
}

void encode_unreadable(std::uint64_t samples, PortMessage& out) {
  FieldWriter writer = begin_message(static_cast<std::uint8_t>(FromEndpoints::unreadable));
  writer.number(samples, 8);
  out = writer.take();
}

std::optional<std::uint64_t> decode_unreadable(PortBytes message) {
  FieldReader in = content_of(message);
  const auto samples = in.number<std::uint64_t>();
  return if_complete(in, samples);
}

// participants 8, most 8, discovered 8, gone 8, endpoints 8, received 8, dropped 8 each, failed 8,
// namesakes 4, next expiry 8, number of other gateways 4 and their names.
void encode(const EndpointStatus& status, PortMessage& out) {
  FieldWriter writer = begin_message(static_cast<std::uint8_t>(FromEndpoints::status));
  writer.number(status.discovery.participants, 8);
  writer.number(status.discovery.most, 8);
  writer.number(status.discovery.discovered, 8);
  writer.number(status.discovery.gone, 8);
  writer.number(status.guard.endpoints, 8);
  writer.number(status.guard.received, 8);
  for (const std::uint64_t dropped : status.guard.dropped)
    writer.number(dropped, 8);
  writer.number(status.failed, 8);
  writer.number(status.namesakes, 4);
  writer.number(static_cast<std::uint64_t>(status.next_expiry), 8);
  const std::size_t listed = std::min(status.other_gateways.size(), EndpointStatus::kMostListed);
  writer.number(listed, 4);
  for (const std::string& gateway : std::span(status.other_gateways).first(listed))
    add_text(std::string_view(gateway).substr(0, kLongestName), writer);
  out = writer.take();
}

std::optional<EndpointStatus> decode_status(PortBytes message) {
  FieldReader in = content_of(message);
  EndpointStatus out;
  out.discovery.participants = in.number<std::size_t>(8);
  out.discovery.most = in.number<std::size_t>(8);
  out.discovery.discovered = in.number<std::uint64_t>();
  out.discovery.gone = in.number<std::uint64_t>();
  out.guard.endpoints = in.number<std::size_t>(8);
  out.guard.received = in.number<std::uint64_t>();
  for (std::uint64_t& dropped : out.guard.dropped)
    dropped = in.number<std::uint64_t>();
  out.failed = in.number<std::uint64_t>();
  out.namesakes = in.number<std::uint32_t>();
  out.next_expiry = in.number<std::int64_t>();
  const auto listed = in.number<std::uint32_t>();
  in.require(listed <= EndpointStatus::kMostListed);
  for (std::uint32_t i = 0; i < listed && in.good(); ++i)
    out.other_gateways.push_back(read_gateway(in));
  return if_complete(in, std::move(out));
}

}  // namespace linegate::dds

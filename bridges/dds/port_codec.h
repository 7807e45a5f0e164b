// SPDX-License-Identifier: Apache-2.0
// The messages between a gateway and the process with its DDS endpoints.
//
// Layout: the kind in one octet, seven octets 0, and the content. Samples are in CDR without
// encapsulation, as fastddsgen generates it from linegate.idl, in the byte order of the host, with
// alignments counted from its first octet. Before a CommandReply is the length of its partition in
// 4 octets and 252 octets with the partition, the unused ones 0. Before a sample from the endpoints
// is its sender: the prefix of its GUID in 12 octets, the length of its host in 4, and 64 octets
// with the host, the unused ones 0. The content of all other kinds is in the comments below:
// numbers are little-endian, a text is its length in 2 octets and its octets. Samples of named
// topics are octets: CDR with its encapsulation, without a length, up to the end of the message.
//
// Messages from the endpoints come from a process that the network may have taken over. Each
// decoder returns false, or nothing, unless the message is complete, has no octet too many and each
// of its members is within its limits.
#pragma once

#include <cstddef>
#include <cstdint>
#include <exception>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include <fastcdr/Cdr.h>
#include <fastcdr/FastBuffer.h>

#include "bridges/dds/guard/counters.h"
#include "bridges/dds/named_topic.h"
#include "bridges/dds/publisher.h"
#include "bridges/dds/values.h"
#include "stack/base/diagnostic.h"

namespace linegate::dds {

enum class ToEndpoints : std::uint8_t {
  configure = 1,  // GatewayOptions; the first message
  add_line,       // text
  remove_line,    // text
  forget_pdos,    // text: line
  gateway_state,  // samples
  line_state,
  node_state,
  output_state,
  image_layout,
  process_image,
  pdo_update,
  pdo_reception,
  event,
  command_reply,
  stop,          // nothing: end after the last words
  share_images,  // tag in 8 octets, text: line; the link has passed memory with that tag
  follow,        // number of lines in 4 octets; each: texts of gateway and line
  // Named topics, each with a number (declared_topics.h): number in 4 octets, texts of line, topic
  // and type, greatest size of a sample in 4 octets, the key with its length in 2.
  named_topic,   // that the gateway writes
  named_set,     // that applications write
  end_topics,    // numbers in 4 octets each: named topics that end
  end_sets,      // the same of those that applications write
  named_sample,  // number in 4 octets, sample
};

enum class FromEndpoints : std::uint8_t {
  ready = 1,     // diagnostics: the endpoints exist
  failed,        // diagnostics: they could not be created, the process ends
  output_write,  // samples with their sender
  command_request,
  unreadable,      // 8 octets: number of samples
  output_misfit,   // text: name of the QoS policy
  command_misfit,  // text
  status,          // EndpointStatus
  line_state,      // samples of lines of other gateways, after ToEndpoints::follow
  image_layout,
  process_image,
  named_write,    // sender, number of the topic in 4 octets, sample
  named_readers,  // number of the topic in 4 octets; 1: it has readers, 0: it has none
  named_misfit,   // number of the topic in 4 octets, text: name of the QoS policy
};

// The state of the endpoints. All counters are since the start of the process.
struct EndpointStatus {
  DiscoveryCounters discovery;
  guard::Counters guard;
  std::uint64_t failed = 0;  // samples that DDS refused
  std::uint32_t namesakes = 0;
  std::int64_t next_expiry = 0;             // see GatewayBridge
  std::vector<std::string> other_gateways;  // up to kMostListed

  static constexpr std::size_t kMostListed = 256;

  bool operator==(const EndpointStatus& other) const;
};

inline constexpr std::size_t kMessageHead = 8;
inline constexpr std::size_t kLongestName = 64;
inline constexpr std::size_t kMostDiagnostics = 32;
inline constexpr std::size_t kLongestHost = 64;
inline constexpr std::size_t kLongestSubject = 64;
inline constexpr std::size_t kSenderBytes = 152;
inline constexpr std::size_t kLongestPartition = 252;
inline constexpr std::size_t kMostFollowed = 4'096;
inline constexpr std::size_t kMostEnding = 16;  // topics in one message

using PortMessage = std::vector<std::byte>;
using PortBytes = std::span<const std::byte>;

// 0 if the message has no valid head.
std::uint8_t kind_of(PortBytes message);

void encode(ToEndpoints kind, std::string_view text, PortMessage& out);
void encode(FromEndpoints kind, std::string_view text, PortMessage& out);
std::optional<std::string> decode_text(PortBytes message, std::size_t longest = kLongestName);

// The tag of that memory, and the line whose images are in it.
struct SharedImagesMessage {
  std::uint64_t tag = 0;
  std::string line;
};
void encode(const SharedImagesMessage& shared, PortMessage& out);
std::optional<SharedImagesMessage> decode_shared_images(PortBytes message);

// The lines of other gateways whose samples are wanted, up to kMostFollowed.
void encode(const std::vector<RemoteLine>& lines, PortMessage& out);
std::optional<std::vector<RemoteLine>> decode_follow(PortBytes message);

// A named topic with its number. kind: named_topic or named_set.
struct NumberedTopic {
  std::uint32_t number = 0;
  NamedTopic topic;
};
void encode(ToEndpoints kind, const NumberedTopic& topic, PortMessage& out);
std::optional<NumberedTopic> decode_numbered_topic(PortBytes message);

// The numbers of up to kMostEnding topics. kind: end_topics or end_sets.
void encode(ToEndpoints kind, std::span<const std::uint32_t> topics, PortMessage& out);
std::optional<std::vector<std::uint32_t>> decode_topics(PortBytes message);

// A sample of a named topic, which the message contains.
struct NumberedSample {
  std::uint32_t topic = 0;
  PortBytes sample;
};
void encode(const NumberedSample& sample, PortMessage& out);
std::optional<NumberedSample> decode_named_sample(PortBytes message);
void encode_named_write(const Participant& from, const NumberedSample& sample, PortMessage& out);
std::optional<NumberedSample> decode_named_write(PortBytes message, Participant& from);

// Whether a named topic has readers.
struct NamedReadersMessage {
  std::uint32_t topic = 0;
  bool present = false;
};
void encode(const NamedReadersMessage& readers, PortMessage& out);
std::optional<NamedReadersMessage> decode_named_readers(PortBytes message);

// A writer of a named topic whose QoS is incompatible in that policy.
struct NamedMisfitMessage {
  std::uint32_t topic = 0;
  std::string policy;
};
void encode(const NamedMisfitMessage& misfit, PortMessage& out);
std::optional<NamedMisfitMessage> decode_named_misfit(PortBytes message);

void encode(const GatewayOptions& options, PortMessage& out);
std::optional<GatewayOptions> decode_options(PortBytes message);

void encode(FromEndpoints kind, const std::vector<Diagnostic>& diagnostics, PortMessage& out);
std::optional<std::vector<Diagnostic>> decode_diagnostics(PortBytes message);

void encode_unreadable(std::uint64_t samples, PortMessage& out);
std::optional<std::uint64_t> decode_unreadable(PortBytes message);

void encode(const EndpointStatus& status, PortMessage& out);
std::optional<EndpointStatus> decode_status(PortBytes message);

// Adds the sender to the head of a message; a longer host or subject is cut. Returns its content
// behind the sender, or nothing if the sender is malformed.
void add_sender(const Participant& from, PortMessage& out);
std::optional<PortBytes> read_sender(PortBytes message, Participant& from);

// The same for the partition of a CommandReply; a longer one is not sent: it becomes empty.
void add_partition(std::string_view partition, PortMessage& out);
std::optional<PortBytes> read_partition(PortBytes message, std::string& partition);

template <class Sample>
void add_sample(const Sample& sample, PortMessage& out) {
  const std::size_t begin = out.size();
  out.resize(begin + Sample::getCdrSerializedSize(sample));
  eprosima::fastcdr::FastBuffer buffer(reinterpret_cast<char*>(out.data() + begin),
                                       out.size() - begin);
  eprosima::fastcdr::Cdr cdr(buffer);
  sample.serialize(cdr);
  out.resize(begin + cdr.getSerializedDataLength());
}

// Strings longer than those of the contract are cut. The sample may have any content that its type
// can have; check it as a sample of an untrusted writer.
template <class Sample>
bool read_sample(PortBytes content, Sample& sample) {
  try {
    // Reads only.
    eprosima::fastcdr::FastBuffer buffer(
        const_cast<char*>(reinterpret_cast<const char*>(content.data())), content.size());
    eprosima::fastcdr::Cdr cdr(buffer);
    sample.deserialize(cdr);
    return cdr.getSerializedDataLength() == content.size();
  } catch (const std::exception&) {
    return false;
  }
}

// Throws nothing for samples within the bounds of the contract. out keeps its capacity.
template <class Sample>
void encode_sample(std::uint8_t kind, const Sample& sample, PortMessage& out) {
  out.assign(kMessageHead, std::byte{0});
  out.front() = std::byte{kind};
  add_sample(sample, out);
}

template <class Sample>
bool decode_sample(PortBytes message, Sample& sample) {
  return kind_of(message) != 0 && read_sample(message.subspan(kMessageHead), sample);
}

// The same for a sample with its partition.
template <class Sample>
void encode_sample_in(const std::string& partition, ToEndpoints kind, const Sample& sample,
                      PortMessage& out) {
  out.assign(kMessageHead, std::byte{0});
  out.front() = static_cast<std::byte>(kind);
  add_partition(partition, out);
  add_sample(sample, out);
}

template <class Sample>
bool decode_sample_in(PortBytes message, std::string& partition, Sample& sample) {
  const auto content = read_partition(message, partition);
  return content && read_sample(*content, sample);
}

// The same for a sample from the endpoints.
template <class Sample>
void encode_received(FromEndpoints kind, const Participant& from, const Sample& sample,
                     PortMessage& out) {
  out.assign(kMessageHead, std::byte{0});
  out.front() = static_cast<std::byte>(kind);
  add_sender(from, out);
  add_sample(sample, out);
}

template <class Sample>
bool decode_received(PortBytes message, Participant& from, Sample& sample) {
  const auto content = read_sender(message, from);
  return content && read_sample(*content, sample);
}

}  // namespace linegate::dds

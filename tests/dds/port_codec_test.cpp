// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/port_codec.h"

#include <algorithm>
#include <random>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <linegate.h>

#include "bridges/dds/message_link.h"

namespace linegate::dds {
namespace {

// Neither a part of the message nor one with an octet more is accepted.
template <class Decode>
void expect_only_whole(const PortMessage& message, Decode decode) {
  EXPECT_TRUE(decode(PortBytes(message)));
  for (std::size_t length = 0; length < message.size(); ++length)
    EXPECT_FALSE(decode(PortBytes(message).first(length))) << length << " of " << message.size();
  PortMessage longer = message;
  longer.push_back(std::byte{0});
  EXPECT_FALSE(decode(PortBytes(longer)));
  for (std::size_t octet = 1; octet < kMessageHead; ++octet) {
    PortMessage other = message;
    other[octet] = std::byte{1};
    EXPECT_FALSE(decode(PortBytes(other))) << "octet " << octet << " of the head";
  }
}

// Calls decode with changed octets: it may accept or refuse, and must not fail otherwise.
template <class Decode>
void expect_harmless(const PortMessage& message, Decode decode) {
  std::mt19937 random(20'240'602);
  for (int i = 0; i < 20'000; ++i) {
    PortMessage changed = message;
    for (unsigned changes = 1 + random() % 4; changes > 0; --changes) {
      changed[random() % changed.size()] =
          random() % 3 == 0 ? std::byte{0xFF} : static_cast<std::byte>(random() & 0xFFU);
    }
    changed.resize(random() % 4 == 0 ? random() % (changed.size() + 1) : changed.size());
    decode(PortBytes(changed));
  }
}

v1::CommandRequest full_request() {
  v1::CommandRequest request;
  request.gateway("gateway");
  request.line("line");
  request.client(std::string(64, 'c'));
  request.incarnation(0x0123'4567'89AB'CDEF);
  request.id(17);
  request.kind(3);
  request.node(127);
  request.timeout_ns(-1);
  request.last(true);
  request.data(std::vector<std::uint8_t>(8'192, 0xA5));
  return request;
}

v1::OutputWrite full_write() {
  v1::OutputWrite write;
  write.gateway("gateway");
  write.line("line");
  write.client("client");
  write.group(7);
  write.arming(~std::uint64_t{0});
  write.values().resize(3);
  write.values()[2].entry(9);
  write.values()[2].data({1, 2, 3});
  write.bytes().resize(1);
  write.bytes()[0].data({4, 5});
  return write;
}

TEST(PortCodec, ARequestComesBackAsItWent) {
  PortMessage message;
  const v1::CommandRequest request = full_request();
  encode_sample(static_cast<std::uint8_t>(FromEndpoints::command_request), request, message);
  EXPECT_EQ(kind_of(message), static_cast<std::uint8_t>(FromEndpoints::command_request));
  v1::CommandRequest back;
  ASSERT_TRUE(decode_sample(PortBytes(message), back));
  EXPECT_TRUE(back == request);
}

TEST(PortCodec, AnOutputWriteComesBackAsItWent) {
  PortMessage message;
  const v1::OutputWrite write = full_write();
  encode_sample(static_cast<std::uint8_t>(FromEndpoints::output_write), write, message);
  v1::OutputWrite back;
  ASSERT_TRUE(decode_sample(PortBytes(message), back));
  EXPECT_TRUE(back == write);
}

TEST(PortCodec, ASampleIsAcceptedOnlyWhole) {
  PortMessage message;
  encode_sample(1, full_write(), message);
  expect_only_whole(message, [](PortBytes bytes) {
    v1::OutputWrite back;
    return decode_sample(bytes, back);
  });
}

TEST(PortCodec, AnyChangeOfASampleIsHarmless) {
  PortMessage message;
  encode_sample(1, full_write(), message);
  expect_harmless(message, [](PortBytes bytes) {
    v1::OutputWrite back;
    decode_sample(bytes, back);
    // No sequence can be longer than the octets of the message.
    EXPECT_LE(back.values().size(), bytes.size());
  });
}

Participant full_sender() {
  Participant from{.host = std::string(64, 'h'),
                   .right = ClientRight::engineer,
                   .subject = std::string(64, 's')};
  for (std::size_t i = 0; i < from.prefix.size(); ++i)
    from.prefix[i] = static_cast<std::uint8_t>(0xF0 + i);
  return from;
}

TEST(PortCodec, ARequestHasItsSender) {
  for (const std::string& host : {std::string(), std::string("panel3"), std::string(64, 'h')}) {
    Participant from = full_sender();
    from.host = host;
    from.subject = host;
    PortMessage message;
    encode_received(FromEndpoints::command_request, from, full_request(), message);
    EXPECT_EQ(kind_of(message), static_cast<std::uint8_t>(FromEndpoints::command_request));
    Participant back{.host = "another"};
    v1::CommandRequest request;
    ASSERT_TRUE(decode_received(PortBytes(message), back, request));
    EXPECT_EQ(back.prefix, from.prefix);
    EXPECT_EQ(back.host, host);
    EXPECT_EQ(back.right, ClientRight::engineer);
    EXPECT_EQ(back.subject, host);
    EXPECT_TRUE(request == full_request());
  }
}

TEST(PortCodec, ALongHostIsCut) {
  Participant from = full_sender();
  from.host += "more";
  PortMessage message;
  encode_received(FromEndpoints::output_write, from, full_write(), message);
  Participant back;
  v1::OutputWrite write;
  ASSERT_TRUE(decode_received(PortBytes(message), back, write));
  EXPECT_EQ(back.host, std::string(64, 'h'));
  EXPECT_TRUE(write == full_write());
}

TEST(PortCodec, AMalformedSenderIsRefused) {
  PortMessage good;
  encode_received(FromEndpoints::output_write, Participant{.host = "panel3"}, full_write(), good);
  constexpr std::size_t kLength = kMessageHead + 12;
  const auto refused = [&](std::size_t octet, std::uint8_t value) {
    PortMessage message = good;
    message.at(octet) = std::byte{value};
    Participant from;
    v1::OutputWrite write;
    return !decode_received(PortBytes(message), from, write);
  };
  EXPECT_FALSE(refused(kLength, 7)) << "a host may contain any octet";
  EXPECT_TRUE(refused(kLength, 5)) << "an octet behind the host";
  EXPECT_TRUE(refused(kLength, 65)) << "longer than a host";
  EXPECT_TRUE(refused(kLength + 3, 0xFF)) << "longer than the message";
  constexpr std::size_t kRight = kLength + 4 + kLongestHost;
  EXPECT_FALSE(refused(kRight, 1));
  EXPECT_TRUE(refused(kRight, 4)) << "no such right";
  EXPECT_TRUE(refused(kRight + 4, 65)) << "longer than a subject";
  EXPECT_TRUE(refused(kRight - 1, 1)) << "an octet behind the host";
  EXPECT_TRUE(refused(kMessageHead + kSenderBytes - 1, 1)) << "an octet behind the subject";
}

TEST(PortCodec, AReceivedSampleIsAcceptedOnlyWholeAndHarmless) {
  PortMessage message;
  encode_received(FromEndpoints::output_write, full_sender(), full_write(), message);
  const auto decode = [](PortBytes bytes) {
    Participant from;
    v1::OutputWrite back;
    const bool good = decode_received(bytes, from, back);
    EXPECT_LE(from.host.size(), kLongestHost);
    EXPECT_LE(back.values().size(), bytes.size());
    return good;
  };
  expect_only_whole(message, decode);
  expect_harmless(message, decode);
}

TEST(PortCodec, AReplyHasItsPartition) {
  v1::CommandReply reply;
  reply.client("panel");
  reply.id(7);
  PortMessage message;
  encode_sample_in("plant//operator/alice", ToEndpoints::command_reply, reply, message);
  std::string partition;
  v1::CommandReply decoded;
  ASSERT_TRUE(decode_sample_in(message, partition, decoded));
  EXPECT_EQ(partition, "plant//operator/alice");
  EXPECT_EQ(decoded, reply);
  for (std::size_t size = 0; size < message.size(); ++size)
    EXPECT_FALSE(decode_sample_in(PortBytes(message).first(size), partition, decoded)) << size;
  message[kMessageHead + 1] = std::byte{1};  // length: 277
  EXPECT_FALSE(decode_sample_in(message, partition, decoded));
  // A part of it would be the partition of another identity.
  encode_sample_in(std::string(kLongestPartition + 1, 'a'), ToEndpoints::command_reply, reply,
                   message);
  ASSERT_TRUE(decode_sample_in(message, partition, decoded));
  EXPECT_EQ(partition, "");
}

TEST(PortCodec, OptionsComeBackAsTheyWent) {
  const GatewayOptions options{.gateway = "gateway",
                               .incarnation = 0xFEDC'BA98'7654'3210,
                               .domain = 232,
                               .profile_file = "/etc/file.xml",
                               .lines = {"one", "", std::string(64, 'x')},
                               .renew_after = 1'000,
                               .participants = 12,
                               .network = {.interfaces = {"eth0"},
                                           .peers = {"hall-b", "10.0.0.1"},
                                           .servers = {"2@10.0.0.9:11888"},
                                           .multicast_images = true},
                               .last_words = std::chrono::milliseconds(700),
                               .guard = false,
                               .partitions = true,
                               .security = {.ca = "/s/ca",
                                            .certificate = "/s/certificate",
                                            .key = "/s/key",
                                            .governance = "/s/governance",
                                            .permissions = "/s/permissions",
                                            .revocations = "/s/revocations",
                                            .request_partition = "plant/*"}};
  PortMessage message;
  encode(options, message);
  const auto back = decode_options(message);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->gateway, options.gateway);
  EXPECT_EQ(back->incarnation, options.incarnation);
  EXPECT_EQ(back->domain, options.domain);
  EXPECT_EQ(back->partitions, options.partitions);
  EXPECT_EQ(back->profile_file, options.profile_file);
  EXPECT_EQ(back->lines, options.lines);
  EXPECT_EQ(back->renew_after, options.renew_after);
  EXPECT_EQ(back->participants, options.participants);
  EXPECT_EQ(back->network.interfaces, options.network.interfaces);
  EXPECT_EQ(back->network.peers, options.network.peers);
  EXPECT_EQ(back->network.servers, options.network.servers);
  EXPECT_TRUE(back->network.multicast_images);
  EXPECT_EQ(back->last_words, options.last_words);
  EXPECT_EQ(back->guard, options.guard);
  EXPECT_EQ(back->security.ca, options.security.ca);
  EXPECT_EQ(back->security.certificate, options.security.certificate);
  EXPECT_EQ(back->security.key, options.security.key);
  EXPECT_EQ(back->security.governance, options.security.governance);
  EXPECT_EQ(back->security.permissions, options.security.permissions);
  EXPECT_EQ(back->security.revocations, options.security.revocations);
  EXPECT_EQ(back->security.request_partition, options.security.request_partition);
  expect_only_whole(message, [](PortBytes bytes) { return decode_options(bytes).has_value(); });
}

EndpointStatus full_status() {
  EndpointStatus status;
  status.discovery = {.participants = 1, .most = 2, .discovered = 3, .gone = 4};
  status.guard.endpoints = 5;
  status.guard.received = 6;
  status.guard.dropped.fill(7);
  status.failed = 8;
  status.namesakes = 9;
  status.next_expiry = 1'800'000'000;
  status.other_gateways = {"a", std::string(64, 'b')};
  return status;
}

TEST(PortCodec, AStatusComesBackAsItWent) {
  PortMessage message;
  encode(full_status(), message);
  const auto back = decode_status(message);
  ASSERT_TRUE(back);
  EXPECT_TRUE(*back == full_status());
  expect_only_whole(message, [](PortBytes bytes) { return decode_status(bytes).has_value(); });
  expect_harmless(message, [](PortBytes bytes) {
    if (const auto status = decode_status(bytes)) {
      EXPECT_LE(status->other_gateways.size(), EndpointStatus::kMostListed);
    }
  });
}

TEST(PortCodec, MoreGatewaysThanThePermittedNumberAreNotListed) {
  EndpointStatus status;
  status.other_gateways.assign(EndpointStatus::kMostListed + 1, "name");
  PortMessage message;
  encode(status, message);
  const auto back = decode_status(message);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->other_gateways.size(), EndpointStatus::kMostListed);
}

TEST(PortCodec, DiagnosticsComeBackAsTheyWent) {
  const std::vector<Diagnostic> diagnostics{{Severity::error, "file", 1, 2, "text"},
                                            {Severity::note, "", 0, 0, ""}};
  PortMessage message;
  encode(FromEndpoints::failed, diagnostics, message);
  const auto back = decode_diagnostics(message);
  ASSERT_TRUE(back);
  ASSERT_EQ(back->size(), 2U);
  EXPECT_EQ(to_string(back->at(0)), to_string(diagnostics[0]));
  EXPECT_EQ(back->at(1).severity, Severity::note);
  const auto decode = [](PortBytes bytes) { return decode_diagnostics(bytes).has_value(); };
  expect_only_whole(message, decode);
  expect_harmless(message, decode);
}

TEST(PortCodec, DiagnosticsThatHaveNoRoomAreCounted) {
  PortMessage message;
  encode(FromEndpoints::failed,
         std::vector<Diagnostic>(kMostDiagnostics, {Severity::note, "file", 1, 2, "text"}),
         message);
  EXPECT_EQ(decode_diagnostics(message).value().back().text, "text") << "all have room";
  encode(FromEndpoints::failed,
         std::vector<Diagnostic>(kMostDiagnostics + 1, {Severity::note, "file", 1, 2, "text"}),
         message);
  const auto back = decode_diagnostics(message);
  ASSERT_TRUE(back);
  ASSERT_EQ(back->size(), kMostDiagnostics);
  EXPECT_EQ(back->back().text, "and 2 more");
}

TEST(PortCodec, TextsAndNumbersComeBackAsTheyWent) {
  PortMessage message;
  encode(FromEndpoints::output_misfit, "ownership", message);
  EXPECT_EQ(decode_text(message), "ownership");
  expect_only_whole(message, [](PortBytes bytes) { return decode_text(bytes).has_value(); });
  encode(ToEndpoints::add_line, std::string(65, 'x'), message);
  EXPECT_FALSE(decode_text(message)) << "longer than a name";
  encode_unreadable(42, message);
  EXPECT_EQ(decode_unreadable(message), 42U);
  expect_only_whole(message, [](PortBytes bytes) { return decode_unreadable(bytes).has_value(); });
}

TEST(PortCodec, FollowedLinesComeBackAsTheyWent) {
  PortMessage message;
  const std::vector<RemoteLine> lines{{"hall-b", "press"}, {std::string(64, 'g'), "l"}};
  encode(lines, message);
  EXPECT_EQ(decode_follow(message), lines);
  const auto decode = [](PortBytes bytes) { return decode_follow(bytes).has_value(); };
  expect_only_whole(message, decode);
  expect_harmless(message, decode);
  encode(std::vector<RemoteLine>{}, message);
  EXPECT_EQ(decode_follow(message), std::vector<RemoteLine>{});
  encode(std::vector<RemoteLine>{{std::string(65, 'g'), "l"}}, message);
  EXPECT_FALSE(decode_follow(message)) << "longer than a name";
  encode(ToEndpoints::add_line, "press", message);
  EXPECT_FALSE(decode_follow(message)) << "another kind";
}

NumberedTopic full_topic() {
  return {.number = 0xFEDC'BA98,
          .topic = {.line = std::string(64, 'l'),
                    .topic = "plant/press/ram/inputs",
                    .type = "plant::press_ram_inputs_26c77fbdaf07453c",
                    .max_size = kLongestMessage,
                    .key = {std::byte{1}, std::byte{0}, std::byte{0xFF}},
                    .members = {{"values_Text", named::Form::text, 17},
                                {"values_Raw", named::Form::octets, 65'535}}}};
}

TEST(PortCodec, ANamedTopicComesBackAsItWent) {
  for (const ToEndpoints kind : {ToEndpoints::named_topic, ToEndpoints::named_set}) {
    PortMessage message;
    encode(kind, full_topic(), message);
    EXPECT_EQ(kind_of(message), static_cast<std::uint8_t>(kind));
    const auto back = decode_numbered_topic(message);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->number, full_topic().number);
    EXPECT_EQ(back->topic.line, full_topic().topic.line);
    EXPECT_EQ(back->topic.topic, full_topic().topic.topic);
    EXPECT_EQ(back->topic.type, full_topic().topic.type);
    EXPECT_EQ(back->topic.max_size, full_topic().topic.max_size);
    EXPECT_EQ(back->topic.key, full_topic().topic.key);
    EXPECT_EQ(back->topic.members, full_topic().topic.members);
    const auto decode = [](PortBytes bytes) { return decode_numbered_topic(bytes).has_value(); };
    expect_only_whole(message, decode);
    expect_harmless(message, decode);
  }
}

TEST(PortCodec, ANamedTopicBeyondItsLimitsIsRefused) {
  PortMessage message;
  NumberedTopic topic = full_topic();
  topic.topic.line += 'l';
  encode(ToEndpoints::named_topic, topic, message);
  EXPECT_FALSE(decode_numbered_topic(message)) << "longer than a name";
  topic = full_topic();
  topic.topic.max_size = kLongestMessage + 1;
  encode(ToEndpoints::named_topic, topic, message);
  EXPECT_FALSE(decode_numbered_topic(message)) << "no such sample has room";
  topic = full_topic();
  topic.topic.members.assign(1'000, topic.topic.members.front());
  encode(ToEndpoints::named_topic, topic, message);
  EXPECT_FALSE(decode_numbered_topic(message)) << "longer than an announcement";
}

TEST(PortCodec, NumbersOfTopicsComeBackAsTheyWent) {
  PortMessage message;
  const std::vector<std::uint32_t> none;
  encode(ToEndpoints::end_topics, none, message);
  EXPECT_EQ(decode_topics(message), none);
  std::vector<std::uint32_t> topics(kMostEnding, 0xFFFF'FFFF);
  topics.front() = 1;
  encode(ToEndpoints::end_sets, topics, message);
  EXPECT_EQ(decode_topics(message), topics);
  expect_harmless(message, [](PortBytes bytes) {
    if (const auto some = decode_topics(bytes)) {
      EXPECT_LE(some->size(), kMostEnding);
    }
  });
  message.resize(message.size() + 4);
  EXPECT_FALSE(decode_topics(message)) << "one too many";
  message.resize(message.size() - 5);
  EXPECT_FALSE(decode_topics(message)) << "a part of one";
}

TEST(PortCodec, SamplesOfNamedTopicsComeBackAsTheyWent) {
  const std::vector<std::byte> octets{std::byte{0}, std::byte{1}, std::byte{0}, std::byte{0xFF}};
  PortMessage message(1'000);
  encode(NumberedSample{7, octets}, message);
  EXPECT_EQ(kind_of(message), static_cast<std::uint8_t>(ToEndpoints::named_sample));
  const auto back = decode_named_sample(message);
  ASSERT_TRUE(back);
  EXPECT_EQ(back->topic, 7U);
  EXPECT_TRUE(std::ranges::equal(back->sample, octets));
  for (std::size_t length = 0; length < kMessageHead + 4; ++length)
    EXPECT_FALSE(decode_named_sample(PortBytes(message).first(length))) << length;

  encode_named_write(full_sender(), {8, octets}, message);
  EXPECT_EQ(kind_of(message), static_cast<std::uint8_t>(FromEndpoints::named_write));
  Participant from;
  const auto write = decode_named_write(message, from);
  ASSERT_TRUE(write);
  EXPECT_EQ(write->topic, 8U);
  EXPECT_TRUE(std::ranges::equal(write->sample, octets));
  EXPECT_EQ(from.prefix, full_sender().prefix);
  EXPECT_EQ(from.host, full_sender().host);
  EXPECT_EQ(from.right, full_sender().right);
  EXPECT_EQ(from.subject, full_sender().subject);
  for (std::size_t length = 0; length < kMessageHead + kSenderBytes + 4; ++length)
    EXPECT_FALSE(decode_named_write(PortBytes(message).first(length), from)) << length;
  expect_harmless(message, [](PortBytes bytes) {
    Participant sender;
    if (const auto some = decode_named_write(bytes, sender)) {
      EXPECT_LE(some->sample.size(), bytes.size());
    }
    EXPECT_LE(sender.host.size(), kLongestHost);
  });
}

TEST(PortCodec, WhatIsReportedOfNamedTopicsComesBackAsItWent) {
  PortMessage message;
  for (const bool present : {false, true}) {
    encode(NamedReadersMessage{0x0102'0304, present}, message);
    const auto back = decode_named_readers(message);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->topic, 0x0102'0304U);
    EXPECT_EQ(back->present, present);
  }
  const auto of_readers = [](PortBytes bytes) { return decode_named_readers(bytes).has_value(); };
  expect_only_whole(message, of_readers);
  message.back() = std::byte{2};
  EXPECT_FALSE(decode_named_readers(message)) << "neither yes nor no";

  encode(NamedMisfitMessage{9, "ownership"}, message);
  const auto misfit = decode_named_misfit(message);
  ASSERT_TRUE(misfit);
  EXPECT_EQ(misfit->topic, 9U);
  EXPECT_EQ(misfit->policy, "ownership");
  const auto of_misfit = [](PortBytes bytes) { return decode_named_misfit(bytes).has_value(); };
  expect_only_whole(message, of_misfit);
  expect_harmless(message, of_misfit);
}

}  // namespace
}  // namespace linegate::dds

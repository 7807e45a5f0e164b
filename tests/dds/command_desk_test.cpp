// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/command_desk.h"

#include <gtest/gtest.h>

#include "bridges/dds/command_samples.h"
#include "stack/base/abort_code.h"

#include "tests/dds/known_values.h"

namespace linegate::dds {
namespace {

using line::Refusal;

v1::CommandRequest request(std::uint64_t id, std::uint8_t kind = v1::COMMAND_SDO_READ,
                           const char* client = "c") {
  v1::CommandRequest sample;
  sample.line("line1");
  sample.client(client);
  sample.id(id);
  sample.kind(kind);
  sample.node(5);
  sample.last(true);
  return sample;
}

// The chunks of an SDO download of `size` bytes.
std::vector<v1::CommandRequest> download(std::uint64_t id, std::size_t size) {
  const auto data = known::pattern(size, 1);
  std::vector<v1::CommandRequest> chunks;
  std::size_t offset = 0;
  do {
    chunks.push_back(request(id, v1::COMMAND_SDO_WRITE));
    set_chunk(data, offset, chunks.back());
    offset += chunks.back().data().size();
  } while (!chunks.back().last());
  return chunks;
}

class Desk : public testing::Test {
 protected:
  CommandDesk::Outcome take(const v1::CommandRequest& sample, std::uint8_t from = 1) {
    return desk.take(sample, {from});
  }
  Refusal refusal(const v1::CommandRequest& sample) {
    const auto outcome = desk.take(sample, {1});
    EXPECT_FALSE(outcome.command || outcome.gateway_command);
    return outcome.refused;
  }
  void answer(std::uint64_t tag, std::size_t bytes = 4) {
    line::Reply reply;
    reply.tag = tag;
    reply.data = known::pattern(bytes, 2);
    EXPECT_NE(desk.answer(reply), nullptr);
  }

  CommandDesk desk{77, {"line1", "line2"}};
};

TEST_F(Desk, ARequestBecomesACommand) {
  v1::CommandRequest sample = request(10);
  sample.index(0x1018);
  sample.sub(2);
  sample.timeout_ns(5);
  sample.layout_id(6);
  const auto outcome = take(sample);
  ASSERT_TRUE(outcome.command);
  EXPECT_FALSE(outcome.answer);
  EXPECT_EQ(outcome.command->line, "line1");
  EXPECT_EQ(outcome.command->client, "c");
  EXPECT_EQ(outcome.command->layout_id, 6U);
  const auto& read = std::get<line::SdoRead>(outcome.command->command.request);
  EXPECT_EQ(read.node, 5);
  EXPECT_EQ(read.address, (od::Address{0x1018, 2}));
  EXPECT_EQ(outcome.command->command.timeout, Duration{5});
}

TEST_F(Desk, AnAnswerHasThePartitionOfItsRequest) {
  const auto first = desk.take(request(10), {1}, "plant//operator/alice");
  const auto second = desk.take(request(10), {2}, "plant//operator/bob");
  ASSERT_TRUE(first.command && second.command);
  EXPECT_EQ(desk.answer({.tag = second.command->command.tag})->partition, "plant//operator/bob");
  EXPECT_EQ(desk.answer({.tag = first.command->command.tag})->partition, "plant//operator/alice");
  EXPECT_EQ(desk.take(request(10), {1}, "plant//operator/alice").answer->partition,
            "plant//operator/alice");
  EXPECT_EQ(desk.take(request(0), {1}, "plant//operator/alice").answer->partition,
            "plant//operator/alice")
      << "a refusal";
  EXPECT_EQ(take(request(0)).answer->partition, "");
}

TEST_F(Desk, ChunksArePutTogether) {
  const auto chunks = download(10, 20'480);
  ASSERT_EQ(chunks.size(), 3U);
  EXPECT_FALSE(take(chunks[0]).command);
  EXPECT_FALSE(take(chunks[1]).command);
  const auto outcome = take(chunks[2]);
  ASSERT_TRUE(outcome.command);
  EXPECT_EQ(std::get<line::SdoWrite>(outcome.command->command.request).data,
            known::pattern(20'480, 1));
}

TEST_F(Desk, DuplicatesAreCarriedOutOnceAndAnsweredEachTime) {
  const auto first = take(request(10));
  ASSERT_TRUE(first.command);
  const auto under_way = take(request(10));
  EXPECT_FALSE(under_way.command);
  EXPECT_FALSE(under_way.answer);
  answer(first.command->command.tag);
  for (int i = 0; i < 3; ++i) {
    const auto outcome = take(request(10));
    EXPECT_FALSE(outcome.command);
    ASSERT_TRUE(outcome.answer);
    EXPECT_EQ(outcome.refused, Refusal::none);
    EXPECT_EQ(outcome.answer->id, 10U);
    EXPECT_EQ(outcome.answer->data, known::pattern(4, 2));
  }
}

TEST_F(Desk, TheRestOfALongAnswerIsGivenFromItsOffset) {
  answer(take(request(10)).command->command.tag, 100'000);
  v1::CommandRequest rest = request(10);
  rest.reply_offset(65'536);
  EXPECT_EQ(take(rest).answer_from, 65'536U);
  rest.reply_offset(200'000);
  EXPECT_EQ(take(rest).answer_from, 100'000U);
}

TEST_F(Desk, AnAnswerNoLongerKeptIsNotAskedForByCarryingOutAgain) {
  v1::CommandRequest rest = request(10);
  rest.reply_offset(65'536);
  EXPECT_EQ(refusal(rest), Refusal::bad_request);
}

TEST_F(Desk, TheWindowKeepsTheLast256OfEachClient) {
  for (std::uint64_t id = 1; id <= 257; ++id)
    answer(take(request(id)).command->command.tag);
  EXPECT_TRUE(take(request(2)).answer);
  EXPECT_TRUE(take(request(257)).answer);
  // The desk has forgotten it, so it counts as a new request.
  EXPECT_TRUE(take(request(1)).command);
}

TEST_F(Desk, TheSameIdOfAnotherClientOrLineIsAnother) {
  EXPECT_TRUE(take(request(10)).command);
  EXPECT_TRUE(take(request(10, v1::COMMAND_SDO_READ, "d")).command);
  v1::CommandRequest other = request(10);
  other.line("line2");
  EXPECT_TRUE(take(other).command);
}

// A client on the network can read the names and numbers of others in their replies.
TEST_F(Desk, ARequestOfAnotherParticipantInTheSameNameIsAnother) {
  constexpr std::uint8_t kOther = 2;
  const auto chunks = download(5, 20'000);
  EXPECT_EQ(take(chunks[0]).refused, Refusal::none);
  auto forged = download(5, 20'000);
  forged[0].node(9);
  EXPECT_EQ(take(forged[0], kOther).refused, Refusal::none);
  EXPECT_EQ(take(chunks[1]).refused, Refusal::none);
  const auto whole = take(chunks[2]);
  ASSERT_TRUE(whole.command);
  EXPECT_EQ(line::node_of(whole.command->command), 5);

  const auto first = take(request(6), kOther);
  ASSERT_TRUE(first.command);
  answer(first.command->command.tag);
  const auto victim = take(request(6));
  EXPECT_TRUE(victim.command) << "not a duplicate of the request of another participant";
  EXPECT_FALSE(victim.answer);
}

TEST_F(Desk, AMissingChunkIsRefusedAndTheWholeCanBeSentAgain) {
  const auto chunks = download(10, 30'000);
  take(chunks[0]);
  EXPECT_EQ(refusal(chunks[2]), Refusal::bad_request);
  for (std::size_t i = 0; i < 3; ++i)
    EXPECT_EQ(take(chunks[i]).refused, Refusal::none);
  EXPECT_TRUE(take(chunks[3]).command);
}

TEST_F(Desk, WhatIsOutOfRangeIsRefusedWithTheReason) {
  const auto spoilt = [](auto spoil, std::uint8_t kind = v1::COMMAND_SDO_READ) {
    v1::CommandRequest sample = request(10, kind);
    spoil(sample);
    return sample;
  };
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.kind(8); })), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.kind(255); })), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.node(0); })), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.node(128); })), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.id(0); })), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.client(""); })), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.timeout_ns(-1); })), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.data().resize(8'193); })), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.last(false); })), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.data().resize(1); })), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.nmt(3); }, v1::COMMAND_NMT)), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto&) {}, v1::COMMAND_SDO_WRITE)), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.data().resize(9); }, v1::COMMAND_OUTPUT_WRITE)),
            Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.data().resize(257); }, v1::COMMAND_BUS_FAULT)),
            Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.code(12); }, v1::COMMAND_LSS)), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.data().resize(25); }, v1::COMMAND_LSS)),
            Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.data().resize(65); }, v1::COMMAND_CAN_SEND)),
            Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.data().resize(3); }, v1::COMMAND_CAN_LISTEN)),
            Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto&) {}, v1::COMMAND_OBJECT_WRITE)), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.node(128); }, v1::COMMAND_PDO_TRIGGER)),
            Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.data().resize(1030); }, v1::COMMAND_OBJECT_CREATE)),
            Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.kind(request::kCommandKinds); })), Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.data().resize(6); }, v1::COMMAND_EMCY_SEND)),
            Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.code(4); }, v1::COMMAND_SCAN_APPLY)),
            Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.node(128); }, v1::COMMAND_SCAN_APPLY)),
            Refusal::bad_request);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.line("line3"); })), Refusal::unknown_line);
  EXPECT_EQ(refusal(spoilt([](auto& s) { s.incarnation(76); })), Refusal::wrong_incarnation);
  EXPECT_EQ(take(spoilt([](auto& s) { s.node(0); })).answer->text, "node is not 1..127");
  EXPECT_TRUE(take(spoilt([](auto& s) { s.incarnation(77); })).command);
}

TEST_F(Desk, ANetworkIsNamedByTheCode) {
  v1::CommandRequest sample = request(10, v1::COMMAND_NETWORK_READ);
  EXPECT_EQ(take(sample).answer->text, "code is no network-ID");
  sample.id(11);
  sample.code(0x0203);
  const auto outcome = take(sample);
  ASSERT_TRUE(outcome.command);
  EXPECT_EQ(std::get<line::NetworkRead>(outcome.command->command.request).network, 0x0203);
  v1::CommandRequest back;
  to_wire(outcome.command->command.request, outcome.command->command.timeout, back);
  EXPECT_EQ(back.code(), 0x0203);
  sample.id(12);
  sample.entry(1);
  EXPECT_TRUE(std::get<line::NetworkRead>(take(sample).command->command.request).as_device);
  sample.id(13);
  sample.entry(2);
  EXPECT_EQ(take(sample).answer->text, "entry has other bits than 0 and 8 to 15");
  sample.id(14);
  sample.entry(0);
  sample.kind(v1::COMMAND_NETWORK_WRITE);
  EXPECT_EQ(take(sample).answer->text, "there are no data to write");
}

TEST_F(Desk, VersionsNeedNoLine) {
  v1::CommandRequest sample = request(10, v1::COMMAND_VERSIONS);
  sample.line("");
  const auto outcome = take(sample);
  ASSERT_TRUE(outcome.gateway_command);
  EXPECT_TRUE(std::holds_alternative<request::Versions>(outcome.gateway_command->command.request));
  EXPECT_FALSE(outcome.command);
  answer(outcome.gateway_command->command.tag);
}

TEST_F(Desk, ACommandOfTheGatewayHasItsDataAndIsAnsweredOnce) {
  v1::CommandRequest sample = request(10, v1::COMMAND_BUS_FAULT);
  set_chunk(std::as_bytes(std::span("off", 3)), 0, sample);
  const auto outcome = take(sample);
  ASSERT_TRUE(outcome.gateway_command);
  EXPECT_EQ(outcome.gateway_command->line, "line1");
  EXPECT_EQ(outcome.gateway_command->client, "c");
  const auto& command = outcome.gateway_command->command;
  EXPECT_EQ(std::get<request::BusFault>(command.request).change, "off");
  EXPECT_FALSE(take(sample).gateway_command) << "it is in progress";
  answer(command.tag);
  const auto again = take(sample);
  EXPECT_FALSE(again.gateway_command);
  EXPECT_NE(again.answer, nullptr);
  v1::CommandRequest nowhere = request(11, v1::COMMAND_BUS_RESTART);
  nowhere.line("other");
  EXPECT_EQ(refusal(nowhere), Refusal::unknown_line);
}

TEST_F(Desk, RepliesToNothingAreNotSent) {
  EXPECT_EQ(desk.answer({99, {}, {}}), nullptr);
  const auto tag = take(request(10)).command->command.tag;
  answer(tag);
  EXPECT_EQ(desk.answer({tag, {}, {}}), nullptr);
}

TEST(DeskLimits, ManyCommandsAtOnceAreBusy) {
  CommandDesk desk(1, {"line1"}, {.pending = 2});
  EXPECT_TRUE(desk.take(request(1), {1}).command);
  EXPECT_TRUE(desk.take(request(2), {1}).command);
  EXPECT_EQ(desk.take(request(3), {1}).refused, Refusal::busy);
}

TEST(DeskLimits, TheClientSilentTheLongestMakesRoom) {
  CommandDesk desk(1, {"line1"}, {.clients = 2});
  for (const char* client : {"a", "b"}) {
    const auto outcome = desk.take(request(1, v1::COMMAND_SDO_READ, client), {1});
    desk.answer({outcome.command->command.tag, {}, {}});
  }
  EXPECT_TRUE(desk.take(request(1, v1::COMMAND_SDO_READ, "a"), {1}).answer);
  EXPECT_TRUE(desk.take(request(1, v1::COMMAND_SDO_READ, "c"), {1}).command);
  // The desk has forgotten it, so it counts as a new request.
  EXPECT_TRUE(desk.take(request(1, v1::COMMAND_SDO_READ, "b"), {1}).command);
}

TEST(DeskLimits, ClientsThatAllWaitLeaveNoRoom) {
  CommandDesk desk(1, {"line1"}, {.clients = 1});
  EXPECT_TRUE(desk.take(request(1, v1::COMMAND_SDO_READ, "a"), {1}).command);
  EXPECT_EQ(desk.take(request(1, v1::COMMAND_SDO_READ, "b"), {1}).refused, Refusal::busy);
}

TEST(DeskLimits, LongRequestsAreBounded) {
  CommandDesk desk(1, {"line1"}, {.request = 10'000});
  const auto chunks = download(1, 20'000);
  EXPECT_EQ(desk.take(chunks[0], {1}).refused, Refusal::none);
  EXPECT_EQ(desk.take(chunks[1], {1}).refused, Refusal::bad_request);
}

TEST(DeskLimits, RequestsNeverEndedCostNobodyElse) {
  CommandDesk desk(1, {"line1"}, {.assemblies = 2, .requests = 5 * 8'192});
  for (std::uint64_t id = 1; id <= 100; ++id) {
    EXPECT_EQ(desk.take(download(id, 20'000)[0], {1}).refused, Refusal::none);
  }
  const auto chunks = download(101, 20'000);
  EXPECT_EQ(desk.take(chunks[0], {1}).refused, Refusal::none);
  EXPECT_EQ(desk.take(chunks[1], {1}).refused, Refusal::none);
  EXPECT_TRUE(desk.take(chunks[2], {1}).command);
}

// 256 programs of 16 MB would be 4 GB.
TEST(DeskLimits, TheDataOfCommandsInProgressAreBoundedForEachClient) {
  CommandDesk desk(1, {"line1", "line2"}, {.data = 10'000});
  const auto first = desk.take(download(1, 8'000)[0], {1});
  ASSERT_TRUE(first.command);
  EXPECT_EQ(desk.take(download(2, 2'001)[0], {1}).refused, Refusal::busy);
  ASSERT_TRUE(desk.take(download(3, 2'000)[0], {1}).command);
  EXPECT_TRUE(desk.take(request(4), {1}).command) << "without data";
  EXPECT_TRUE(desk.take(download(2, 8'000)[0], {2}).command) << "another client";
  v1::CommandRequest elsewhere = download(2, 8'000)[0];
  elsewhere.line("line2");
  EXPECT_TRUE(desk.take(elsewhere, {1}).command) << "another line";
  desk.answer({first.command->command.tag, {}, {}});
  EXPECT_TRUE(desk.take(download(2, 8'000)[0], {1}).command) << "the refused one, repeated";
  EXPECT_EQ(desk.take(download(5, 1)[0], {1}).refused, Refusal::busy);
}

TEST(DeskLimits, TheDataOfCommandsInProgressAreBoundedForAll) {
  CommandDesk desk(1, {"line1"}, {.data = 8'000, .all_data = 20'000});
  const auto first = desk.take(download(1, 8'000)[0], {1});
  ASSERT_TRUE(first.command);
  EXPECT_TRUE(desk.take(download(1, 8'000)[0], {2}).command);
  EXPECT_EQ(desk.take(download(1, 8'000)[0], {3}).refused, Refusal::busy);
  EXPECT_TRUE(desk.take(download(1, 4'000)[0], {3}).command);
  desk.answer({first.command->command.tag, {}, {}});
  EXPECT_TRUE(desk.take(download(2, 8'000)[0], {4}).command);
}

TEST(DeskLimits, LongAnswersAreKeptWithinTheirBound) {
  CommandDesk desk(1, {"line1"}, {.answers = 1'000});
  for (std::uint64_t id = 1; id <= 3; ++id) {
    const auto outcome = desk.take(request(id), {1});
    desk.answer({outcome.command->command.tag, {}, known::pattern(400, 1)});
  }
  EXPECT_TRUE(desk.take(request(1), {1}).command);
  EXPECT_TRUE(desk.take(request(2), {1}).answer);
  EXPECT_TRUE(desk.take(request(3), {1}).answer);
}

TEST(CommandSamples, ResultsAreSaidInWords) {
  EXPECT_EQ(describe_result({}), "");
  EXPECT_EQ(describe_result({Domain::sdo, 0x0602'0000}),
            std::string(describe(AbortCode::no_object)));
  EXPECT_EQ(describe_result(line::to_error(Refusal::busy)), std::string(describe(Refusal::busy)));
  EXPECT_EQ(describe_result(line::to_error(Refusal::wrong_role), std::array{std::byte{9}}),
            std::string(describe(Refusal::wrong_role)) + ": node 9 is the active NMT master");
  EXPECT_EQ(
      describe_result(line::to_error(Refusal::wrong_state), std::array{std::byte{2}, std::byte{1}}),
      std::string(describe(Refusal::wrong_state)) +
          ": the watchdog of output group 258 has fired; an OutputWrite with another arming number "
          "comes first");
  EXPECT_EQ(describe_result({Domain::can, 19}), "No such device");
}

}  // namespace
}  // namespace linegate::dds

// SPDX-License-Identifier: Apache-2.0
// Reports of the request receiver about rejected requests, for any number of requests and any
// names.
#include "gateway/publish/request_receiver.h"

#include <algorithm>
#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "tests/gateway/log_keeper.h"
#include "tests/gateway/publish/fake_edge.h"

namespace linegate::gateway {
namespace {

constexpr auto kSdoRead = static_cast<std::uint8_t>(line::CommandKind::sdo_read);

class RequestReceiverTest : public testing::Test {
 protected:
  RequestReceiverTest() {
    config::LinePlan plan;
    plan.config.name = "press";
    hosts.push_back(std::make_unique<LineHost>(plan, image::Layout{}, image::Layout{}));
    hosts[0]->executor = &executor;
    receiver = std::make_unique<RequestReceiver>(
        edge, hosts, PublisherInlets{refusals, gateway_notices, publisher}, clients, "");
    spdlog::default_logger()->set_level(spdlog::level::debug);
  }

  bool was_logged(const std::string& text) { return std::ranges::count(log.lines(), text) == 1; }

  FakeEdge edge;
  LogKeeper log;
  Executor executor{config::ExecutorPlan{}};
  exchange::Ring<line::Reply> refusals{4};
  exchange::Ring<GatewayNotice> gateway_notices{1024};
  exchange::Wakeup publisher;
  ClientDirectory clients;
  std::vector<std::unique_ptr<LineHost>> hosts;
  std::unique_ptr<RequestReceiver> receiver;
};

TEST_F(RequestReceiverTest, NamesOfStrangersDoNotSteerTheLog) {
  receiver->on_command_refused({"pre\nss", "\x1b[2Jme"}, 1, line::Refusal::bad_request, "why");
  EXPECT_TRUE(was_logged("debug pre.ss: command of .[2Jme refused: why"));
  receiver->on_output_refused({"pre\x1bss", "me"}, 1, line::OutputRefusal::not_permitted, "why");
  EXPECT_TRUE(was_logged("debug pre.ss: outputs of group 1 refused: why"));
  GatewayNotice notice;
  ASSERT_TRUE(gateway_notices.pop(notice));
  EXPECT_EQ(notice.text.find_first_of("\n\x1b"), std::string::npos) << notice.text;
}

// Each request has another client and group, so that no reason equals the previous one.
TEST_F(RequestReceiverTest, WhatALineIsToldOfStrangersIsBoundedAndTheRestCounted) {
  constexpr unsigned kMany = 200;
  for (unsigned group = 0; group < kMany; ++group) {
    // so many clients that the limit of each is not reached
    const RequestOrigin origin{"press", "me", {.id = {static_cast<std::uint8_t>(group)}}};
    receiver->on_output_refused(origin, static_cast<std::uint16_t>(group),
                                line::OutputRefusal::not_permitted, "why");
  }
  unsigned reported = 0;
  for (Event event; hosts[0]->port.notices.pop(event); ++reported) {
    EXPECT_EQ(std::get<event::OutputRefused>(event.data).group, reported)
        << "the first rejections are reported";
  }
  // If the machine stalls for a second, it may report more than the limit of one second.
  EXPECT_GE(reported, NoticeLimit::kReasons);
  EXPECT_EQ(hosts[0]->port.requests_lost.value(), 0U);
  receiver->stop();
  if (reported < kMany) {
    EXPECT_TRUE(was_logged("warning press: " + std::to_string(kMany - reported) +
                           " further refusals are not reported as events, too many came at once"));
  }
}

// The reasons of one client leave room for those of others.
TEST_F(RequestReceiverTest, RefusalsOfOneClientAreBoundedAndDoNotHideThoseOfOthers) {
  const RequestOrigin flood{"press", "flood", {.id = {1}, .host = "panel3"}};
  const RequestOrigin other{"press", "other", {.id = {2}, .host = "panel4"}};
  for (std::uint16_t group = 0; group < 100; ++group)
    receiver->on_output_refused(flood, group, line::OutputRefusal::bad_length, "why");
  receiver->on_command_refused(other, kSdoRead, line::Refusal::wrong_incarnation, "why");
  std::vector<Event> events;
  for (Event event; hosts[0]->port.notices.pop(event);)
    events.push_back(event);
  ASSERT_GT(events.size(), NoticeLimit::kOfOneClient);
  // If the machine stalls for a second, it may report more than the limit of one second.
  EXPECT_LT(events.size(), 100U);
  const auto& first = std::get<event::OutputRefused>(events.front().data);
  EXPECT_EQ(clients.describe(first.client), "flood at panel3");
  const auto& last = std::get<event::CommandRefused>(events.back().data);
  EXPECT_EQ(last.refusal, line::Refusal::wrong_incarnation);
  EXPECT_EQ(clients.describe(last.client), "other at panel4");
}

TEST_F(RequestReceiverTest, RequestsForAnUnknownLineAreEventsOfTheGateway) {
  const ClientIdentity alice{.id = {1}, .host = "panel3", .subject = "alice"};
  CommandRequest command{.line = "nowhere", .client = "hmi", .from = alice};
  command.command.request = line::NmtRequest{.node = 5};
  receiver->on_command(command);
  receiver->on_output_write({.line = "nowhere", .client = "hmi", .from = alice});
  receiver->on_command_refused({"nowhere", "hmi", alice}, kSdoRead, line::Refusal::bad_request,
                               "why");
  GatewayNotice notice;
  ASSERT_TRUE(gateway_notices.pop(notice));
  const auto& refused = std::get<event::CommandRefused>(notice.event.data);
  EXPECT_EQ(refused.refusal, line::Refusal::unknown_line);
  EXPECT_EQ(refused.command, line::CommandKind::nmt);
  EXPECT_EQ(notice.text,
            "line 'nowhere' does not exist: command nmt of alice (hmi at panel3) refused: " +
                std::string(line::describe(line::Refusal::unknown_line)));
  ASSERT_TRUE(gateway_notices.pop(notice));
  EXPECT_EQ(notice.event.kind(), EventKind::output_refused);
  EXPECT_EQ(notice.text,
            "line 'nowhere' does not exist: outputs of group 0 of alice (hmi at panel3) refused: " +
                std::string(line::describe(line::OutputRefusal::unknown_group)));
  ASSERT_TRUE(gateway_notices.pop(notice));
  EXPECT_EQ(std::get<event::CommandRefused>(notice.event.data).refusal, line::Refusal::bad_request);
  receiver->on_command(command);
  EXPECT_FALSE(gateway_notices.pop(notice)) << "once a second";
}

TEST_F(RequestReceiverTest, AGroupIsWrittenInTheConfiguredWayAlone) {
  config::LinePlan& plan = hosts[0]->plan;
  plan.outputs = config::Access::all;
  plan.named.groups = {{"drives", 3, {0}}};
  const auto written = [&](std::uint16_t group, bool by_name) {
    OutputRequest request{.line = "press", .client = "hmi", .write = {}, .by_name = by_name};
    request.write.group = group;
    receiver->on_output_write(std::move(request));
    line::OutputWrite write;
    return hosts[0]->port.outputs.pop(write) && write.group == group;
  };
  const auto refusal = [&] {
    Event event;
    return hosts[0]->port.notices.pop(event) ? std::get<event::OutputRefused>(event.data).refusal
                                             : line::OutputRefusal::none;
  };
  EXPECT_TRUE(written(3, true));
  EXPECT_TRUE(written(2, false));
  EXPECT_EQ(refusal(), line::OutputRefusal::none);
  EXPECT_FALSE(written(3, false));
  EXPECT_EQ(refusal(), line::OutputRefusal::written_by_name);
  EXPECT_FALSE(written(2, true));
  EXPECT_EQ(refusal(), line::OutputRefusal::unknown_group);
  plan.outputs = config::Access::read;
  EXPECT_FALSE(written(3, true));
  EXPECT_EQ(refusal(), line::OutputRefusal::not_permitted);
}

// Names that do not exist must not make a table grow.
TEST_F(RequestReceiverTest, EventsOfUnknownLinesAreBounded) {
  for (unsigned i = 0; i < 1000; ++i) {
    CommandRequest command{.line = "nowhere" + std::to_string(i), .client = "hmi"};
    command.command.request = line::NmtRequest{.node = 5};
    command.from.id = {static_cast<std::uint8_t>(i), static_cast<std::uint8_t>(i >> 8U)};
    receiver->on_command(std::move(command));
    for (line::Reply reply; refusals.pop(reply);) {
    }
  }
  unsigned reported = 0;
  for (GatewayNotice notice; gateway_notices.pop(notice);)
    ++reported;
  EXPECT_GE(reported, NoticeLimit::kReasons);
  // If the machine stalls for a second, it may report more than the limit of one second.
  EXPECT_LT(reported, 1000U);
}

TEST_F(RequestReceiverTest, WhatTheEdgeReceivesGoesToTheLineAndItsWarningsToTheLog) {
  edge.receive([](RequestHandler& handler) {
    CommandRequest request{.line = "press", .client = "me"};
    request.command.request = line::SdoRead{};
    request.command.tag = 5;
    handler.on_command(request);
    request.line = "nowhere";
    request.command.tag = 6;
    handler.on_command(request);
  });
  edge.warn("3 datagrams dropped");
  receiver->start();
  for (const std::uint64_t before = receiver->rounds().value();
       receiver->rounds().value() < before + 2;) {
    receiver->wake();
  }
  receiver->stop();
  line::Command command;
  ASSERT_TRUE(hosts[0]->port.commands.pop(command));
  EXPECT_EQ(command.tag, 5U);
  EXPECT_FALSE(hosts[0]->port.commands.pop(command));
  line::Reply reply;
  ASSERT_TRUE(refusals.pop(reply));
  EXPECT_EQ(reply.tag, 6U);
  EXPECT_EQ(reply.error, line::to_error(line::Refusal::unknown_line));
  EXPECT_TRUE(was_logged("warning 3 datagrams dropped"));
}

TEST_F(RequestReceiverTest, RequestsHaveTheNumberOfTheirParticipantWhateverTheirNames) {
  hosts[0]->plan.commands = config::Access::all;
  hosts[0]->plan.outputs = config::Access::all;
  const auto ask = [&](std::uint8_t id, const char* name, line::Request request) {
    CommandRequest out{.line = "press", .client = name};
    out.command.request = std::move(request);
    out.from = {.id = {id}, .host = "panel3"};
    receiver->on_command(std::move(out));
    line::Command command;
    EXPECT_TRUE(hosts[0]->port.commands.pop(command));
    return command;
  };
  const line::Command first = ask(1, "hmi", line::NmtRequest{.node = 5});
  EXPECT_NE(first.client, 0U);
  EXPECT_TRUE(first.audited);
  const line::Command read = ask(1, "hmi again", line::SdoRead{.node = 5});
  EXPECT_EQ(read.client, first.client);
  EXPECT_FALSE(read.audited) << "it changes nothing";
  EXPECT_NE(ask(2, "hmi", line::SdoRead{.node = 5}).client, first.client);
  OutputRequest outputs{.line = "press", .client = "plc", .from = {.id = {2}, .host = "plc1"}};
  receiver->on_output_write(std::move(outputs));
  line::OutputWrite write;
  ASSERT_TRUE(hosts[0]->port.outputs.pop(write));
  EXPECT_EQ(clients.describe(write.client_number), "plc at plc1");
}

TEST_F(RequestReceiverTest, ACommandNeedsTheRightOfItsClientAndTheAccessOfItsLine) {
  hosts[0]->plan.commands = config::Access::all;
  hosts[0]->plan.outputs = config::Access::all;
  const auto refusal = [&](ClientRight right, line::Request request) {
    CommandRequest out{.line = "press", .client = "hmi"};
    out.command.request = std::move(request);
    out.from = {.id = {1}, .host = "panel3", .right = right, .subject = "alice"};
    receiver->on_command(std::move(out));
    line::Command command;
    line::Reply reply;
    if (hosts[0]->port.commands.pop(command))
      return Error{};
    EXPECT_TRUE(refusals.pop(reply));
    return reply.error;
  };
  const Error not_permitted = line::to_error(line::Refusal::not_permitted);
  const Error no_right = line::to_error(line::Refusal::no_right);
  EXPECT_EQ(refusal(ClientRight::operate, line::NmtRequest{.node = 5}), Error{});
  EXPECT_EQ(refusal(ClientRight::operate, line::SdoWrite{.node = 5}), no_right);
  EXPECT_EQ(refusal(ClientRight::engineer, line::SdoWrite{.node = 5}), Error{});
  EXPECT_EQ(refusal(ClientRight::none, line::SdoRead{.node = 5}), no_right);
  hosts[0]->plan.commands = config::Access::read;
  EXPECT_EQ(refusal(ClientRight::engineer, line::SdoWrite{.node = 5}), not_permitted);
  EXPECT_EQ(refusal(ClientRight::operate, line::SdoWrite{.node = 5}), no_right);
  EXPECT_EQ(clients.describe(1), "alice (hmi at panel3)");
  OutputRequest outputs{.line = "press", .from = {.id = {1}, .right = ClientRight::none}};
  receiver->on_output_write(std::move(outputs));
  line::OutputWrite write;
  EXPECT_FALSE(hosts[0]->port.outputs.pop(write));
}

// The operator has to change the line in one case, and needs another certificate in the other.
TEST_F(RequestReceiverTest, ARefusalStatesWhetherTheLineOrTheCertificateRefuses) {
  hosts[0]->plan.outputs = config::Access::off;
  std::vector<std::string> texts;
  const auto notices = [&] {
    for (Event event; hosts[0]->port.notices.pop(event);)
      texts.push_back(describe(event, {}, {}, nullptr));
  };
  for (const ClientRight right : {ClientRight::none, ClientRight::engineer}) {
    CommandRequest command{.line = "press"};
    command.command.request = line::NmtRequest{.node = 5};
    command.from = {.id = {1}, .right = right, .subject = "alice"};
    receiver->on_command(std::move(command));
    notices();
    GatewayCommandRequest restart{.line = "press"};
    restart.command.request = request::BusRestart{};
    restart.from = {.id = {1}, .right = right, .subject = "alice"};
    receiver->on_gateway_command(std::move(restart));
    notices();
    receiver->on_output_write(
        {.line = "press", .from = {.id = {1}, .right = right, .subject = "alice"}});
    notices();
  }
  const std::string certificate(line::describe(line::Refusal::no_right));
  const std::string access(line::describe(line::Refusal::not_permitted));
  EXPECT_EQ(certificate, "not permitted by the client's certificate: its role, or it is revoked");
  EXPECT_EQ(access, "not permitted by the access of the line (`access:` in plant.yaml)");
  ASSERT_EQ(texts.size(), 6U);
  for (std::size_t i = 0; i < texts.size(); ++i) {
    EXPECT_NE(texts[i].find(i < 3 ? certificate : access), std::string::npos) << texts[i];
  }
}

// The executor of the line is late: nobody empties the ring.
// Neither a name without a certificate nor the same name with another role has its access.
TEST_F(RequestReceiverTest, TheAccessOfACertificateReplacesThatOfItsLine) {
  hosts[0]->plan.commands = config::Access::read;
  hosts[0]->plan.outputs = config::Access::off;
  hosts[0]->plan.clients = {
      {"operator/alice", {config::Access::all, config::Access::all}},
      {"engineer/erin", {config::Access::off, config::Access::off}},
  };
  const auto accepted = [&](ClientRight right, const std::string& subject, line::Request request) {
    CommandRequest out{.line = "press"};
    out.command.request = std::move(request);
    out.from = {.id = {1}, .host = "panel3", .right = right, .subject = subject};
    receiver->on_command(std::move(out));
    OutputRequest outputs{.line = "press", .from = {.id = {1}, .right = right, .subject = subject}};
    receiver->on_output_write(std::move(outputs));
    line::Command command;
    line::OutputWrite write;
    line::Reply reply;
    while (refusals.pop(reply)) {
    }
    return std::pair(hosts[0]->port.commands.pop(command), hosts[0]->port.outputs.pop(write));
  };
  const auto write = line::SdoWrite{.node = 5};
  const auto nmt = line::NmtRequest{.node = 5};
  const auto read = line::SdoRead{.node = 5};
  EXPECT_EQ(accepted(ClientRight::operate, "alice", nmt), std::pair(true, true));
  EXPECT_EQ(accepted(ClientRight::operate, "alice", write), std::pair(false, true)) << "the role";
  EXPECT_EQ(accepted(ClientRight::engineer, "alice", nmt), std::pair(false, false));
  EXPECT_EQ(accepted(ClientRight::unlimited, "alice", nmt), std::pair(false, false));
  EXPECT_EQ(accepted(ClientRight::operate, "", nmt), std::pair(false, false));
  EXPECT_EQ(accepted(ClientRight::engineer, "erin", read), std::pair(false, false));
  EXPECT_EQ(accepted(ClientRight::operate, "erin", read), std::pair(true, false)) << "of the line";
}

TEST_F(RequestReceiverTest, AClientDoesNotLockOthersOut) {
  hosts[0]->plan.commands = config::Access::all;
  hosts[0]->plan.outputs = config::Access::all;
  const auto send = [&](std::uint8_t id, std::size_t count) {
    for (std::size_t i = 0; i < count; ++i) {
      CommandRequest command{.line = "press"};
      command.command.request = line::SdoRead{.node = 5};
      command.from.id = {id};
      receiver->on_command(std::move(command));
      OutputRequest outputs{.line = "press"};
      outputs.from.id = {id};
      receiver->on_output_write(std::move(outputs));
    }
  };
  send(1, 1000);
  const std::size_t lost = hosts[0]->port.requests_lost.value();
  EXPECT_EQ(lost, 1000 - LinePort::kOfOneClient);
  send(2, 10);
  EXPECT_EQ(hosts[0]->port.requests_lost.value(), lost);
  std::map<std::uint32_t, std::size_t> commands;
  for (line::Command command; hosts[0]->port.commands.pop(command);) {
    ++commands[command.client];
  }
  EXPECT_EQ(commands, (std::map<std::uint32_t, std::size_t>{{1, LinePort::kOfOneClient}, {2, 10}}));
  send(1, 10);
  line::Command command;
  EXPECT_TRUE(hosts[0]->port.commands.pop(command)) << "the ring was emptied";
}

TEST_F(RequestReceiverTest, ARefusalNamesTheClient) {
  CommandRequest request{.line = "press", .client = "hmi"};
  request.command.request = line::NmtRequest{.node = 5};
  request.from.id = {7};
  receiver->on_command(std::move(request));
  Event event;
  ASSERT_TRUE(hosts[0]->port.notices.pop(event));
  const auto* const refused = event.get<event::CommandRefused>();
  ASSERT_NE(refused, nullptr);
  EXPECT_EQ(refused->refusal, line::Refusal::not_permitted);
  EXPECT_EQ(clients.describe(refused->client), "hmi");
}

TEST_F(RequestReceiverTest, CommandsOfTheGatewayReachTheInterfaceOfAPermittedLine) {
  const auto ask = [&](const char* name, request::GatewayRequest what) {
    GatewayCommandRequest request{.line = name, .client = "hmi"};
    request.command = {.tag = 9, .request = std::move(what)};
    request.from.id = {7};
    receiver->on_gateway_command(std::move(request));
    line::Reply reply;
    return refusals.pop(reply) ? std::optional(reply) : std::nullopt;
  };
  const auto versions = ask("", request::Versions{});
  ASSERT_TRUE(versions);
  EXPECT_TRUE(versions->ok());
  EXPECT_EQ(versions->tag, 9U);
  EXPECT_EQ(ask("other", request::BusRestart{})->error,
            line::to_error(line::Refusal::unknown_line));
  EXPECT_EQ(ask("press", request::BusRestart{})->error,
            line::to_error(line::Refusal::not_permitted));
  Event event;
  ASSERT_TRUE(hosts[0]->port.notices.pop(event));
  EXPECT_EQ(event.get<event::CommandRefused>()->command, request::BusRestart::kKind);

  hosts[0]->plan.commands = config::Access::all;
  EXPECT_FALSE(ask("press", request::BusFault{"off"}));
  request::GatewayCommand command;
  ASSERT_TRUE(hosts[0]->port.interface_commands.pop(command));
  EXPECT_EQ(std::get<request::BusFault>(command.request).change, "off");
  EXPECT_EQ(clients.describe(command.client), "hmi");
  EXPECT_TRUE(command.audited);
  for (std::size_t i = 0; i < LinePort::kOfOneClient; ++i) {
    EXPECT_FALSE(ask("press", request::BusRestart{})) << i;
  }
  EXPECT_EQ(ask("press", request::BusRestart{})->error, line::to_error(line::Refusal::busy));
}

TEST_F(RequestReceiverTest, AReadOfTheJournalNeedsNoLineAndIsRefusedWithASentence) {
  const auto ask = [&](RequestReceiver& of, ClientRight right, std::uint8_t client) {
    GatewayCommandRequest request{.line = "nowhere", .client = "hmi"};
    request.command = {.tag = 9, .request = request::JournalRead{}};
    request.from.id = {client};
    request.from.right = right;
    of.on_gateway_command(std::move(request));
    line::Reply reply;
    return refusals.pop(reply) ? std::optional(reply) : std::nullopt;
  };
  const auto sentence = [](const line::Reply& reply) {
    return std::string(reinterpret_cast<const char*>(reply.bytes().data()), reply.bytes().size());
  };
  const auto without = ask(*receiver, ClientRight::unlimited, 1);
  ASSERT_TRUE(without);
  EXPECT_EQ(without->error, line::to_error(line::Refusal::wrong_state));
  EXPECT_EQ(sentence(*without), "this gateway has no journal (journal: in its plant.yaml)");

  exchange::Ring<line::Reply> pages{4};
  JournalServer server("/nowhere/journal.db", pages, publisher);  // not started: requests wait
  RequestReceiver with(edge, hosts, PublisherInlets{refusals, gateway_notices, publisher}, clients,
                       "", &server);
  EXPECT_EQ(ask(with, ClientRight::none, 1)->error, line::to_error(line::Refusal::no_right));
  for (std::size_t i = 0; i < JournalServer::kOfOneClient; ++i) {
    EXPECT_FALSE(ask(with, ClientRight::operate, 1)) << i;
  }
  const auto crowded = ask(with, ClientRight::operate, 1);
  ASSERT_TRUE(crowded);
  EXPECT_EQ(crowded->error, line::to_error(line::Refusal::busy));
  EXPECT_FALSE(ask(with, ClientRight::operate, 2)) << "another client has its own share";
  Event event;
  EXPECT_FALSE(hosts[0]->port.notices.pop(event)) << "no line is concerned";
}

}  // namespace
}  // namespace linegate::gateway

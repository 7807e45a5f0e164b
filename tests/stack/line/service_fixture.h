// SPDX-License-Identifier: Apache-2.0
// A service of a line without the line: the parts that it uses, and a host that records its replies
// and events.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "stack/line/build.h"
#include "stack/line/flying_master_service.h"
#include "stack/line/own_dictionary.h"
#include "stack/line/own_objects.h"
#include "stack/line/service.h"
#include "stack/manager/manager.h"
#include "stack/node/node.h"
#include "stack/routing/forward_objects.h"
#include "stack/sdo/write_rule.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {

inline constexpr std::uint8_t kOwnNode = 127;
inline constexpr std::uint8_t kAxis = 5;
inline constexpr od::Address kType{0x1000, 0};  // device type

// Records the commands that another service passes on.
struct ServiceStub final : Service {
  using Service::Service;
  void execute(Command command, Instant /*now*/) override { taken.push_back(std::move(command)); }
  void advance(Instant /*now*/) override {}
  Instant next_wake() const override { return kNever; }
  void end(Refusal /*why*/, Instant /*now*/) override {}

  std::vector<Command> taken;
};

class RecordingHost final : public ServiceHost {
 public:
  using ServiceHost::services;

  void reply(std::uint64_t tag, Error error, ReplyData data) override {
    EXPECT_FALSE(replies_.contains(tag)) << "a second reply to " << tag;
    replies_[tag] = {.tag = tag, .error = error, .data = std::move(data)};
  }
  void answer_when_sent(FramesUnderWay::Sending sending, Instant /*now*/) override {
    sendings_.push_back(std::move(sending));
  }
  void refuse_gone(const std::function<bool(const Command&)>& is_gone, Refusal why,
                   Instant now) override {
    std::erase_if(sendings_, [&](const FramesUnderWay::Sending& sending) {
      const bool gone = is_gone(sending.command);
      if (gone) {
        refuse(sending.command, why, now, 0, {});
      }
      return gone;
    });
  }
  void refuse_unsent(CommandKind of, Refusal why, Instant now) override {
    std::erase_if(sendings_, [&](const FramesUnderWay::Sending& sending) {
      if (kind(sending.command) == of) {
        refuse(sending.command, why, now, 0, {});
      }
      return kind(sending.command) == of;
    });
  }
  bool bus_is_stuck(Instant /*now*/) const override { return stuck_; }
  void refuse(const Command& command, Refusal refusal, Instant /*now*/, std::uint8_t /*node*/,
              ReplyData data) override {
    reply(command.tag, to_error(refusal), std::move(data));
  }
  bool is_running() const override { return true; }
  bool usable() const override { return usable_; }
  bool manages() const override { return manages_; }

  // Commands that wait for the acknowledgement of their frames.
  std::vector<FramesUnderWay::Sending>& sendings() { return sendings_; }
  // The bus acknowledges the frames of all of them.
  void acknowledge() {
    for (FramesUnderWay::Sending& sending : std::exchange(sendings_, {})) {
      reply(sending.command.tag, Error{}, std::move(sending.data));
    }
  }
  // The time limit of all of them expires.
  void expire(Service& service, Instant now) {
    for (FramesUnderWay::Sending& sending : std::exchange(sendings_, {})) {
      service.answer_unsent(sending, now);
    }
  }
  void set_stuck(bool stuck) { stuck_ = stuck; }

  void set_usable(bool usable) { usable_ = usable; }
  void set_manages(bool manages) { manages_ = manages; }
  // nullopt: not answered yet.
  std::optional<Error> answer(std::uint64_t tag) const {
    const auto found = replies_.find(tag);
    return found == replies_.end() ? std::nullopt : std::optional(found->second.error);
  }
  const ReplyData& data(std::uint64_t tag) const { return replies_.at(tag).data; }
  const std::vector<std::byte>& bytes(std::uint64_t tag) const { return replies_.at(tag).bytes(); }

 private:
  bool usable_ = true;
  bool manages_ = true;
  bool stuck_ = false;
  std::vector<FramesUnderWay::Sending> sendings_;
  std::map<std::uint64_t, Reply> replies_;
};

// A manager with node 5 in its network list; no device answers.
struct ManagerParts final : manager::Host {
  explicit ManagerParts(bool started = true) {
    if (started) {
      manager.start(now);
    }
  }

  void node_data_invalid(std::uint8_t /*node*/) override {}
  void mandatory_nodes_booted(Instant /*now*/) override {}
  void send_nmt(nmt::Command /*command*/, std::uint8_t /*node*/, Instant /*now*/) override {}
  bool acknowledges_starts() const override { return awaits_acknowledgements; }
  void command_own(nmt::Command /*command*/, Instant /*now*/) override {}
  nmt::State own_state() const override { return nmt::State::pre_operational; }

  Instant now{seconds(10)};
  bool awaits_acknowledgements = false;
  LineConfig config = config_with_axis();
  EventLog events;
  od::Dictionary dictionary = make_own_dictionary(config);
  can::Dispatch dispatch;
  can::TransmitQueue transmit;
  nmt::HeartbeatConsumer heartbeats{dispatch, events};
  sdo::Arbiter sdo{dispatch, transmit, events};
  manager::Manager manager{
      node_plans(config), manager_options(config), dictionary, sdo, heartbeats, events, *this};
};

// The same plan as in Line::make().
inline pdo::LinkPlan plan_of(const LineConfig& config) {
  pdo::LinkPlan plan = *link_plan(config).value;
  EXPECT_TRUE(place_own_objects(config, plan));
  routing::show_in_records(config.forwarding, plan);
  return plan;
}

struct EveryWrite final : sdo::WriteRule {
  AbortCode may_write(std::uint8_t /*node*/, od::Address /*address*/,
                      std::span<const std::byte> /*value*/, Instant /*now*/) const override {
    return AbortCode::none;
  }
};

// The own node of a line in Operational, with its own objects and the PDOs of node 5.
struct NodeParts {
  explicit NodeParts(LineConfig line_config) : config(std::move(line_config)) {
    od::Dictionary dictionary = make_own_dictionary(config);
    EXPECT_TRUE(own_objects.add_to(dictionary).ok());
    EXPECT_TRUE(pdo::add_linked_objects(dictionary, image, plan).ok());
    EXPECT_TRUE(forwarded.add_to(dictionary).ok());
    node = std::make_unique<node::Node>(std::move(dictionary),
                                        node::Options{.node_id = config.node_id}, events, &image);
    node->pdos().link(plan);
    node->start(now);
    node->command(nmt::Command::start, now);
  }

  Instant now{seconds(10)};
  LineConfig config;
  EventLog events;
  pdo::LinkPlan plan = plan_of(config);
  image::ProcessImage image{plan.inputs, plan.outputs};
  OwnObjects own_objects{config.own_objects, image, events};
  routing::ForwardObjects forwarded{config.forwarding, image};
  std::unique_ptr<node::Node> node;
};

// The service of an own node that is no flying master.
struct NoFlyingMaster final : NmtHost {
  NoFlyingMaster(ServiceHost& host, NodeParts& parts, manager::Manager& manager)
      : service(host, parts.config,
                {.node = *parts.node,
                 .own_objects = parts.own_objects,
                 .manager = manager,
                 .nmt_host = *this,
                 .events = parts.events}) {}

  void nmt_sent(nmt::Command /*command*/, std::uint8_t /*node*/, Instant /*now*/) override {}
  bool has_failed() const override { return false; }

  FlyingMasterService service;
};

}  // namespace linegate::line

// SPDX-License-Identifier: Apache-2.0
// A service of a line without the line: the parts that it uses, and a host that keeps what it says.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "stack/line/build.h"
#include "stack/line/own_dictionary.h"
#include "stack/line/service.h"
#include "stack/manager/manager.h"
#include "stack/node/node.h"

#include "tests/stack/line/line_fixture.h"

namespace linegate::line {

class RecordingHost final : public ServiceHost {
 public:
  void reply(std::uint64_t tag, Error error, std::vector<std::byte> data) override {
    EXPECT_FALSE(replies_.contains(tag)) << "a second reply to " << tag;
    replies_[tag] = {.tag = tag, .error = error, .data = std::move(data)};
  }
  // At once: there is no bus.
  void answer_when_sent(FramesUnderWay::Sending sending, Instant /*now*/) override {
    reply(sending.command.tag, {}, std::move(sending.data));
  }
  void refuse(const Command& command, Refusal refusal, Instant /*now*/) override {
    reply(command.tag, to_error(refusal), {});
  }
  bool is_running() const override { return true; }
  bool usable() const override { return usable_; }
  bool manages() const override { return manages_; }

  void set_usable(bool usable) { usable_ = usable; }
  void set_manages(bool manages) { manages_ = manages; }
  // nullopt: none so far.
  std::optional<Error> answer(std::uint64_t tag) const {
    const auto found = replies_.find(tag);
    return found == replies_.end() ? std::nullopt : std::optional(found->second.error);
  }
  const std::vector<std::byte>& data(std::uint64_t tag) const { return replies_.at(tag).data; }

 private:
  bool usable_ = true;
  bool manages_ = true;
  std::map<std::uint64_t, Reply> replies_;
};

// A manager with node 5 in its network list, which nobody plays.
struct ManagerParts final : manager::Host {
  ManagerParts() { manager.start(now); }

  void node_data_invalid(std::uint8_t /*node*/) override {}
  void may_operate(Instant /*now*/) override {}
  void send_nmt(nmt::Command /*command*/, std::uint8_t /*node*/, Instant /*now*/) override {}
  bool acknowledges_starts() const override { return false; }
  void command_own(nmt::Command /*command*/, Instant /*now*/) override {}
  nmt::State own_state() const override { return nmt::State::pre_operational; }

  Instant now{seconds(10)};
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

// The own node of a line with the PDOs of node 5, Operational.
struct NodeParts {
  explicit NodeParts(LineConfig line_config) : config(std::move(line_config)) {
    od::Dictionary dictionary = make_own_dictionary(config);
    EXPECT_TRUE(pdo::add_linked_objects(dictionary, image, plan).ok());
    node = std::make_unique<node::Node>(std::move(dictionary),
                                        node::Options{.node_id = config.node_id}, events, &image);
    node->pdos().link(plan);
    node->start(now);
    node->command(nmt::Command::start, now);
  }

  Instant now{seconds(10)};
  LineConfig config;
  EventLog events;
  pdo::LinkPlan plan = *link_plan(config).value;
  image::ProcessImage image{plan.inputs, plan.outputs};
  std::unique_ptr<node::Node> node;
};

}  // namespace linegate::line

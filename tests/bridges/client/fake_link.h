// SPDX-License-Identifier: Apache-2.0
// A link without DDS: a test gives the samples, and sees what the client sends.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <memory>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "bridges/client/link.h"
#include "stack/base/events.h"

namespace linegate::client {

// What a test keeps of a link that its client owns.
struct FakeWorld {
  Instant now{std::chrono::seconds(100)};
  std::int64_t utc = 1'000'000;
  bool fails = false;  // each function of the link throws
  std::vector<std::string> gateways{"gw"};
  std::deque<std::function<void(dds::ClientListener&)>> samples;
  std::uint64_t sent = 0;                                          // the last id
  std::vector<std::pair<dds::Target, request::Request>> requests;  // the first has id 1
  std::vector<std::uint64_t> cancelled;
  std::vector<std::pair<dds::Target, line::OutputWrite>> writes;
  od::Scaling scaling;        // of both values, in layouts from now on
  std::size_t out_bytes = 1;  // of the output, in layouts from now on; more are an OCTET_STRING

  // namesakes: number of other gateways of its name, if there are any.
  void line(std::uint64_t incarnation, const std::string& namesakes = {});
  void node(std::uint64_t incarnation, const line::NodeState& state);
  void gateway(std::uint64_t incarnation, std::uint64_t events);
  void gateway_event(std::uint64_t incarnation, std::uint64_t number);
  void layout(image::Direction direction, std::uint64_t incarnation, std::uint64_t id = 7,
              const std::string& name = {});
  void image(image::Direction direction, std::uint64_t incarnation, std::uint8_t value,
             std::uint64_t id = 7);
  void invalid_image(image::Direction direction, std::uint64_t incarnation);
  void group(std::uint64_t incarnation, const line::OutputState& state);
  void group_gone(std::uint16_t group);
  void gone();
  void progress(std::uint8_t node, const event::CommandProgress& progress);
  void reply(std::uint64_t id, linegate::Error error, std::vector<std::byte> bytes = {});
  // All of a line that is ready: an input "ram.In" and an output "ram.Out", both UNSIGNED8.
  void whole_line(std::uint64_t incarnation);

 private:
  std::uint64_t sequence_ = 0;
};

class FakeLink : public Link {
 public:
  explicit FakeLink(std::shared_ptr<FakeWorld> world) : world_(std::move(world)) {}

  void poll(linegate::Duration timeout, dds::ClientListener& listener) override {
    check();
    if (world_->samples.empty())
      world_->now += timeout;
    while (!world_->samples.empty()) {
      const auto sample = std::move(world_->samples.front());
      world_->samples.pop_front();
      sample(listener);
    }
  }
  void wake() override { check(); }
  std::uint64_t send(const dds::Target& target, const request::Request& request,
                     linegate::Duration /*timeout*/, std::uint64_t /*layout_id*/) override {
    check();
    world_->requests.emplace_back(target, request);
    return ++world_->sent;
  }
  void cancel(std::uint64_t id) override {
    check();
    world_->cancelled.push_back(id);
  }
  bool write_outputs(const dds::Target& target, const line::OutputWrite& write) override {
    check();
    world_->writes.emplace_back(target, write);
    return true;
  }
  dds::Peers peers() const override {
    check();
    return {world_->gateways, std::chrono::seconds(1)};
  }
  std::string name() const override { return "app"; }
  Instant now() const override { return world_->now; }
  std::int64_t utc() const override { return world_->utc; }

 private:
  void check() const {
    if (world_->fails)
      throw std::runtime_error("the link fails");
  }
  std::shared_ptr<FakeWorld> world_;
};

inline Client fake_client(const std::shared_ptr<FakeWorld>& world) {
  return make_client(make_core(std::make_unique<FakeLink>(world)));
}

}  // namespace linegate::client

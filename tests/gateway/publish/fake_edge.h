// SPDX-License-Identifier: Apache-2.0
// An edge without a network: keeps the published samples, and delivers the requests of a test.
#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "gateway/publish/data_edge.h"

namespace linegate::gateway {

// samples(): one line of text for each published sample, such as "event press 3". Thread-safe.
class FakeEdge final : public DataEdge {
 public:
  std::vector<std::string> samples() const {
    const std::lock_guard lock(mutex_);
    return samples_;
  }
  // Queues a request for the next poll().
  void receive(std::function<void(RequestHandler&)> request) {
    const std::lock_guard lock(mutex_);
    requests_.push_back(std::move(request));
    changed_.notify_all();
  }
  // The stream in the newest GatewayState before the newest event. While the publisher is stopped.
  std::uint64_t stream_before_event() const { return stream_before_event_; }
  // The text of the newest event. While the publisher is stopped.
  const std::string& event_text() const { return event_text_; }
  // Whether it accepts images. While the publisher is stopped.
  void accept_images(bool accepts) { accepts_images_ = accepts; }
  void warn(std::string warning) {
    const std::lock_guard lock(mutex_);
    warnings_.push_back(std::move(warning));
    changed_.notify_all();
  }
  // While the publisher is stopped.
  void set_namesakes(std::size_t others) { namesakes_ = others; }
  // The properties of the newest LineState. While the publisher is stopped.
  const std::vector<Property>& line_properties() const { return line_properties_; }
  void fail(std::uint64_t samples) {
    const std::lock_guard lock(mutex_);
    failed_ += samples;
  }

  bool add_line(const std::string& line) override { return add("line " + line); }
  void remove_line(const std::string& line) override { add("end " + line); }

  void set_clock(const ClockMap&) override {}
  void publish_line(const LineInfo& info, const line::LineState&, Instant,
                    const std::vector<Property>& properties) override {
    line_properties_ = properties;
    std::string text = "state " + info.name;
    for (const Property& property : properties) {
      text += ' ' + property.name + '=' + property.value;
    }
    add(text);
  }
  void publish_node(std::string_view line, const NodeInfo& info, const line::NodeState& state,
                    Instant, const std::vector<Property>&) override {
    add("node " + std::string(line) + ' ' + std::to_string(state.node) + ' ' + info.name);
  }
  void publish_output_state(std::string_view line, const line::OutputState& state,
                            Instant) override {
    const std::string refused =
        state.refused_client.empty() ? "" : " refused=" + state.refused_client;
    add("outputs " + std::string(line) + ' ' + std::to_string(state.group) + refused);
  }
  void publish_layout(std::string_view line, const image::Layout&) override {
    add("layout " + std::string(line));
  }
  bool accepts_image(std::string_view, image::Direction) const override { return accepts_images_; }
  void publish_image(std::string_view line, const image::Snapshot& snapshot) override {
    add("image " + std::string(line) + ' ' + std::to_string(snapshot.sequence));
  }
  void set_named_types(std::string_view, image::Direction,
                       std::span<const named::DeviceType> types) override {
    std::string text = "types";
    for (const named::DeviceType& type : types) {
      text += ' ' + type.topic();
    }
    add(text);
  }
  // Whether named topics have readers; has_readers() is then called again.
  void set_readers(bool present) {
    std::function<void()> changed;
    {
      const std::lock_guard lock(mutex_);
      readers_ = present;
      changed = readers_changed_;
    }
    changed();
  }
  bool has_readers(const named::DeviceType&) override {
    const std::lock_guard lock(mutex_);
    return readers_;
  }
  void watch_readers(std::function<void()> changed) override {
    const std::lock_guard lock(mutex_);
    readers_changed_ = std::move(changed);
  }
  void publish_named(const NamedSample& sample, const image::Snapshot& snapshot) override {
    add(sample.type.topic() + ' ' + std::to_string(sample.number) + " of image " +
        std::to_string(snapshot.sequence));
  }
  void publish_pdo_update(std::string_view line, const image::Layout&, const image::Snapshot&,
                          const image::PdoMark& mark, std::uint32_t receptions) override {
    add("pdo " + std::string(line) + ' ' + std::to_string(mark.remote_pdo) + ' ' +
        std::to_string(receptions));
  }
  void publish_reception(std::string_view line, const image::Layout&,
                         const pdo::Reception&) override {
    add("reception " + std::string(line));
  }
  void publish_gateway(const GatewayInfo& info, Instant) override {
    stream_ = info.event_stream;
    add("gateway " + info.version + ' ' + std::to_string(info.participants));
  }
  void publish_event(std::string_view line, const Event& event, std::string_view text) override {
    stream_before_event_ = stream_;
    event_text_ = text;
    add("event " + std::string(line) + ' ' + std::to_string(event.number));
  }
  EventMembers members(const EventData& data) const override {
    return {static_cast<std::uint32_t>(kind(data)), 2, {std::byte{3}}};
  }

  std::uint64_t failed_samples() const override {
    const std::lock_guard lock(mutex_);
    return failed_;
  }
  std::size_t participants() const override { return 0; }
  EdgeStatistics statistics() const override { return {}; }
  std::size_t namesakes() const override { return namesakes_; }
  std::vector<std::string> other_gateways() const override { return {"hall"}; }

  void poll(Duration timeout, RequestHandler& handler) override {
    std::vector<std::function<void(RequestHandler&)>> requests;
    {
      std::unique_lock lock(mutex_);
      changed_.wait_for(lock, timeout,
                        [&] { return woken_ || !requests_.empty() || !warnings_.empty(); });
      woken_ = false;
      requests.swap(requests_);
    }
    for (const auto& request : requests) {
      request(handler);
    }
  }
  void wake() override {
    const std::lock_guard lock(mutex_);
    woken_ = true;
    changed_.notify_all();
  }
  std::vector<std::string> warnings(Instant) override {
    const std::lock_guard lock(mutex_);
    return std::exchange(warnings_, {});
  }
  void reply(const line::Reply& reply) override { add("reply " + std::to_string(reply.tag)); }

 private:
  bool add(const std::string& sample) {
    const std::lock_guard lock(mutex_);
    samples_.push_back(sample);
    return true;
  }

  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<std::string> samples_;
  std::vector<std::function<void(RequestHandler&)>> requests_;
  std::vector<std::string> warnings_;
  std::vector<Property> line_properties_;
  std::string event_text_;
  std::size_t namesakes_ = 0;
  bool accepts_images_ = true;
  std::uint64_t failed_ = 0;
  std::uint64_t stream_ = 0;
  std::uint64_t stream_before_event_ = 0;
  bool woken_ = false;
  bool readers_ = true;
  std::function<void()> readers_changed_;
};

}  // namespace linegate::gateway

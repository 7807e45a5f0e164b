// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/port_server.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdint>
#include <exception>
#include <mutex>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "bridges/dds/image_samples.h"
#include "bridges/dds/message_link.h"
#include "bridges/dds/named_read_type.h"
#include "bridges/dds/port_codec.h"
#include "bridges/dds/sample_port.h"
#include "bridges/dds/served_topics.h"

namespace linegate::dds {
namespace {

constexpr auto kStatusPeriod = std::chrono::milliseconds(50);
constexpr int kSamplesOfTopic = 256;  // in one poll(), so that no topic starves the other

class EndpointServer final : public PortServer {
 public:
  EndpointServer(const GatewayOptions& options, std::unique_ptr<SamplePort> port)
      : port_(std::move(port)) {
    shared_image_.gateway(options.gateway);
    shared_image_.incarnation(options.incarnation);
    port_->watch_timers();
  }
  ~EndpointServer() override { port_->watch_named_readers({}); }
  EndpointServer(const EndpointServer&) = delete;
  EndpointServer& operator=(const EndpointServer&) = delete;

  bool handle(Message message) override;
  void publish(std::string_view line, const image::Snapshot& snapshot,
               const ClockMap& clock) override;
  void watch_readers(std::function<void()> changed) override {
    port_->watch_named_readers([this, changed = std::move(changed)] {
      {
        const std::lock_guard lock(mutex_);
        readers_changed_ = true;
      }
      changed();
    });
  }
  bool readers_changed() const override {
    const std::lock_guard lock(mutex_);
    return readers_changed_;
  }
  void look_at_readers() override;
  bool poll(Duration timeout, const Send& send) override;
  void wake() override { port_->wake(); }
  guard::Stall longest_stall() const override { return port_->longest_stall(); }

 private:
  template <class Sample>
  void write(Message message, Sample& sample);
  void write_reply(Message message);
  template <class Encode>
  bool pass_on(Encode encode, const Send& send);
  template <class Sample>
  bool pass_on_all(FromEndpoints kind, Sample& sample, const Send& send, int& passed);
  template <class Sample>
  bool pass_on_lines(FromEndpoints kind, Sample& sample, const Send& send, int& passed);
  bool follow(Message message);
  void apply_follow();
  bool add_topic(Message message);
  bool end_topics(Message message);
  void write_named(Message message);
  void add_failed(std::uint64_t samples);
  bool pass_on_named(const Send& send, int& passed);
  bool send_waiting(const Send& send);
  void send_status(const Send& send);

  const std::unique_ptr<SamplePort> port_;

  // Used by handle(): buffers are reused.
  v1::GatewayState gateway_;
  v1::LineState line_;
  v1::NodeState node_;
  v1::OutputState output_state_;
  v1::ImageLayout layout_;
  v1::ProcessImage image_;
  v1::ProcessImage shared_image_;
  v1::PdoUpdate update_;
  v1::PdoReception reception_;
  v1::Event event_;
  v1::CommandReply reply_;
  std::string reply_partition_;
  ServedTopics topics_{*port_};

  // Used by poll().
  PortMessage waiting_;  // a message for which there was no room
  v1::OutputWrite output_;
  v1::CommandRequest request_;
  v1::LineState other_state_;
  v1::ImageLayout other_layout_;
  v1::ProcessImage other_image_;
  NamedReceived named_;
  ServedSets sets_{*port_};
  Participant from_;              // the sender of the one that was taken last
  std::uint64_t unreadable_ = 0;  // samples that were not reported yet
  std::chrono::steady_clock::time_point status_due_{};
  EndpointStatus reported_;
  bool status_reported_ = false;

  mutable std::mutex mutex_;  // held for a moment
  bool readers_changed_ = false;
  std::uint64_t failed_ = 0;                         // samples that DDS refused
  std::optional<std::vector<RemoteLine>> followed_;  // not applied yet
};

template <class Sample>
void EndpointServer::write(Message message, Sample& sample) {
  if (!decode_sample(message, sample) || !port_->write(sample))
    add_failed(1);
}

void EndpointServer::write_reply(Message message) {
  if (!decode_sample_in(message, reply_partition_, reply_) ||
      !port_->write(reply_, reply_partition_))
    add_failed(1);
}

void EndpointServer::add_failed(std::uint64_t samples) {
  const std::lock_guard lock(mutex_);
  failed_ += samples;
}

bool EndpointServer::handle(Message message) {
  switch (static_cast<ToEndpoints>(kind_of(message))) {
    case ToEndpoints::add_line:
      port_->add_line(decode_text(message).value_or(""));
      return true;
    case ToEndpoints::remove_line:
      port_->remove_line(decode_text(message).value_or(""));
      return true;
    case ToEndpoints::forget_pdos:
      port_->forget_pdos(decode_text(message).value_or(""));
      return true;
    case ToEndpoints::gateway_state:
      write(message, gateway_);
      return true;
    case ToEndpoints::line_state:
      write(message, line_);
      return true;
    case ToEndpoints::node_state:
      write(message, node_);
      return true;
    case ToEndpoints::output_state:
      write(message, output_state_);
      return true;
    case ToEndpoints::image_layout:
      write(message, layout_);
      return true;
    case ToEndpoints::process_image:
      write(message, image_);
      return true;
    case ToEndpoints::pdo_update:
      write(message, update_);
      return true;
    case ToEndpoints::pdo_reception:
      write(message, reception_);
      return true;
    case ToEndpoints::event:
      write(message, event_);
      return true;
    case ToEndpoints::command_reply:
      write_reply(message);
      return true;
    case ToEndpoints::share_images:
      return true;
    case ToEndpoints::follow:
      return follow(message);
    case ToEndpoints::named_topic:
    case ToEndpoints::named_set:
      return add_topic(message);
    case ToEndpoints::end_topics:
    case ToEndpoints::end_sets:
      return end_topics(message);
    case ToEndpoints::named_sample:
      write_named(message);
      return true;
    case ToEndpoints::configure:
    case ToEndpoints::stop:
      break;
  }
  return false;
}

void EndpointServer::publish(std::string_view line, const image::Snapshot& snapshot,
                             const ClockMap& clock) {
  shared_image_.line(std::string(line));
  if (!to_wire(snapshot, clock, shared_image_) || !port_->write(shared_image_))
    add_failed(1);
}

// The thread that polls adds and removes readers.
bool EndpointServer::add_topic(Message message) {
  auto topic = decode_numbered_topic(message);
  if (!topic)
    return false;
  if (kind_of(message) == static_cast<std::uint8_t>(ToEndpoints::named_set)) {
    sets_.add(std::move(*topic));
    port_->wake();
  } else if (!topics_.add(*topic)) {
    add_failed(1);
  }
  return true;
}

bool EndpointServer::end_topics(Message message) {
  auto topics = decode_topics(message);
  if (!topics)
    return false;
  if (kind_of(message) == static_cast<std::uint8_t>(ToEndpoints::end_sets)) {
    sets_.remove(std::move(*topics));
    port_->wake();
  } else {
    topics_.remove(*topics);
  }
  return true;
}

void EndpointServer::write_named(Message message) {
  const auto sample = decode_named_sample(message);
  if (!sample || !topics_.write(*sample))
    add_failed(1);
}

// The thread that polls applies it.
bool EndpointServer::follow(Message message) {
  auto lines = decode_follow(message);
  if (!lines)
    return false;
  {
    const std::lock_guard lock(mutex_);
    followed_ = std::move(*lines);
  }
  port_->wake();
  return true;
}

void EndpointServer::apply_follow() {
  std::optional<std::vector<RemoteLine>> lines;
  {
    const std::lock_guard lock(mutex_);
    lines = std::exchange(followed_, std::nullopt);
  }
  if (lines && !port_->follow(*lines))
    add_failed(1);
}

void EndpointServer::look_at_readers() {
  {
    const std::lock_guard lock(mutex_);
    if (!std::exchange(readers_changed_, false))
      return;
  }
  if (topics_.look_at_readers())
    port_->wake();
}

bool EndpointServer::poll(Duration timeout, const Send& send) {
  apply_follow();
  add_failed(sets_.apply());
  if (!send_waiting(send) || !topics_.report(send))
    return false;
  const bool any = port_->wait(timeout);
  std::array<int, 6> passed{};
  const bool room =
      !any || (pass_on_all(FromEndpoints::output_write, output_, send, passed[0]) &&
               pass_on_all(FromEndpoints::command_request, request_, send, passed[1]) &&
               pass_on_named(send, passed[5]) &&
               pass_on_lines(FromEndpoints::image_layout, other_layout_, send, passed[2]) &&
               pass_on_lines(FromEndpoints::process_image, other_image_, send, passed[3]) &&
               pass_on_lines(FromEndpoints::line_state, other_state_, send, passed[4]));
  if (!room || std::ranges::find(passed, kSamplesOfTopic) != passed.end()) {
    port_->wake();  // the next wait() reports new samples only
    return room;
  }
  port_->all_outputs_taken();
  port_->all_commands_taken();
  port_->all_named_taken();
  port_->all_lines_taken();
  send_status(send);
  return true;
}

template <class Sample>
bool EndpointServer::pass_on_all(FromEndpoints kind, Sample& sample, const Send& send,
                                 int& passed) {
  bool room = true;
  while (room && passed < kSamplesOfTopic) {
    const SamplePort::Taken taken = port_->take(sample, from_);
    if (taken == SamplePort::Taken::none)
      break;
    ++passed;
    const auto encode = [&](PortMessage& out) { encode_received(kind, from_, sample, out); };
    room = taken == SamplePort::Taken::invalid || pass_on(encode, send);
  }
  return room;
}

template <class Sample>
bool EndpointServer::pass_on_lines(FromEndpoints kind, Sample& sample, const Send& send,
                                   int& passed) {
  bool room = true;
  while (room && passed < kSamplesOfTopic) {
    const SamplePort::Taken taken = port_->take_other(sample);
    if (taken == SamplePort::Taken::none)
      break;
    ++passed;
    const auto encode = [&](PortMessage& out) {
      encode_sample(static_cast<std::uint8_t>(kind), sample, out);
    };
    room = taken == SamplePort::Taken::invalid || pass_on(encode, send);
  }
  return room;
}

bool EndpointServer::pass_on_named(const Send& send, int& passed) {
  bool room = true;
  while (room && passed < kSamplesOfTopic) {
    const SamplePort::Taken taken = port_->take_named(named_, from_);
    if (taken == SamplePort::Taken::none)
      break;
    ++passed;
    const std::uint32_t number = sets_.number_of(named_.topic);
    const auto encode = [&](PortMessage& out) {
      encode_named_write(from_, {number, named_.octets}, out);
    };
    room = taken == SamplePort::Taken::invalid || number == 0 || pass_on(encode, send);
  }
  return room;
}

// A sample beyond the bounds of the contract must neither end this process nor wait for ever.
template <class Encode>
bool EndpointServer::pass_on(Encode encode, const Send& send) {
  try {
    encode(waiting_);
  } catch (const std::exception&) {
    waiting_.clear();
  }
  if (waiting_.empty() || waiting_.size() > kLongestMessage) {
    waiting_.clear();
    ++unreadable_;
    return true;
  }
  return send_waiting(send);
}

bool EndpointServer::send_waiting(const Send& send) {
  if (!waiting_.empty() && !send(waiting_))
    return false;
  waiting_.clear();
  return true;
}

// Not after each sample, because counters of datagrams change with each. What has no room is sent
// later; only the newest state counts.
void EndpointServer::send_status(const Send& send) {
  const auto now = std::chrono::steady_clock::now();
  if (now < status_due_)
    return;
  status_due_ = now + kStatusPeriod;
  PortMessage message;
  unreadable_ += port_->pop_unreadable();
  if (unreadable_ != 0) {
    encode_unreadable(unreadable_, message);
    unreadable_ = send(message) ? 0 : unreadable_;
  }
  if (const std::string_view policy = port_->output_misfit(); !policy.empty()) {
    encode(FromEndpoints::output_misfit, policy, message);
    send(message);
  }
  if (const std::string_view policy = port_->command_misfit(); !policy.empty()) {
    encode(FromEndpoints::command_misfit, policy, message);
    send(message);
  }
  const SamplePort::Misfit misfit = port_->named_misfit();
  if (const std::uint32_t number = sets_.number_of(std::string(misfit.topic)); number != 0) {
    encode(NamedMisfitMessage{number, std::string(misfit.policy)}, message);
    send(message);
  }
  EndpointStatus status{.discovery = port_->discovery(),
                        .guard = port_->guard_counters(),
                        .namesakes = static_cast<std::uint32_t>(port_->namesakes()),
                        .next_expiry = port_->next_expiry(),
                        .other_gateways = port_->other_gateways()};
  {
    const std::lock_guard lock(mutex_);
    status.failed = failed_;
  }
  if (status_reported_ && status == reported_)
    return;
  encode(status, message);
  status_reported_ = send(message);
  reported_ = std::move(status);
}

}  // namespace

std::optional<PortServer::SharedImages> PortServer::shared_images(Message message) {
  auto shared = decode_shared_images(message);
  if (!shared)
    return std::nullopt;
  return SharedImages{shared->tag, std::move(shared->line)};
}

std::optional<std::string> PortServer::removed_line(Message message) {
  if (kind_of(message) != static_cast<std::uint8_t>(ToEndpoints::remove_line))
    return std::nullopt;
  return decode_text(message);
}

std::unique_ptr<PortServer> PortServer::make(Message configure, const Send& send,
                                             const AddFunctions& add_functions) {
  const bool is_first = kind_of(configure) == static_cast<std::uint8_t>(ToEndpoints::configure);
  auto options = is_first ? decode_options(configure) : std::nullopt;
  if (!options)
    return nullptr;
  if (add_functions)
    add_functions(options->security);
  auto made = make_local_port(*options);
  PortMessage answer;
  encode(made.value ? FromEndpoints::ready : FromEndpoints::failed, made.diagnostics, answer);
  if (!send(answer) || !made.value)
    return nullptr;
  return std::make_unique<EndpointServer>(*options, std::move(*made.value));
}

}  // namespace linegate::dds

// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/publisher.h"

#include <algorithm>
#include <chrono>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <utility>

#include <fastdds/dds/core/condition/GuardCondition.hpp>
#include <fastdds/dds/core/condition/WaitSet.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <linegatePubSubTypes.h>

#include "bridges/dds/command_desk.h"
#include "bridges/dds/command_samples.h"
#include "bridges/dds/endpoints.h"
#include "bridges/dds/event_samples.h"
#include "bridges/dds/image_samples.h"
#include "bridges/dds/inbound_reader.h"
#include "bridges/dds/output_samples.h"
#include "bridges/dds/output_state_samples.h"
#include "bridges/dds/pdo_writer.h"
#include "bridges/dds/renewed_writer.h"
#include "bridges/dds/reply_writer.h"
#include "bridges/dds/state_samples.h"
#include "bridges/dds/state_writer.h"
#include "bridges/dds/waiting.h"

namespace linegate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;

constexpr std::size_t kSamplesPerPoll = 256;  // of each topic, so that none starves the other

// Name of a QoS policy that writer and reader must match (DDS 1.4 2.2.3).
std::string_view policy_name(std::uint32_t id) {
  switch (id) {
    case fast::DURABILITY_QOS_POLICY_ID:
      return "durability";
    case fast::DEADLINE_QOS_POLICY_ID:
      return "deadline";
    case fast::OWNERSHIP_QOS_POLICY_ID:
      return "ownership";
    case fast::LIVELINESS_QOS_POLICY_ID:
      return "liveliness";
    case fast::RELIABILITY_QOS_POLICY_ID:
      return "reliability";
    default:
      return "another policy";
  }
}

// Writers with one instance each. They are separate for each line because they may continue for
// long while those of other lines are silent, and cannot be written again like states
// (state_writer.h): a reader would consider them new samples.
struct LineWriters {
  using Slot = std::optional<RenewedWriter>;

  // Creates the missing writers. Returns false if one could not be created.
  bool make(Endpoints& endpoints, std::uint64_t renew_after) {
    for (Slot* image : {&inputs, &outputs}) {
      if (writer(*image) == nullptr) {
        image->emplace(endpoints, renew_after, RenewedWriter::Keep::until_received, [&endpoints] {
          return endpoints.writer<v1::ProcessImagePubSubType>(v1::TOPIC_PROCESS_IMAGE);
        });
      }
    }
    if (writer(receptions) == nullptr) {
      receptions.emplace(endpoints, renew_after, RenewedWriter::Keep::until_received, [&endpoints] {
        return endpoints.writer<v1::PdoReceptionPubSubType>(v1::TOPIC_PDO_RECEPTION);
      });
    }
    make_events(events, endpoints, renew_after);
    return writer(inputs) != nullptr && writer(outputs) != nullptr &&
           writer(receptions) != nullptr && writer(events) != nullptr;
  }
  static void make_events(Slot& events, Endpoints& endpoints, std::uint64_t renew_after) {
    if (writer(events) == nullptr) {
      events.emplace(endpoints, renew_after, RenewedWriter::Keep::history, [&endpoints] {
        return endpoints.writer<v1::EventPubSubType>(v1::TOPIC_EVENT);
      });
    }
  }
  static fast::DataWriter* writer(const Slot& slot) { return slot ? slot->writer() : nullptr; }

  Slot inputs;
  Slot outputs;
  Slot receptions;
  Slot events;
  std::uint64_t receptions_published = 0;
};

// Returns false if there is no writer, or DDS refused the sample.
template <class Sample>
bool write(std::optional<RenewedWriter>& slot, Sample& sample) {
  return LineWriters::writer(slot) != nullptr && slot->next()->write(&sample);
}

}  // namespace

struct GatewayBridge::Impl {
  Impl(const GatewayOptions& options, std::vector<Diagnostic>& diagnostics);
  ~Impl();

  template <class Sample>
  void address(std::string_view line, Sample& sample) const;
  bool count(bool written);
  // Returns no_writers if there is no such line.
  LineWriters& writers_of(std::string_view line);

  bool take_output(GatewayHandler& handler);
  bool take_command(GatewayHandler& handler);
  void handle(const v1::CommandRequest& request, const fast::SampleInfo& info,
              GatewayHandler& handler);
  const Participant& sender(const fast::SampleInfo& info);
  void tell_what_was_not_taken(GatewayHandler& handler);
  bool send(const Answer& answer, std::size_t from);

  const std::string gateway;
  const std::uint64_t incarnation;
  const Duration last_words;
  const std::uint64_t renew_after;
  Participant last_sender;  // of the thread that calls poll()

  Endpoints endpoints;
  StateWriter<v1::GatewayStatePubSubType> states{endpoints, v1::TOPIC_GATEWAY_STATE, renew_after};
  StateWriter<v1::LineStatePubSubType> line_states{endpoints, v1::TOPIC_LINE_STATE, renew_after};
  StateWriter<v1::NodeStatePubSubType> node_states{endpoints, v1::TOPIC_NODE_STATE, renew_after};
  StateWriter<v1::OutputStatePubSubType> output_states{endpoints, v1::TOPIC_OUTPUT_STATE,
                                                       renew_after};
  StateWriter<v1::ImageLayoutPubSubType> layouts{endpoints, v1::TOPIC_IMAGE_LAYOUT, renew_after};
  std::map<std::string, LineWriters, std::less<>> lines;
  LineWriters no_writers;
  LineWriters::Slot own_events;
  PdoWriter pdos{endpoints, renew_after};
  ReplyWriter replies{endpoints, renew_after};

  // Used by the publishing thread. Samples are members so that their buffers are reused.
  ClockMap clock;
  PublishCounters counters;
  v1::GatewayState gateway_sample;
  v1::LineState line_sample;
  v1::NodeState node_sample;
  v1::OutputState output_state_sample;
  v1::ImageLayout layout_sample;
  v1::ProcessImage image_sample;
  v1::PdoUpdate pdo_sample;
  v1::PdoReception reception_sample;
  v1::Event event_sample;

  // Used by the polling thread.
  Waiting waiting;
  std::unique_ptr<InboundReader<v1::OutputWritePubSubType>> outputs;
  std::unique_ptr<InboundReader<v1::CommandRequestPubSubType>> requests;
  v1::OutputWrite output_sample;
  v1::CommandRequest request_sample;

  std::mutex desk_mutex;  // poll() and reply() share the desk; not held while DDS writes
  CommandDesk desk;
};

GatewayBridge::Impl::Impl(const GatewayOptions& options, std::vector<Diagnostic>& diagnostics)
    : gateway(options.gateway),
      incarnation(options.incarnation),
      last_words(options.last_words),
      renew_after(options.renew_after),
      endpoints("linegate " + options.gateway, options.domain, options.profile_file, diagnostics,
                options.guard, options.participants),
      desk(options.incarnation, options.lines) {
  LineWriters::make_events(own_events, endpoints, renew_after);
  for (const std::string& line : options.lines)
    lines[line].make(endpoints, renew_after);
  outputs = std::make_unique<InboundReader<v1::OutputWritePubSubType>>(endpoints, waiting,
                                                                       v1::TOPIC_OUTPUT_WRITE);
  requests = std::make_unique<InboundReader<v1::CommandRequestPubSubType>>(
      endpoints, waiting, v1::TOPIC_COMMAND_REQUEST);
  endpoints.seal();
}

// The end of a writer is sent by discovery, not with its samples, and may overtake them.
GatewayBridge::Impl::~Impl() {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + last_words;
  const auto left = [&] { return std::max(Duration::zero(), Duration{deadline - Clock::now()}); };
  const auto wait_for_readers_of = [&](fast::DataWriter* writer) {
    if (writer != nullptr)
      writer->wait_for_acknowledgments(to_dds(left()));
  };
  for (const auto& [name, writers] : lines)
    wait_for_readers_of(LineWriters::writer(writers.events));
  wait_for_readers_of(LineWriters::writer(own_events));
  wait_for_readers_of(states.writer());
  wait_for_readers_of(node_states.writer());
  wait_for_readers_of(output_states.writer());
  wait_for_readers_of(line_states.writer());
  for (const auto& [name, writers] : lines) {
    wait_for_readers_of(LineWriters::writer(writers.inputs));
    wait_for_readers_of(LineWriters::writer(writers.outputs));
    wait_for_readers_of(LineWriters::writer(writers.receptions));
  }
  replies.wait_for_acknowledgments(left());
}

template <class Sample>
void GatewayBridge::Impl::address(std::string_view line, Sample& sample) const {
  sample.gateway(gateway);
  sample.line(std::string(line));
  sample.incarnation(incarnation);
}

bool GatewayBridge::Impl::count(bool written) {
  ++(written ? counters.samples : counters.failed);
  return written;
}

LineWriters& GatewayBridge::Impl::writers_of(std::string_view line) {
  const auto found = lines.find(line);
  return found == lines.end() ? no_writers : found->second;
}

DiscoveryCounters GatewayBridge::discovery() const {
  return impl_->endpoints.discovery();
}

guard::Counters GatewayBridge::guard_counters() const {
  return impl_->endpoints.guard_counters();
}

std::size_t GatewayBridge::namesakes() const {
  return impl_->endpoints.namesakes();
}

std::vector<std::string> GatewayBridge::other_gateways() const {
  return impl_->endpoints.peers().gateways;
}

// --- lines ---------------------------------------------------------------------------------------

bool GatewayBridge::add_line(const std::string& line) {
  impl_->desk.add_line(line);
  return impl_->lines[line].make(impl_->endpoints, impl_->renew_after);
}

void GatewayBridge::remove_line(const std::string& line) {
  impl_->desk.remove_line(line);
  const auto of_line = [&](const auto& sample) { return sample.line() == line.c_str(); };
  impl_->node_states.end(of_line);
  impl_->output_states.end(of_line);
  impl_->line_states.end(of_line);
  impl_->layouts.end(of_line);
  impl_->pdos.forget(line);
  LineWriters& writers = impl_->lines[line];
  for (LineWriters::Slot* image : {&writers.inputs, &writers.outputs, &writers.receptions}) {
    if (*image)
      (*image)->remove();
    image->reset();
  }
}

// --- out -----------------------------------------------------------------------------------------

Loaded<std::unique_ptr<GatewayBridge>> GatewayBridge::make(const GatewayOptions& options) {
  Loaded<std::unique_ptr<GatewayBridge>> result;
  auto impl = std::make_unique<Impl>(options, result.diagnostics);
  if (impl->endpoints.ok()) {
    result.value = std::unique_ptr<GatewayBridge>(new GatewayBridge(std::move(impl)));
  }
  return result;
}

GatewayBridge::GatewayBridge(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {
}
GatewayBridge::~GatewayBridge() = default;

void GatewayBridge::set_clock(const ClockMap& clock) {
  impl_->clock = clock;
}

const PublishCounters& GatewayBridge::counters() const {
  return impl_->counters;
}

bool GatewayBridge::publish(const LineInfo& line, const line::LineState& state, Instant now,
                            const std::vector<Property>& properties) {
  v1::LineState& sample = impl_->line_sample;
  impl_->address(line.name, sample);
  sample.time(impl_->clock.utc(now));
  sample.clock(static_cast<std::uint8_t>(impl_->clock.quality));
  to_wire(line, state, sample);
  to_wire(properties, sample.properties());
  return impl_->count(impl_->line_states.write(sample));
}

bool GatewayBridge::publish(const GatewayInfo& info, Instant now) {
  v1::GatewayState& sample = impl_->gateway_sample;
  sample.gateway(impl_->gateway);
  sample.incarnation(impl_->incarnation);
  sample.time(impl_->clock.utc(now));
  sample.clock(static_cast<std::uint8_t>(impl_->clock.quality));
  to_wire(info, impl_->clock, sample);
  return impl_->count(impl_->states.write(sample));
}

bool GatewayBridge::publish(std::string_view line, const NodeInfo& info,
                            const line::NodeState& state, Instant now,
                            const std::vector<Property>& properties) {
  v1::NodeState& sample = impl_->node_sample;
  impl_->address(line, sample);
  sample.time(impl_->clock.utc(now));
  sample.clock(static_cast<std::uint8_t>(impl_->clock.quality));
  to_wire(info, state, impl_->clock, sample);
  to_wire(properties, sample.properties());
  return impl_->count(impl_->node_states.write(sample));
}

bool GatewayBridge::publish(std::string_view line, const line::OutputState& state, Instant now) {
  v1::OutputState& sample = impl_->output_state_sample;
  impl_->address(line, sample);
  to_wire(state, impl_->clock, now, sample);
  return impl_->count(impl_->output_states.write(sample));
}

bool GatewayBridge::publish(std::string_view line, const image::Layout& layout) {
  if (layout.entries.size() > kMaxEntries) {
    ++impl_->counters.failed;
    return false;
  }
  if (layout.direction == image::Direction::inputs)
    impl_->pdos.forget(line);
  v1::ImageLayout& sample = impl_->layout_sample;
  impl_->address(line, sample);
  const std::uint16_t parts = layout_parts(layout);
  bool written = true;
  for (std::uint16_t part = 0; part < parts; ++part) {
    to_wire(layout, part, sample);
    written = impl_->count(impl_->layouts.write(sample)) && written;
  }
  return written;
}

bool GatewayBridge::publish(std::string_view line, const image::Snapshot& snapshot) {
  v1::ProcessImage& sample = impl_->image_sample;
  impl_->address(line, sample);
  if (!to_wire(snapshot, impl_->clock, sample)) {
    ++impl_->counters.failed;
    return false;
  }
  LineWriters& writers = impl_->writers_of(line);
  const bool is_input = snapshot.direction == image::Direction::inputs;
  return impl_->count(write(is_input ? writers.inputs : writers.outputs, sample));
}

bool GatewayBridge::publish_pdo_update(std::string_view line, const image::Layout& layout,
                                       const image::Snapshot& snapshot, const image::PdoMark& mark,
                                       std::uint32_t receptions) {
  v1::PdoUpdate& sample = impl_->pdo_sample;
  impl_->address(line, sample);
  if (!to_wire(layout, snapshot, mark, receptions, impl_->clock, sample)) {
    ++impl_->counters.failed;
    return false;
  }
  return impl_->count(impl_->pdos.write(sample));
}

bool GatewayBridge::publish(std::string_view line, const image::Layout& layout,
                            const pdo::Reception& reception) {
  v1::PdoReception& sample = impl_->reception_sample;
  LineWriters& writers = impl_->writers_of(line);
  impl_->address(line, sample);
  sample.number(++writers.receptions_published);
  return impl_->count(to_wire(layout, reception, impl_->clock, sample) &&
                      write(writers.receptions, sample));
}

bool GatewayBridge::publish(std::string_view line, const Event& event, std::string_view text,
                            const std::vector<Property>& properties) {
  v1::Event& sample = impl_->event_sample;
  impl_->address(line, sample);
  to_wire(event, text, impl_->clock, sample);
  to_wire(properties, sample.properties());
  LineWriters::Slot& slot = line.empty() ? impl_->own_events : impl_->writers_of(line).events;
  return impl_->count(write(slot, sample));
}

// --- in ------------------------------------------------------------------------------------------

std::size_t GatewayBridge::poll(Duration timeout, GatewayHandler& handler) {
  std::size_t outputs = 0;
  std::size_t commands = 0;
  if (impl_->waiting.wait(timeout)) {
    while (outputs < kSamplesPerPoll && impl_->take_output(handler))
      ++outputs;
    while (commands < kSamplesPerPoll && impl_->take_command(handler))
      ++commands;
  }
  impl_->tell_what_was_not_taken(handler);
  if (outputs < kSamplesPerPoll)
    impl_->outputs->renew_if_full();
  if (commands < kSamplesPerPoll)
    impl_->requests->renew_if_full();
  if (outputs == kSamplesPerPoll || commands == kSamplesPerPoll)
    impl_->waiting.wake();
  return outputs + commands;
}

void GatewayBridge::Impl::tell_what_was_not_taken(GatewayHandler& handler) {
  if (const std::uint64_t unreadable = endpoints.take_unreadable(); unreadable != 0)
    handler.on_unreadable(unreadable);
  if (const std::uint32_t policy = outputs->misfit(); policy != 0)
    handler.on_misfit(v1::TOPIC_OUTPUT_WRITE, policy_name(policy));
  if (const std::uint32_t policy = requests->misfit(); policy != 0)
    handler.on_misfit(v1::TOPIC_COMMAND_REQUEST, policy_name(policy));
}

void GatewayBridge::wake() {
  impl_->waiting.wake();
}

bool GatewayBridge::Impl::take_output(GatewayHandler& handler) {
  fast::SampleInfo info;
  if (!outputs->take(output_sample, info))
    return false;
  if (!info.valid_data || output_sample.gateway() != gateway.c_str())
    return true;
  OutputMessage message;
  message.line = output_sample.line().to_string();
  message.client = output_sample.client().to_string();
  if (output_sample.incarnation() != 0 && output_sample.incarnation() != incarnation) {
    handler.on_output_refused(message.line, output_sample.group(),
                              line::OutputRefusal::stale_layout,
                              "meant for another start of the gateway");
    return true;
  }
  const OutputCheck check = from_wire(output_sample, message.write);
  if (check.refusal != line::OutputRefusal::none) {
    handler.on_output_refused(message.line, output_sample.group(), check.refusal, check.why);
  } else {
    message.from = sender(info);
    handler.on_output_write(std::move(message));
  }
  return true;
}

bool GatewayBridge::Impl::take_command(GatewayHandler& handler) {
  fast::SampleInfo info;
  if (!requests->take(request_sample, info))
    return false;
  if (info.valid_data && request_sample.gateway() == gateway.c_str())
    handle(request_sample, info, handler);
  return true;
}

// Requests of one participant often follow each other.
const Participant& GatewayBridge::Impl::sender(const fast::SampleInfo& info) {
  Participant from;
  const auto writer = eprosima::fastrtps::rtps::iHandle2GUID(info.publication_handle);
  std::copy_n(writer.guidPrefix.value, from.prefix.size(), from.prefix.begin());
  if (from.prefix != last_sender.prefix || last_sender.host.empty()) {
    from.host = endpoints.host_of(from.prefix);
    last_sender = std::move(from);
  }
  return last_sender;
}

void GatewayBridge::Impl::handle(const v1::CommandRequest& request, const fast::SampleInfo& info,
                                 GatewayHandler& handler) {
  CommandDesk::Outcome outcome;
  {
    const std::lock_guard lock(desk_mutex);
    outcome = desk.take(request);
  }
  if (outcome.answer)
    send(*outcome.answer, outcome.answer_from);
  if (outcome.refused != line::Refusal::none) {
    handler.on_command_refused(outcome.answer->line, outcome.answer->client, request.kind(),
                               outcome.refused, outcome.answer->text);
  }
  if (outcome.command) {
    outcome.command->from = sender(info);
    handler.on_command(std::move(*outcome.command));
  }
}

bool GatewayBridge::reply(const line::Reply& reply) {
  std::shared_ptr<const Answer> answer;
  {
    const std::lock_guard lock(impl_->desk_mutex);
    answer = impl_->desk.answer(reply);
  }
  return answer && impl_->send(*answer, 0);
}

// Two threads may call it at once: the sample is local.
bool GatewayBridge::Impl::send(const Answer& answer, std::size_t from) {
  v1::CommandReply sample;
  address(answer.line, sample);
  sample.client(answer.client);
  sample.id(answer.id);
  sample.domain(static_cast<std::uint8_t>(answer.error.domain));
  sample.code(answer.error.code);
  sample.text(answer.text);
  sample.total(static_cast<std::uint32_t>(answer.data.size()));
  for (std::size_t chunk = 0; chunk < kChunksPerReply; ++chunk) {
    set_chunk(answer.data, from, sample);
    if (!replies.write(sample))
      return false;
    if (sample.last())
      break;
    from += sample.data().size();
  }
  return true;
}

}  // namespace linegate::dds

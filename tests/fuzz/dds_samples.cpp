// SPDX-License-Identifier: Apache-2.0
// The input is a sequence of samples from unknown participants (dds_input.h). Each is deserialized
// as by a reader of bridges/dds and passed to the same functions as in the bridge. Promises: no
// crash, every unreadable sample is counted, every rejection has a reason, and every accepted
// sample is within the bounds of the contract.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <memory>
#include <set>
#include <span>
#include <vector>

#include <linegatePubSubTypes.h>

#include "bridges/dds/command_desk.h"
#include "bridges/dds/command_samples.h"
#include "bridges/dds/event_samples.h"
#include "bridges/dds/image_samples.h"
#include "bridges/dds/layout_assembly.h"
#include "bridges/dds/output_samples.h"
#include "bridges/dds/output_state_samples.h"
#include "bridges/dds/received_type.h"
#include "bridges/dds/request_codec.h"
#include "bridges/dds/request_tracker.h"
#include "bridges/dds/state_samples.h"
#include "bridges/request/journal.h"

#include "tests/fuzz/dds_input.h"
#include "tests/fuzz/expect.h"

namespace {

using namespace linegate;
using namespace linegate::dds;
using fuzz::Topic;

constexpr ClockMap kUtc{};
constexpr DeskLimits kLimits{.clients = 3,
                             .window = 4,
                             .pending = 4,
                             .assemblies = 2,
                             .request = 64,
                             .answers = 64,
                             .requests = 128};

class Peer {
 public:
  Peer() {
    const std::array<line::Request, fuzz::kRequests> requests{
        line::ObjectWrite{}, line::LocalRead{.what = line::ObjectRange{}}, line::Configure{},
        line::Scan{}};
    for (std::uint64_t id = 1; id <= fuzz::kRequests; ++id) {
      Request request;
      request.target = {fuzz::kGateway, fuzz::kLine, 0};
      request.request = requests[id - 1];
      request.data.resize(id == 1 ? 10'000 : 0);
      request.id = id;
      request.deadline = now_ + std::chrono::seconds(10);
      publishers_.note(request.target.gateway, request.target.line, kPublisher, now_);
      tracker_.add(request, now_);
      asked_.insert(id);
    }
  }

  void receive(Topic topic, std::span<const std::uint8_t> octets) {
    switch (topic) {
      case Topic::line_state:
        return read<v1::LineStatePubSubType>(octets);
      case Topic::node_state:
        return read<v1::NodeStatePubSubType>(octets);
      case Topic::image_layout:
        return read<v1::ImageLayoutPubSubType>(octets);
      case Topic::process_image:
        return read<v1::ProcessImagePubSubType>(octets);
      case Topic::pdo_update:
        return read<v1::PdoUpdatePubSubType>(octets);
      case Topic::event:
        return read<v1::EventPubSubType>(octets);
      case Topic::output_write:
        return read<v1::OutputWritePubSubType>(octets);
      case Topic::command_request:
        return read<v1::CommandRequestPubSubType>(octets);
      case Topic::command_reply:
        return read<v1::CommandReplyPubSubType>(octets);
      case Topic::gateway_state:
        return read<v1::GatewayStatePubSubType>(octets);
      case Topic::output_state:
        return read<v1::OutputStatePubSubType>(octets);
      case Topic::pdo_reception:
        return read<v1::PdoReceptionPubSubType>(octets);
    }
  }

  // No request stays pending for ever.
  void finish() {
    now_ += std::chrono::hours(1);
    while (const auto done = tracker_.expired(now_))
      LINEGATE_EXPECT(asked_.erase(done->result.id) == 1);
    LINEGATE_EXPECT(asked_.empty() && tracker_.empty());
    LINEGATE_EXPECT(unreadable_->take() == failed_);
  }

 private:
  template <class PubSubType>
  void read(std::span<const std::uint8_t> octets) {
    ReceivedType<PubSubType> type(unreadable_);
    typename PubSubType::type sample;
    eprosima::fastrtps::rtps::SerializedPayload_t payload;
    payload.reserve(static_cast<std::uint32_t>(std::max<std::size_t>(octets.size(), 1)));
    payload.length = static_cast<std::uint32_t>(octets.size());
    if (!octets.empty())
      std::memcpy(payload.data, octets.data(), octets.size());
    if (!type.deserialize(&payload, &sample)) {
      ++failed_;
      return;
    }
    eprosima::fastrtps::rtps::InstanceHandle_t handle;
    LINEGATE_EXPECT(type.getKey(&sample, &handle, false));
    take(sample);
  }

  // --- of the client ---------------------------------------------------------------------------

  void take(const v1::GatewayState& sample) {
    GatewayInfo info;
    from_wire(sample, kUtc, info);
    LINEGATE_EXPECT(info.lines.size() <= kMaxGatewayLines && info.counters.size() <= kMaxCounters);
    LINEGATE_EXPECT(info.version.size() <= 64 && kUtc.utc(info.started) == sample.started());
  }

  void take(const v1::LineState& sample) {
    LineInfo info;
    line::LineState state;
    from_wire(sample, info, state);
    take(sample.properties());
    LINEGATE_EXPECT(info.name.size() <= 64 && info.interface_uri.size() <= 128);
    (void)name(info.access);
  }

  void take(const v1::NodeState& sample) {
    NodeInfo info;
    line::NodeState state;
    from_wire(sample, kUtc, info, state);
    take(sample.properties());
    LINEGATE_EXPECT(info.name.size() <= 64 && kUtc.utc(state.last_heard) == sample.last_heard());
    (void)line::describe_boot(state.boot);
  }

  void take(const std::vector<v1::Property>& sample) {
    std::vector<Property> properties;
    from_wire(sample, properties);
    LINEGATE_EXPECT(properties.size() == sample.size());
  }

  void take(const v1::ImageLayout& sample) {
    image::Layout layout;
    if (!assembly_.take(sample, layout))
      return;
    LINEGATE_EXPECT(layout.entries.size() <= kMaxEntries);
    LINEGATE_EXPECT(layout.byte_size <= image::kMaxAreaBytes);
    for (const image::Entry& entry : layout.entries) {
      LINEGATE_EXPECT(std::uint64_t{entry.bit_offset} + entry.bit_length <=
                      std::uint64_t{layout.byte_size} * 8);
      LINEGATE_EXPECT(std::isfinite(entry.scaling.scale) && std::abs(entry.scaling.scale) > 0);
      LINEGATE_EXPECT(std::isfinite(entry.scaling.offset) && entry.inhibit >= Duration::zero());
    }
    image::Layout again;
    LINEGATE_EXPECT(!assembly_.take(sample, again));
    layout_ = std::move(layout);
  }

  void take(const v1::ProcessImage& sample) {
    image::Snapshot snapshot;
    if (!from_wire(sample, kUtc, snapshot))
      return;
    LINEGATE_EXPECT(snapshot.bytes.size() <= image::kMaxAreaBytes);
    LINEGATE_EXPECT(snapshot.changed.size() == snapshot.valid.size());
    v1::ProcessImage back;
    LINEGATE_EXPECT(to_wire(snapshot, kUtc, back));
    LINEGATE_EXPECT(back.bytes() == sample.bytes() && back.time() == sample.time());
    for (const image::PdoMark& mark : snapshot.marks) {
      v1::PdoUpdate update;
      if (to_wire(layout_, snapshot, mark, 1, kUtc, update))
        LINEGATE_EXPECT(update.values().size() == mark.entries);
    }
  }

  void take(const v1::PdoUpdate& sample) {
    PdoUpdate update;
    from_wire(sample, kUtc, update);
    LINEGATE_EXPECT(update.values.size() == sample.values().size());
  }

  void take(const v1::PdoReception& sample) {
    PdoReception reception;
    from_wire(sample, kUtc, reception);
    LINEGATE_EXPECT(reception.values.size() == sample.values().size());
  }

  void take(const v1::OutputState& sample) {
    line::OutputState state;
    from_wire(sample, kUtc, state);
    LINEGATE_EXPECT(state.waits.size() == sample.waiting().size());
    LINEGATE_EXPECT(state.group == sample.group() && state.owner == sample.owner().to_string());
  }

  void take(const v1::Event& sample) {
    ReceivedEvent event;
    from_wire(sample, kUtc, event);
    LINEGATE_EXPECT(event.fields.length <= event.fields.data.size());
    LINEGATE_EXPECT(event.data.has_value() == (sample.kind() < kEventKinds));
    if (event.data) {
      const Event known{
          .number = event.number, .time = event.time, .node = event.node, .data = *event.data};
      v1::Event back;
      to_wire(known, sample.text().to_string(), kUtc, back);
      LINEGATE_EXPECT(back.time() == sample.time() && back.kind() == sample.kind());
    }
    take(sample.properties());
  }

  void take(const v1::CommandReply& sample) {
    now_ += std::chrono::milliseconds(10);
    if (const auto done = tracker_.take(sample, participant_of(kPublisher), publishers_, now_))
      LINEGATE_EXPECT(asked_.erase(done->result.id) == 1);
    receive_page(std::as_bytes(std::span(sample.data())));
    for (unsigned sent = 0; const Request* due = tracker_.due(now_); ++sent) {
      LINEGATE_EXPECT(sent < fuzz::kRequests && asked_.contains(due->id));
    }
    LINEGATE_EXPECT(tracker_.next_wake() > now_);
  }

  // As an answer to COMMAND_JOURNAL_READ: what is read is written with the same meaning.
  static void receive_page(std::span<const std::byte> data) {
    if (const auto page = request::decode_page(data))
      LINEGATE_EXPECT(request::decode_page(request::encode(*page)) == page);
  }

  // --- of the gateway --------------------------------------------------------------------------

  void take(const v1::OutputWrite& sample) {
    line::OutputWrite write;
    const OutputCheck check = from_wire(sample, write);
    if (check.refusal != line::OutputRefusal::none) {
      LINEGATE_EXPECT(std::strlen(check.why) > 0);
      return;
    }
    for (const line::OutputValue& value : write.values) {
      LINEGATE_EXPECT(value.length >= 1 && value.length <= value.data.size());
    }
    for (const line::OutputBytes& run : write.bytes) {
      LINEGATE_EXPECT(run.offset + run.data.size() <= image::kMaxAreaBytes);
    }
    v1::OutputWrite back;
    LINEGATE_EXPECT(to_wire(write, back));
    LINEGATE_EXPECT(back.watchdog_ns() == sample.watchdog_ns());
  }

  void take(const v1::CommandRequest& sample) {
    const CommandDesk::Outcome outcome = desk_.take(sample, {});
    LINEGATE_EXPECT(!(outcome.command && outcome.answer));
    if (outcome.refused != line::Refusal::none) {
      LINEGATE_EXPECT(outcome.answer && !outcome.answer->text.empty());
    }
    if (outcome.answer)
      send(*outcome.answer, outcome.answer_from);
    if (!outcome.command)
      return;
    std::vector<std::byte> data = encode_data(outcome.command->command.request);
    LINEGATE_EXPECT(data.size() <= kLimits.request);
    line::Reply reply;
    reply.tag = outcome.command->command.tag;
    reply.data = std::move(data);
    // A command in six is answered at the end only, or never.
    if (reply.tag % 6 != 0) {
      const auto answer = desk_.answer(reply);
      LINEGATE_EXPECT(answer && answer->id == sample.id());
      LINEGATE_EXPECT(!desk_.answer(reply));
    }
  }

  static void send(const Answer& answer, std::size_t from) {
    LINEGATE_EXPECT(from <= answer.data.size());
    v1::CommandReply sample;
    set_chunk(answer.data, from, sample);
    LINEGATE_EXPECT(sample.last());
  }

  std::shared_ptr<UnreadableCount> unreadable_ = std::make_shared<UnreadableCount>();
  std::uint64_t failed_ = 0;
  Instant now_ = Instant{} + std::chrono::seconds(1);
  LayoutAssembly assembly_;
  image::Layout layout_;
  static constexpr WriterGuid kPublisher{1};
  LinePublishers publishers_;
  RequestTracker tracker_{std::chrono::milliseconds(250)};
  std::set<std::uint64_t> asked_;
  CommandDesk desk_{fuzz::kIncarnation, {fuzz::kLine}, kLimits};
};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  Peer peer;
  std::span<const std::uint8_t> input(data, size);
  while (input.size() >= 3) {
    const auto topic = static_cast<Topic>(input[0] % fuzz::kTopics);
    const std::size_t wish = input[1] | std::size_t{input[2]} << 8U;
    input = input.subspan(3);
    const std::size_t length = std::min(wish, input.size());
    peer.receive(topic, input.first(length));
    input = input.subspan(length);
  }
  peer.finish();
  return 0;
}

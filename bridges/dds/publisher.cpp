// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/publisher.h"

#include <algorithm>
#include <chrono>
#include <deque>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <set>
#include <string>
#include <tuple>
#include <utility>

#include <fastdds/dds/core/condition/GuardCondition.hpp>
#include <fastdds/dds/core/condition/WaitSet.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <linegatePubSubTypes.h>

#include "bridges/dds/command_desk.h"
#include "bridges/dds/command_samples.h"
#include "bridges/dds/endpoints.h"
#include "bridges/dds/event_samples.h"
#include "bridges/dds/gateway_holders.h"
#include "bridges/dds/image_samples.h"
#include "bridges/dds/inbound_reader.h"
#include "bridges/dds/layout_assembly.h"
#include "bridges/dds/named_read_type.h"
#include "bridges/dds/named_readers.h"
#include "bridges/dds/named_writers.h"
#include "bridges/dds/output_readers.h"
#include "bridges/dds/output_samples.h"
#include "bridges/dds/output_state_samples.h"
#include "bridges/dds/pdo_writer.h"
#include "bridges/dds/reader_watch.h"
#include "bridges/dds/renewed_writer.h"
#include "bridges/dds/reply_writers.h"
#include "bridges/dds/sample_port.h"
#include "bridges/dds/state_samples.h"
#include "bridges/dds/state_writer.h"
#include "bridges/dds/waiting.h"
#include "bridges/named/sample_plan.h"
#include "bridges/named/set_plan.h"
#include "stack/base/short_text.h"

namespace linegate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;

constexpr std::size_t kLongestReplyText = 256;  // of CommandReply::text, in bytes
constexpr std::size_t kSamplesPerPoll = 256;    // of each topic, so that none starves the other

constexpr Duration kLivelinessPeriod = std::chrono::milliseconds(500);  // a quarter of the lease
constexpr std::size_t kMostRefusedRequests = 256;  // whose repetitions are recognised
constexpr const char* kOtherStart = "addressed to another start of the gateway";
constexpr const char* kRevokedName =
    "the name of this identity is revoked: if it was issued again, restart the gateway";
constexpr const char* kForeignPartition = "its writer has no right to send requests to this line";

// A request of a participant that may not send any: prefix, client and id.
using RefusedRequest = std::tuple<decltype(Participant::prefix), std::string, std::uint64_t>;

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

  // Creates the missing writers. Returns false if one could not be created. partition: see
  // Endpoints::writer_beside().
  bool make(Endpoints& endpoints, std::uint64_t renew_after, const std::string& partition) {
    constexpr auto kKeep = RenewedWriter::Keep::until_received;
    for (Slot* image : {&inputs, &outputs}) {
      if (writer(*image) == nullptr) {
        image->emplace(endpoints, renew_after, kKeep, [&endpoints, partition] {
          return endpoints.writer_beside<v1::ProcessImagePubSubType>(partition,
                                                                     v1::TOPIC_PROCESS_IMAGE);
        });
      }
    }
    if (writer(receptions) == nullptr) {
      receptions.emplace(endpoints, renew_after, kKeep, [&endpoints, partition] {
        return endpoints.writer_beside<v1::PdoReceptionPubSubType>(partition,
                                                                   v1::TOPIC_PDO_RECEPTION);
      });
    }
    make_events(events, endpoints, renew_after, partition);
    return writer(inputs) != nullptr && writer(outputs) != nullptr &&
           writer(receptions) != nullptr && writer(events) != nullptr;
  }
  static void make_events(Slot& events, Endpoints& endpoints, std::uint64_t renew_after,
                          const std::string& partition = {}) {
    if (writer(events) == nullptr) {
      events.emplace(endpoints, renew_after, RenewedWriter::Keep::history, [&endpoints, partition] {
        return endpoints.writer_beside<v1::EventPubSubType>(partition, v1::TOPIC_EVENT);
      });
    }
  }
  static fast::DataWriter* writer(const Slot& slot) { return slot ? slot->writer() : nullptr; }

  Slot inputs;
  Slot outputs;
  Slot receptions;
  Slot events;
};

// Writers of the states and PDOs of all lines, or of one line if lines have partitions.
struct StateWriters {
  StateWriters(Endpoints& endpoints, std::uint64_t renew_after, const std::string& partition)
      : lines(endpoints, v1::TOPIC_LINE_STATE, renew_after, partition),
        nodes(endpoints, v1::TOPIC_NODE_STATE, renew_after, partition),
        outputs(endpoints, v1::TOPIC_OUTPUT_STATE, renew_after, partition),
        layouts(endpoints, v1::TOPIC_IMAGE_LAYOUT, renew_after, partition),
        pdos(endpoints, renew_after, partition) {}

  StateWriter<v1::LineStatePubSubType> lines;
  StateWriter<v1::NodeStatePubSubType> nodes;
  StateWriter<v1::OutputStatePubSubType> outputs;
  StateWriter<v1::ImageLayoutPubSubType> layouts;
  PdoWriter pdos;
};

// Returns false if there is no writer, or DDS refused the sample.
template <class Sample>
bool write_to(std::optional<RenewedWriter>& slot, Sample& sample) {
  return LineWriters::writer(slot) != nullptr && slot->next()->write(&sample);
}

class LocalPort final : public SamplePort {
 public:
  LocalPort(const GatewayOptions& options, std::vector<Diagnostic>& diagnostics);
  ~LocalPort() override;
  LocalPort(const LocalPort&) = delete;
  LocalPort& operator=(const LocalPort&) = delete;

  bool ok() const { return endpoints_.ok(); }

  bool add_line(const std::string& line) override;
  void remove_line(const std::string& line) override;
  void forget_pdos(std::string_view line) override {
    if (StateWriters* const of_line = states_of(line))
      of_line->pdos.forget(line);
  }

  bool write(v1::GatewayState& sample) override { return states_.write(sample); }
  bool write(v1::LineState& sample) override { return write(&StateWriters::lines, sample); }
  bool write(v1::NodeState& sample) override { return write(&StateWriters::nodes, sample); }
  bool write(v1::OutputState& sample) override { return write(&StateWriters::outputs, sample); }
  bool write(v1::ImageLayout& sample) override { return write(&StateWriters::layouts, sample); }
  bool write(v1::ProcessImage& sample) override {
    LineWriters& writers = writers_of(sample.line().c_str());
    const bool is_input = sample.direction() == v1::DIRECTION_INPUTS;
    return write_to(is_input ? writers.inputs : writers.outputs, sample);
  }
  bool write(v1::PdoUpdate& sample) override { return write(&StateWriters::pdos, sample); }
  bool write(v1::PdoReception& sample) override {
    return write_to(writers_of(sample.line().c_str()).receptions, sample);
  }
  bool write(v1::Event& sample) override {
    const std::string_view line = sample.line().c_str();
    return write_to(line.empty() ? own_events_ : writers_of(line).events, sample);
  }
  bool write(v1::CommandReply& sample, const std::string& partition) override {
    return replies_.write(sample, partition, now());
  }
  bool add_named(const NamedTopic& topic) override {
    return named_.add(topic, partition_of(topic.line));
  }
  void remove_named(std::span<const std::string> topics) override { named_.remove(topics); }
  bool write_named(std::string_view topic, std::span<const std::byte> sample) override {
    return named_.write(topic, sample);
  }
  bool has_named_readers(std::string_view topic) override { return named_.has_readers(topic); }
  void watch_named_readers(std::function<void()> changed) override {
    readers_of_named_.call(std::move(changed));
  }
  bool add_named_reader(const NamedTopic& topic) override { return sets_.add(topic); }
  void remove_named_readers(std::span<const std::string> topics) override { sets_.remove(topics); }
  bool accepts_image(std::string_view /*line*/, image::Direction /*direction*/) const override {
    return true;
  }

  bool wait(Duration timeout) override;
  void wake() override { waiting_.wake(); }
  Taken take(v1::OutputWrite& sample, Participant& from) override {
    return receive_from(outputs_, sample, from);
  }
  Taken take(v1::CommandRequest& sample, Participant& from) override {
    return receive_from(*requests_, sample, from);
  }
  void all_outputs_taken() override { outputs_.renew_if_full(); }
  Taken take_named(NamedReceived& sample, Participant& from) override {
    fast::SampleInfo info;
    const std::string* const line = sets_.take(sample, info);
    if (line == nullptr)
      return Taken::none;
    return sent_by(info, *line, from);
  }
  void all_commands_taken() override { requests_->renew_if_full(); }
  bool follow(const std::vector<RemoteLine>& lines) override;
  Taken take_other(v1::LineState& sample) override { return receive(&OtherLines::states, sample); }
  Taken take_other(v1::ImageLayout& sample) override {
    return receive(&OtherLines::layouts, sample);
  }
  Taken take_other(v1::ProcessImage& sample) override {
    return receive(&OtherLines::images, sample);
  }
  void all_lines_taken() override {
    if (others_) {
      others_->states.renew_if_full();
      others_->layouts.renew_if_full();
      others_->images.renew_if_full();
    }
  }
  void all_named_taken() override { sets_.renew_if_full(); }
  std::uint64_t pop_unreadable() override {
    return endpoints_.pop_unreadable() + std::exchange(forged_, 0);
  }
  std::string_view output_misfit() override { return misfit_of(outputs_); }
  std::string_view command_misfit() override { return misfit_of(*requests_); }
  Misfit named_misfit() override { return sets_.misfit(policy_name); }

  std::size_t namesakes() const override { return endpoints_.namesakes(); }
  std::vector<std::string> other_gateways() const override { return endpoints_.peers().gateways; }
  DiscoveryCounters discovery() const override { return endpoints_.discovery(); }
  guard::Counters guard_counters() const override { return endpoints_.guard_counters(); }
  guard::Stall longest_stall() const override { return endpoints_.longest_stall(); }
  void watch_timers() override { endpoints_.watch_timers(); }
  std::int64_t next_expiry() const override { return next_expiry_ ? next_expiry_() : 0; }

 private:
  bool prepare();
  static Instant now() {
    return Instant(
        std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch()));
  }
  // Returns no_writers_ if there is no such line.
  LineWriters& writers_of(std::string_view line) {
    const auto found = lines_.find(line);
    return found == lines_.end() ? no_writers_ : found->second;
  }
  // The partition of a line; empty without partitions.
  std::string partition_of(const std::string& line) const {
    return partitions_ ? gateway_ + "/" + line : std::string();
  }
  // Without partitions those of all lines; with partitions nullptr if there is no such line.
  StateWriters* states_of(std::string_view line) {
    const auto found = line_states_.find(partitions_ ? line : std::string_view());
    return found == line_states_.end() ? nullptr : &found->second;
  }
  template <class Writer, class Sample>
  bool write(Writer StateWriters::*writer, Sample& sample) {
    StateWriters* const of_line = states_of(sample.line().c_str());
    return of_line != nullptr && (of_line->*writer).write(sample);
  }
  // The lines of other gateways.
  struct OtherLines {
    // partition: see InboundReader.
    OtherLines(Endpoints& endpoints, Waiting& waiting, const std::optional<std::string>& partition)
        : states(endpoints, waiting, v1::TOPIC_LINE_STATE, partition),
          layouts(endpoints, waiting, v1::TOPIC_IMAGE_LAYOUT, partition),
          images(endpoints, waiting, v1::TOPIC_PROCESS_IMAGE, partition) {}

    InboundReader<v1::LineStatePubSubType> states;
    InboundReader<v1::ImageLayoutPubSubType> layouts;
    InboundReader<v1::ProcessImagePubSubType> images;
  };
  template <class Reader, class Sample>
  Taken receive(Reader OtherLines::*reader, Sample& sample) {
    fast::SampleInfo info;
    if (!others_ || !((*others_).*reader).take(sample, info))
      return Taken::none;
    if (!info.valid_data)
      return Taken::invalid;
    const std::string gateway = sample.gateway().to_string();
    if (!followed_.contains({gateway, sample.line().to_string()}))
      return Taken::invalid;
    if (holders_.has(prefix_of(info), gateway))
      return Taken::sample;
    ++forged_;
    return Taken::invalid;
  }
  template <class Reader, class Sample>
  Taken receive_from(Reader& reader, Sample& sample, Participant& from) {
    fast::SampleInfo info;
    if (!reader.take(sample, info))
      return Taken::none;
    return sent_by(info, info.valid_data ? sample.line().to_string() : std::string(), from);
  }
  Taken sent_by(const fast::SampleInfo& info, std::string_view line, Participant& from) {
    if (!info.valid_data)
      return Taken::invalid;
    from = sender(info);
    add_claim(info, line, from);
    return Taken::sample;
  }
  static GatewayHolders::Prefix prefix_of(const fast::SampleInfo& info) {
    const auto writer = eprosima::fastrtps::rtps::iHandle2GUID(info.publication_handle);
    GatewayHolders::Prefix out{};
    std::copy_n(writer.guidPrefix.value, out.size(), out.begin());
    return out;
  }
  const Participant& sender(const fast::SampleInfo& info);
  void add_claim(const fast::SampleInfo& info, std::string_view line, Participant& from) const;
  template <class Reader>
  static std::string_view misfit_of(Reader& reader) {
    const std::uint32_t policy = reader.misfit();
    return policy == 0 ? std::string_view() : policy_name(policy);
  }

  const std::string gateway_;
  const bool secured_;
  const bool partitions_;
  const std::function<std::int64_t()> next_expiry_;
  const Duration last_words_;
  const std::uint64_t renew_after_;
  ReaderWatch readers_of_named_;  // outlives the writers, whose listener it is
  Endpoints endpoints_;
  const bool prepared_;  // before the first writer
  StateWriter<v1::GatewayStatePubSubType> states_{endpoints_, v1::TOPIC_GATEWAY_STATE,
                                                  renew_after_};
  // With partitions by line; otherwise one with an empty name. The thread that writes samples adds
  // lines, the one that waits for requests asserts the liveliness of all.
  std::map<std::string, StateWriters, std::less<>> line_states_;
  std::mutex line_states_mutex_;  // for add_line() and wait()
  std::map<std::string, LineWriters, std::less<>> lines_;
  LineWriters no_writers_;
  LineWriters::Slot own_events_;
  NamedWriters named_{endpoints_, renew_after_, readers_of_named_};
  ReplyWriters replies_{endpoints_, renew_after_, secured_};
  Waiting waiting_;
  OutputReaders outputs_{endpoints_, waiting_, secured_ ? gateway_ : std::string()};
  std::unique_ptr<InboundReader<v1::CommandRequestPubSubType>> requests_;
  std::optional<OtherLines> others_;
  std::set<RemoteLine> followed_;
  GatewayHolders holders_;
  std::uint64_t forged_ = 0;  // samples of followed lines, since the last pop_unreadable()
  NamedReaders sets_{endpoints_, waiting_};
  Participant last_sender_;  // of the thread that calls take()
  std::chrono::steady_clock::time_point liveliness_due_{};
};

LocalPort::LocalPort(const GatewayOptions& options, std::vector<Diagnostic>& diagnostics)
    : gateway_(options.gateway),
      secured_(options.security.enabled()),
      partitions_(options.partitions && !secured_),
      next_expiry_(options.security.next_expiry),
      last_words_(options.last_words),
      renew_after_(options.renew_after),
      endpoints_("linegate " + options.gateway, options.domain, options.profile_file, diagnostics,
                 options.guard, options.participants, options.security, nullptr, options.network),
      prepared_(prepare()),
      holders_(options.security.is_holder) {
  LineWriters::make_events(own_events_, endpoints_, renew_after_);
  if (!partitions_)
    line_states_.try_emplace("", endpoints_, renew_after_, "");
  for (const std::string& line : options.lines)
    add_line(line);
  requests_ = std::make_unique<InboundReader<v1::CommandRequestPubSubType>>(
      endpoints_, waiting_, v1::TOPIC_COMMAND_REQUEST);
  endpoints_.seal();
}

// What must be done before the first writer. Returns true.
bool LocalPort::prepare() {
  if (partitions_)
    endpoints_.join(gateway_ + "/*");
  endpoints_.add_received_topic<v1::LineStatePubSubType>(v1::TOPIC_LINE_STATE);
  endpoints_.add_received_topic<v1::ImageLayoutPubSubType>(v1::TOPIC_IMAGE_LAYOUT);
  endpoints_.add_received_topic<v1::ProcessImagePubSubType>(v1::TOPIC_PROCESS_IMAGE);
  return true;
}

// New readers receive what is present. With DDS-Security all others are in the partition of
// requests to this gateway, and gateways publish in the default one.
bool LocalPort::follow(const std::vector<RemoteLine>& lines) {
  followed_ = {lines.begin(), lines.end()};
  others_.reset();
  if (!lines.empty())
    others_.emplace(endpoints_, waiting_, secured_ ? std::optional<std::string>("") : std::nullopt);
  return lines.empty() ||
         (others_->states.exists() && others_->layouts.exists() && others_->images.exists());
}

// The end of a writer is sent by discovery, not with its samples, and may overtake them.
LocalPort::~LocalPort() {
  using Clock = std::chrono::steady_clock;
  const auto deadline = Clock::now() + last_words_;
  const auto left = [&] { return std::max(Duration::zero(), Duration{deadline - Clock::now()}); };
  const auto wait_for_readers_of = [&](fast::DataWriter* writer) {
    if (writer != nullptr)
      writer->wait_for_acknowledgments(to_dds(left()));
  };
  for (const auto& [name, writers] : lines_)
    wait_for_readers_of(LineWriters::writer(writers.events));
  wait_for_readers_of(LineWriters::writer(own_events_));
  wait_for_readers_of(states_.writer());
  for (const auto& [name, writers] : line_states_) {
    wait_for_readers_of(writers.nodes.writer());
    wait_for_readers_of(writers.outputs.writer());
    wait_for_readers_of(writers.lines.writer());
  }
  for (const auto& [name, writers] : lines_) {
    wait_for_readers_of(LineWriters::writer(writers.inputs));
    wait_for_readers_of(LineWriters::writer(writers.outputs));
    wait_for_readers_of(LineWriters::writer(writers.receptions));
  }
  named_.wait_for_acknowledgments(left());
  replies_.wait_for_acknowledgments(left());
}

bool LocalPort::add_line(const std::string& line) {
  const std::string partition = partition_of(line);
  if (partitions_ && !line_states_.contains(line)) {
    decltype(line_states_) made;  // without the mutex: discovery takes time
    made.try_emplace(line, endpoints_, renew_after_, partition);
    const std::lock_guard lock(line_states_mutex_);
    line_states_.merge(made);
  }
  const bool has_writers = lines_[line].make(endpoints_, renew_after_, partition);
  return outputs_.add(line) && has_writers;
}

// With partitions the writers of its states remain, as that of its events.
void LocalPort::remove_line(const std::string& line) {
  outputs_.remove(line);
  const auto of_line = [&](const auto& sample) { return sample.line() == line.c_str(); };
  if (StateWriters* const states = states_of(line)) {
    states->nodes.end(of_line);
    states->outputs.end(of_line);
    states->lines.end(of_line);
    states->layouts.end(of_line);
    states->pdos.forget(line);
  }
  LineWriters& writers = lines_[line];
  for (LineWriters::Slot* image : {&writers.inputs, &writers.outputs, &writers.receptions}) {
    if (*image)
      (*image)->remove();
    image->reset();
  }
}

// A gateway whose requests are not received is not alive: hence here, not in a thread of Fast DDS.
bool LocalPort::wait(Duration timeout) {
  using Clock = std::chrono::steady_clock;
  endpoints_.limit_stalls();
  for (const auto end = Clock::now() + timeout;;) {
    const auto now = Clock::now();
    if (now >= liveliness_due_) {
      const std::lock_guard lock(line_states_mutex_);
      for (auto& [name, writers] : line_states_)
        writers.lines.assert_liveliness();
      replies_.remove_unread(LocalPort::now());
      liveliness_due_ = now + kLivelinessPeriod;
    }
    const auto until = std::min(end, liveliness_due_);
    if (waiting_.wait(until - now))
      return true;
    if (until == end)
      return false;
  }
}

// Requests of one participant often follow each other.
const Participant& LocalPort::sender(const fast::SampleInfo& info) {
  Participant from;
  from.prefix = prefix_of(info);
  if (from.prefix != last_sender_.prefix || last_sender_.host.empty()) {
    from.host = endpoints_.host_of(from.prefix);
    last_sender_ = std::move(from);
  }
  return last_sender_;
}

// The right to send requests to that line, and the subject, by the partition of the writer; in a
// domain without DDS-Security every writer has it.
void LocalPort::add_claim(const fast::SampleInfo& info, std::string_view line,
                          Participant& from) const {
  from.right = secured_ ? ClientRight::none : ClientRight::unlimited;
  from.subject.clear();
  if (!secured_)
    return;
  const auto writer = eprosima::fastrtps::rtps::iHandle2GUID(info.publication_handle);
  guard::Guid guid{};
  std::copy_n(writer.guidPrefix.value, 12, guid.begin());
  std::copy_n(writer.entityId.value, 4, guid.begin() + 12);
  const auto partitions = endpoints_.partitions_of(guid);
  if (auto claim = partitions ? claim_of(*partitions, gateway_, line) : std::nullopt) {
    from.right = claim->right;
    from.subject = std::move(claim->name);
  }
}

}  // namespace

bool is_policy_name(std::string_view text) {
  constexpr std::array kPolicies{fast::DURABILITY_QOS_POLICY_ID,  fast::DEADLINE_QOS_POLICY_ID,
                                 fast::OWNERSHIP_QOS_POLICY_ID,   fast::LIVELINESS_QOS_POLICY_ID,
                                 fast::RELIABILITY_QOS_POLICY_ID, fast::INVALID_QOS_POLICY_ID};
  return std::ranges::any_of(kPolicies, [&](auto id) { return policy_name(id) == text; });
}

Loaded<std::unique_ptr<SamplePort>> make_local_port(const GatewayOptions& options) {
  Loaded<std::unique_ptr<SamplePort>> result;
  auto port = std::make_unique<LocalPort>(options, result.diagnostics);
  if (port->ok())
    result.value = std::move(port);
  return result;
}

struct GatewayBridge::Impl {
  Impl(const GatewayOptions& options, std::unique_ptr<SamplePort> sample_port)
      : gateway(options.gateway),
        incarnation(options.incarnation),
        security(options.security),
        port(std::move(sample_port)),
        desk(options.incarnation, options.lines) {}

  // A named topic of a line.
  struct Named {
    std::string line;
    image::Direction direction = image::Direction::inputs;
    std::string type;
    bool described = false;
    named::SamplePlan plan;
  };

  // A named topic that applications write.
  struct NamedSet {
    std::string line;
    named::SetPlan plan;
  };

  template <class Sample>
  void address(std::string_view line, Sample& sample) const;
  // Removes the topics of the line for which `wanted` is true.
  template <class Wanted>
  void remove_named(std::string_view line, Wanted wanted);
  bool count(bool written);

  template <class Sample, class Handle>
  std::size_t read_lines(Sample& sample, Handle handle);
  std::size_t read_other_lines(GatewayHandler& handler);
  OutputCheck check_origin(std::uint64_t of_incarnation) const;
  bool read_output(GatewayHandler& handler);
  bool read_named_output(GatewayHandler& handler);
  void handle(named::SetSample& sample, const std::string& line, GatewayHandler& handler);
  void remove_sets(std::string_view line);
  bool receive_command(GatewayHandler& handler);
  void handle(const v1::CommandRequest& request, GatewayHandler& handler);
  const char* denial(const Participant& from) const;
  // Its samples must not reach outputs, even while its participant is still matched.
  bool is_revoked_gateway(const std::string& name) const {
    return security.is_revoked && security.is_revoked("gateway", name);
  }
  void refuse_sender(const v1::CommandRequest& request, const char* why, GatewayHandler& handler);
  std::string replies_to_sender() const;
  void report_discarded(GatewayHandler& handler);
  bool send(const Answer& answer, std::size_t from);

  const std::string gateway;
  const std::uint64_t incarnation;
  const Security security;
  const std::unique_ptr<SamplePort> port;

  // Used by the publishing thread. Samples are members so that their buffers are reused.
  ClockMap clock;
  PublishCounters counters;
  std::uint64_t event_stream = 0;  // of the last GatewayState; 0 before it
  std::map<std::string, std::uint64_t, std::less<>> receptions;  // published, by line
  std::map<std::string, Named, std::less<>> named_topics;        // by topic
  std::vector<std::int64_t> pdo_times;
  std::vector<std::byte> named_sample;
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
  v1::OutputWrite output_sample;
  v1::CommandRequest request_sample;
  std::deque<RefusedRequest> refused_requests;        // reported ones, oldest first
  std::map<std::string, NamedSet, std::less<>> sets;  // by topic
  NamedReceived named_received;
  named::SetSample set_sample;
  std::set<RemoteLine> followed;  // lines of other gateways
  LayoutAssembly remote_layouts;
  v1::LineState remote_state;
  v1::ImageLayout remote_layout;
  v1::ProcessImage remote_image;
  Participant sender;  // of the sample that was taken last

  std::mutex desk_mutex;  // poll() and reply() share the desk; not held while DDS writes
  CommandDesk desk;
};

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

DiscoveryCounters GatewayBridge::discovery() const {
  return impl_->port->discovery();
}

guard::Counters GatewayBridge::guard_counters() const {
  return impl_->port->guard_counters();
}

std::uint64_t GatewayBridge::process_starts() const {
  return impl_->port->process_starts();
}

std::int64_t GatewayBridge::next_expiry() const {
  return impl_->port->next_expiry();
}

bool GatewayBridge::replace_process(std::string_view reason) {
  return impl_->port->replace_process(reason);
}

std::size_t GatewayBridge::namesakes() const {
  return impl_->port->namesakes();
}

std::vector<std::string> GatewayBridge::other_gateways() const {
  return impl_->port->other_gateways();
}

// --- lines ---------------------------------------------------------------------------------------

bool GatewayBridge::add_line(const std::string& line) {
  impl_->desk.add_line(line);
  return impl_->port->add_line(line);
}

void GatewayBridge::remove_line(const std::string& line) {
  impl_->desk.remove_line(line);
  impl_->remove_named(line, [](const auto&) { return true; });
  impl_->remove_sets(line);
  impl_->port->remove_line(line);
}

// --- out -----------------------------------------------------------------------------------------

Loaded<std::unique_ptr<GatewayBridge>> GatewayBridge::make(const GatewayOptions& options) {
  Loaded<std::unique_ptr<GatewayBridge>> result;
  auto port = make_local_port(options);
  result.diagnostics = std::move(port.diagnostics);
  if (port.value)
    result.value = make(options, std::move(*port.value));
  return result;
}

std::unique_ptr<GatewayBridge> GatewayBridge::make(const GatewayOptions& options,
                                                   std::unique_ptr<SamplePort> port) {
  return std::unique_ptr<GatewayBridge>(
      new GatewayBridge(std::make_unique<Impl>(options, std::move(port))));
}

GatewayBridge::GatewayBridge(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {
}
GatewayBridge::~GatewayBridge() = default;

void GatewayBridge::set_clock(const ClockMap& clock) {
  impl_->clock = clock;
}

PublishCounters GatewayBridge::counters() const {
  PublishCounters out = impl_->counters;
  out.failed += impl_->port->failed_later();
  return out;
}

bool GatewayBridge::publish(const LineInfo& line, const line::LineState& state, Instant now,
                            const std::vector<Property>& properties) {
  v1::LineState& sample = impl_->line_sample;
  impl_->address(line.name, sample);
  sample.time(impl_->clock.utc(now));
  sample.clock(static_cast<std::uint8_t>(impl_->clock.quality));
  to_wire(line, state, sample);
  to_wire(properties, sample.properties());
  return impl_->count(impl_->port->write(sample));
}

bool GatewayBridge::publish(const GatewayInfo& info, Instant now) {
  v1::GatewayState& sample = impl_->gateway_sample;
  sample.gateway(impl_->gateway);
  sample.incarnation(impl_->incarnation);
  sample.time(impl_->clock.utc(now));
  sample.clock(static_cast<std::uint8_t>(impl_->clock.quality));
  to_wire(info, impl_->clock, sample);
  impl_->event_stream = info.event_stream;
  return impl_->count(impl_->port->write(sample));
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
  return impl_->count(impl_->port->write(sample));
}

bool GatewayBridge::publish(std::string_view line, const line::OutputState& state, Instant now) {
  v1::OutputState& sample = impl_->output_state_sample;
  impl_->address(line, sample);
  to_wire(state, impl_->clock, now, sample);
  return impl_->count(impl_->port->write(sample));
}

bool GatewayBridge::publish(std::string_view line, const image::Layout& layout) {
  if (layout.entries.size() > kMaxEntries) {
    ++impl_->counters.failed;
    return false;
  }
  if (layout.direction == image::Direction::inputs)
    impl_->port->forget_pdos(line);
  v1::ImageLayout& sample = impl_->layout_sample;
  impl_->address(line, sample);
  const std::uint16_t parts = layout_parts(layout);
  bool written = true;
  for (std::uint16_t part = 0; part < parts; ++part) {
    to_wire(layout, part, sample);
    written = impl_->count(impl_->port->write(sample)) && written;
  }
  return written;
}

template <class Wanted>
void GatewayBridge::Impl::remove_named(std::string_view line, Wanted wanted) {
  std::vector<std::string> topics;
  for (const auto& [topic, known] : named_topics) {
    if (known.line == line && wanted(known))
      topics.push_back(topic);
  }
  if (!topics.empty())
    port->remove_named(topics);
  for (const std::string& topic : topics)
    named_topics.erase(topic);
}

// A type that remains keeps its writer; the places of its values in the image are new.
bool GatewayBridge::set_named_types(std::string_view line, image::Direction direction,
                                    std::span<const named::DeviceType> types) {
  impl_->remove_named(line, [&](const Impl::Named& known) {
    return known.direction == direction &&
           std::ranges::none_of(types, [&](const named::DeviceType& type) {
             return type.type_name() == known.type && type.described == known.described;
           });
  });
  bool made = true;
  for (const named::DeviceType& type : types) {
    named::SamplePlan plan(type, impl_->gateway);
    const std::string topic = type.topic();
    if (!impl_->named_topics.contains(topic)) {
      made = impl_->port->add_named({std::string(line), topic, type.type_name(), plan.max_size(),
                                     plan.key(),
                                     type.described ? named::described_members(type)
                                                    : std::vector<named::DescribedMember>()}) &&
             made;
    }
    impl_->named_topics.insert_or_assign(
        topic, Impl::Named{std::string(line), direction, type.type_name(), type.described,
                           std::move(plan)});
  }
  return made;
}

void GatewayBridge::Impl::remove_sets(std::string_view line) {
  std::vector<std::string> topics;
  for (const auto& [topic, known] : sets) {
    if (known.line == line)
      topics.push_back(topic);
  }
  if (!topics.empty())
    port->remove_named_readers(topics);
  for (const std::string& topic : topics)
    sets.erase(topic);
}

bool GatewayBridge::set_named_groups(const std::string& line,
                                     std::span<const named::GroupType> types) {
  impl_->remove_sets(line);
  bool made = true;
  for (const named::GroupType& type : types) {
    named::SetPlan plan(type);
    const bool added =
        impl_->port->add_named_reader({line, type.topic(), type.type_name(), plan.max_size(), {}});
    if (added)
      impl_->sets.emplace(type.topic(), Impl::NamedSet{line, std::move(plan)});
    made = added && made;
  }
  return made;
}

bool GatewayBridge::has_readers(const named::DeviceType& type) {
  return impl_->port->has_named_readers(type.topic());
}

void GatewayBridge::watch_readers(std::function<void()> changed) {
  impl_->port->watch_named_readers(std::move(changed));
}

bool GatewayBridge::accepts_named(const named::DeviceType& type) const {
  return impl_->port->accepts_named(type.topic());
}

bool GatewayBridge::publish(const named::DeviceType& type, const image::Snapshot& snapshot,
                            std::uint64_t number, std::span<const Instant> times,
                            std::span<const std::uint8_t> waits) {
  const auto known = impl_->named_topics.find(type.topic());
  if (known == impl_->named_topics.end())
    return impl_->count(false);
  impl_->pdo_times.clear();
  for (const Instant time : times)
    impl_->pdo_times.push_back(impl_->clock.utc(time));
  const named::SampleHead head{.incarnation = impl_->incarnation,
                               .sequence_number = number,
                               .time = impl_->clock.utc(snapshot.acquired),
                               .clock = static_cast<std::uint8_t>(impl_->clock.quality),
                               .pdo_times = impl_->pdo_times,
                               .waits = waits};
  const named::SamplePlan& plan = known->second.plan;
  if (impl_->named_sample.size() < plan.max_size())
    impl_->named_sample.resize(plan.max_size());
  const std::size_t size = plan.write(head, snapshot, impl_->named_sample);
  return impl_->count(impl_->port->write_named(
      known->first, std::span<const std::byte>(impl_->named_sample).first(size)));
}

bool GatewayBridge::publish(std::string_view line, const image::Snapshot& snapshot) {
  v1::ProcessImage& sample = impl_->image_sample;
  impl_->address(line, sample);
  if (!to_wire(snapshot, impl_->clock, sample)) {
    ++impl_->counters.failed;
    return false;
  }
  return impl_->count(impl_->port->write(sample));
}

bool GatewayBridge::share_images(const std::string& line, std::shared_ptr<SharedFiles> files) {
  return impl_->port->share_images(line, std::move(files));
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
  return impl_->count(impl_->port->write(sample));
}

bool GatewayBridge::publish(std::string_view line, const image::Layout& layout,
                            const pdo::Reception& reception) {
  v1::PdoReception& sample = impl_->reception_sample;
  impl_->address(line, sample);
  sample.number(++impl_->receptions[std::string(line)]);
  return impl_->count(to_wire(layout, reception, impl_->clock, sample) &&
                      impl_->port->write(sample));
}

bool GatewayBridge::publish(std::string_view line, const Event& event, std::string_view text,
                            const std::vector<Property>& properties) {
  v1::Event& sample = impl_->event_sample;
  impl_->address(line, sample);
  to_wire(event, text, impl_->clock, sample);
  to_wire(properties, sample.properties());
  add_stream(impl_->event_stream, sample);
  return impl_->count(impl_->port->write(sample));
}

bool GatewayBridge::accepts_image(std::string_view line, image::Direction direction) const {
  return impl_->port->accepts_image(line, direction);
}

// --- in ------------------------------------------------------------------------------------------

std::size_t GatewayBridge::poll(Duration timeout, GatewayHandler& handler) {
  std::size_t outputs = 0;
  std::size_t named = 0;
  std::size_t commands = 0;
  std::size_t lines = 0;
  if (impl_->port->wait(timeout)) {
    while (outputs < kSamplesPerPoll && impl_->read_output(handler))
      ++outputs;
    while (named < kSamplesPerPoll && impl_->read_named_output(handler))
      ++named;
    while (commands < kSamplesPerPoll && impl_->receive_command(handler))
      ++commands;
    lines = impl_->read_other_lines(handler);
  }
  impl_->report_discarded(handler);
  if (outputs < kSamplesPerPoll)
    impl_->port->all_outputs_taken();
  if (named < kSamplesPerPoll)
    impl_->port->all_named_taken();
  if (commands < kSamplesPerPoll)
    impl_->port->all_commands_taken();
  if (lines < kSamplesPerPoll)
    impl_->port->all_lines_taken();
  if (std::max({outputs, named, commands, lines}) >= kSamplesPerPoll)
    impl_->port->wake();
  return outputs + named + commands + lines;
}

bool GatewayBridge::follow(std::vector<RemoteLine> lines) {
  std::set<RemoteLine> wanted(lines.begin(), lines.end());
  std::erase_if(wanted, [&](const RemoteLine& line) { return line.gateway == impl_->gateway; });
  if (wanted == impl_->followed)
    return true;
  impl_->followed = std::move(wanted);
  impl_->remote_layouts = {};  // each is passed on again
  const bool follows = impl_->port->follow({impl_->followed.begin(), impl_->followed.end()});
  if (!follows)
    impl_->followed.clear();  // the next reload tries again
  return follows;
}

// A process of the endpoints may send samples of any line at any time: those that are not wanted
// are taken, too, because others wait behind them. Returns the number of samples.
template <class Sample, class Handle>
std::size_t GatewayBridge::Impl::read_lines(Sample& sample, Handle handle) {
  for (std::size_t taken = 0; taken < kSamplesPerPoll; ++taken) {
    const SamplePort::Taken what = port->take_other(sample);
    if (what == SamplePort::Taken::none)
      return taken;
    if (what == SamplePort::Taken::invalid)
      continue;
    const RemoteSource source{{sample.gateway().to_string(), sample.line().to_string()},
                              sample.incarnation()};
    if (followed.contains(source.line) && !is_revoked_gateway(source.line.gateway))
      handle(source);
  }
  return kSamplesPerPoll;
}

// Layouts first, so that one is known when its first image arrives. Returns the number of samples
// of the topic that has most.
std::size_t GatewayBridge::Impl::read_other_lines(GatewayHandler& handler) {
  const std::size_t layouts = read_lines(remote_layout, [&](const RemoteSource& source) {
    image::Layout layout;
    if (remote_layout.direction() == v1::DIRECTION_INPUTS &&
        remote_layouts.take(remote_layout, layout))
      handler.on_remote_layout(source, layout);
  });
  const std::size_t images = read_lines(remote_image, [&](const RemoteSource& source) {
    image::Snapshot image;
    if (remote_image.direction() == v1::DIRECTION_INPUTS &&
        from_wire(remote_image, ClockMap{}, image))
      handler.on_remote_image(source, image);
  });
  const std::size_t states = read_lines(remote_state, [&](const RemoteSource& source) {
    handler.on_remote_state(source, remote_state.time());
  });
  return std::max({layouts, images, states});
}

void GatewayBridge::Impl::report_discarded(GatewayHandler& handler) {
  if (const std::uint64_t unreadable = port->pop_unreadable(); unreadable != 0)
    handler.on_unreadable(unreadable);
  if (const std::string_view policy = port->output_misfit(); !policy.empty())
    handler.on_misfit(v1::TOPIC_OUTPUT_WRITE, policy);
  if (const std::string_view policy = port->command_misfit(); !policy.empty())
    handler.on_misfit(v1::TOPIC_COMMAND_REQUEST, policy);
  if (const SamplePort::Misfit misfit = port->named_misfit(); !misfit.policy.empty())
    handler.on_misfit(misfit.topic, misfit.policy);
}

void GatewayBridge::wake() {
  impl_->port->wake();
}

// Of a write to outputs from `sender`.
OutputCheck GatewayBridge::Impl::check_origin(std::uint64_t of_incarnation) const {
  if (of_incarnation != 0 && of_incarnation != incarnation)
    return {line::OutputRefusal::stale_layout, kOtherStart};
  if (const char* why = denial(sender))
    return {line::OutputRefusal::no_right, why};
  return {};
}

bool GatewayBridge::Impl::read_output(GatewayHandler& handler) {
  const SamplePort::Taken taken = port->take(output_sample, sender);
  if (taken == SamplePort::Taken::none)
    return false;
  if (taken == SamplePort::Taken::invalid || output_sample.gateway() != gateway.c_str())
    return true;
  OutputMessage message;
  message.line = output_sample.line().to_string();
  message.client = output_sample.client().to_string();
  message.from = sender;
  OutputCheck check = check_origin(output_sample.incarnation());
  if (check.refusal == line::OutputRefusal::none)
    check = from_wire(output_sample, message.write);
  if (check.refusal != line::OutputRefusal::none) {
    handler.on_output_refused({message.line, message.client, sender}, output_sample.group(),
                              check.refusal, check.why);
  } else {
    handler.on_output_write(std::move(message));
  }
  return true;
}

bool GatewayBridge::Impl::read_named_output(GatewayHandler& handler) {
  const SamplePort::Taken taken = port->take_named(named_received, sender);
  if (taken == SamplePort::Taken::none)
    return false;
  const auto set = sets.find(named_received.topic);
  if (taken == SamplePort::Taken::invalid || set == sets.end())
    return true;
  if (!set->second.plan.read(named_received.octets, set_sample))
    handler.on_unreadable(1);
  else if (set_sample.gateway == gateway)
    handle(set_sample, set->second.line, handler);
  return true;
}

// As an OutputWrite of the same group.
void GatewayBridge::Impl::handle(named::SetSample& sample, const std::string& line,
                                 GatewayHandler& handler) {
  using line::OutputRefusal;
  const RequestOrigin origin{sample.line, sample.write.client, sender};
  OutputCheck check = check_origin(sample.incarnation);
  if (check.refusal == OutputRefusal::none &&
      (sample.line != line || sample.group != sample.write.group))
    check = {OutputRefusal::unknown_group, "the topic is that of another line or group"};
  if (check.refusal == OutputRefusal::none)
    check = check_watchdog(sample.write.reactions, sample.write.watchdog);
  if (check.refusal == OutputRefusal::none)
    check = {sample.refusal, sample.why.c_str()};
  if (check.refusal != OutputRefusal::none)
    handler.on_output_refused(origin, sample.group, check.refusal, check.why);
  else
    handler.on_output_write({sample.line, sample.write.client, sample.write, sender, true});
}

bool GatewayBridge::Impl::receive_command(GatewayHandler& handler) {
  const SamplePort::Taken taken = port->take(request_sample, sender);
  if (taken == SamplePort::Taken::none)
    return false;
  if (taken == SamplePort::Taken::sample && request_sample.gateway() == gateway.c_str())
    handle(request_sample, handler);
  return true;
}

// Why the sender may not send requests to the line, or nullptr: the port determined its right. In a
// domain without DDS-Security every participant may.
const char* GatewayBridge::Impl::denial(const Participant& from) const {
  if (!security.enabled())
    return nullptr;
  if (from.right == ClientRight::none || from.right == ClientRight::unlimited ||
      (security.is_holder && !security.is_holder(from.prefix, name(from.right), from.subject)))
    return kForeignPartition;
  const bool revoked = security.is_revoked && security.is_revoked(name(from.right), from.subject);
  return revoked ? kRevokedName : nullptr;
}

// Only the holder of the name gets an answer: the partition of the answers is that of the name, and
// another participant could refuse requests of the holder. A client repeats a request without an
// answer: that is no new event.
void GatewayBridge::Impl::refuse_sender(const v1::CommandRequest& request, const char* why,
                                        GatewayHandler& handler) {
  if (why == kRevokedName) {
    Answer answer;
    answer.line = request.line().to_string();
    answer.client = request.client().to_string();
    answer.id = request.id();
    answer.error = line::to_error(line::Refusal::no_right);
    answer.text = why;
    answer.partition = replies_to_sender();
    send(answer, 0);
  }
  RefusedRequest refused{sender.prefix, request.client().to_string(), request.id()};
  if (std::find(refused_requests.begin(), refused_requests.end(), refused) !=
      refused_requests.end())
    return;
  refused_requests.push_back(std::move(refused));
  if (refused_requests.size() > kMostRefusedRequests)
    refused_requests.pop_front();
  handler.on_command_refused({request.line().to_string(), request.client().to_string(), sender},
                             request.kind(), line::Refusal::no_right, why);
}

// The partition of the replies to the sender of the present sample.
std::string GatewayBridge::Impl::replies_to_sender() const {
  if (!security.enabled())
    return {};
  return reply_partition(gateway, std::string(name(sender.right)) + "/" + sender.subject);
}

void GatewayBridge::Impl::handle(const v1::CommandRequest& request, GatewayHandler& handler) {
  if (const char* why = denial(sender)) {
    refuse_sender(request, why, handler);
    return;
  }
  CommandDesk::Outcome outcome;
  {
    const std::lock_guard lock(desk_mutex);
    outcome = desk.take(request, sender.prefix, replies_to_sender());
  }
  if (outcome.answer)
    send(*outcome.answer, outcome.answer_from);
  if (outcome.refused != line::Refusal::none) {
    handler.on_command_refused({outcome.answer->line, outcome.answer->client, sender},
                               request.kind(), outcome.refused, outcome.answer->text);
  }
  if (outcome.command) {
    outcome.command->from = sender;
    handler.on_command(std::move(*outcome.command));
  }
  if (outcome.gateway_command) {
    outcome.gateway_command->from = sender;
    handler.on_gateway_command(std::move(*outcome.gateway_command));
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
  sample.text(short_text(answer.text, kLongestReplyText));
  sample.total(static_cast<std::uint32_t>(answer.data.size()));
  for (std::size_t chunk = 0; chunk < kChunksPerReply; ++chunk) {
    set_chunk(answer.data, from, sample);
    if (!port->write(sample, answer.partition))
      return false;
    if (sample.last())
      break;
    from += sample.data().size();
  }
  return true;
}

}  // namespace linegate::dds

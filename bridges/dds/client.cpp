// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/client.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <string>
#include <utility>

#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <linegatePubSubTypes.h>
#include <unistd.h>

#include "bridges/dds/address_watch.h"
#include "bridges/dds/command_samples.h"
#include "bridges/dds/endpoints.h"
#include "bridges/dds/event_filter.h"
#include "bridges/dds/event_follower.h"
#include "bridges/dds/event_samples.h"
#include "bridges/dds/gateway_holders.h"
#include "bridges/dds/image_samples.h"
#include "bridges/dds/layout_assembly.h"
#include "bridges/dds/line_publishers.h"
#include "bridges/dds/observed_qos.h"
#include "bridges/dds/output_samples.h"
#include "bridges/dds/output_state_samples.h"
#include "bridges/dds/participant_change.h"
#include "bridges/dds/request_codec.h"
#include "bridges/dds/request_tracker.h"
#include "bridges/dds/state_instances.h"
#include "bridges/dds/state_samples.h"
#include "bridges/dds/waiting.h"
#include "bridges/dds/writer_watch.h"

namespace linegate::dds {
namespace {

namespace fast = eprosima::fastdds::dds;

constexpr int kSamplesPerTopic = 256;  // of each topic, in one poll()
constexpr Duration kPageTimeout = std::chrono::seconds(5);
constexpr std::size_t kMostFormer = 3;  // participants with requests under way
constexpr std::size_t kMostWriters = 16'384;
// A gateway publishes its states once a second. Longer than a participant is discovered, and than
// its lease.
constexpr Duration kConfirmation = std::chrono::seconds(10);
constexpr ClockMap kUtc{};  // times passed to the listener are UTC
constexpr const char* kNotPermitted =
    "the permissions of this client do not name that line (linegate security issue --line)";

Instant steady_now() {
  return Instant{
      std::chrono::duration_cast<Duration>(std::chrono::steady_clock::now().time_since_epoch())};
}

std::string default_name() {
  static unsigned number = 0;
  std::array<char, 65> host{};
  ::gethostname(host.data(), host.size() - 1);
  std::string name(host.data());
  name.resize(std::min<std::size_t>(name.size(), 40));
  return name + "/" + std::to_string(::getpid()) + "/" + std::to_string(++number);
}

WriterGuid guid_of(const fast::InstanceHandle_t& writer) {
  const eprosima::fastrtps::rtps::GUID_t guid = eprosima::fastrtps::rtps::iHandle2GUID(writer);
  WriterGuid out{};
  std::copy_n(guid.guidPrefix.value, 12, out.begin());
  std::copy_n(guid.entityId.value, 4, out.begin() + 12);
  return out;
}

std::size_t peers_of(const std::map<std::string, fast::DataWriter*>& writers) {
  std::size_t peers = 0;
  for (const auto& [partition, writer] : writers) {
    fast::PublicationMatchedStatus status;
    if (writer == nullptr)
      continue;
    writer->get_publication_matched_status(status);
    peers += static_cast<std::size_t>(std::max(status.current_count, 0));
  }
  return peers;
}

template <class Sample>
Source source(const Sample& sample) {
  Source source{sample.gateway().to_string(), {}, sample.incarnation(), {}, ClockQuality::unknown};
  if constexpr (requires { sample.line(); })
    source.line = sample.line().to_string();
  if constexpr (requires { sample.clock(); }) {
    source.time = kUtc.instant(sample.time());
    source.clock = static_cast<ClockQuality>(sample.clock());
  }
  return source;
}

}  // namespace

namespace {

// A participant of the client with its endpoints.
struct Edge {
  // number: of the participant, from 1.
  Edge(const ClientOptions& options, const std::string& name, std::uint64_t the_number,
       Waiting& waiting, std::vector<Diagnostic>& diagnostics);
  Edge(const Edge&) = delete;
  Edge& operator=(const Edge&) = delete;
  ~Edge() { line_writers.close(); }

  template <class PubSubType>
  void subscribe(bool wanted, const std::string& topic, fast::DataReader*& reader);
  void subscribe_to_replies(const ClientOptions& options);
  std::array<fast::DataReader**, 10> readers() {
    return {&gateways, &lines, &nodes,      &output_states, &layouts,
            &images,   &pdos,  &receptions, &events,        &replies};
  }

  bool uses_tcp() const;

  const std::uint64_t number;
  WriterWatch line_writers;  // outlives the reader it listens to
  Endpoints endpoints;
  fast::DataReader* gateways = nullptr;
  fast::DataReader* lines = nullptr;
  fast::DataReader* nodes = nullptr;
  fast::DataReader* output_states = nullptr;
  fast::DataReader* layouts = nullptr;
  fast::DataReader* images = nullptr;
  fast::DataReader* pdos = nullptr;
  fast::DataReader* receptions = nullptr;
  fast::DataReader* events = nullptr;
  fast::DataReader* replies = nullptr;
  // By partition; without DDS-Security in the default partition alone. nullptr: not permitted
  using Writers = std::map<std::string, fast::DataWriter*>;
  Writers requests;
  Writers outputs;
};

Edge::Edge(const ClientOptions& options, const std::string& name, std::uint64_t the_number,
           Waiting& waiting, std::vector<Diagnostic>& diagnostics)
    : number(the_number),
      line_writers(waiting),
      endpoints("linegate client " + name, options.domain, options.profile_file, diagnostics,
                options.guard, 0, options.security, options.record, options.network) {
  if (!options.only.empty())
    endpoints.read_in(options.only);
  // Replies are accepted only from the participants that publish these states.
  subscribe<v1::GatewayStatePubSubType>(options.gateways || options.commands,
                                        v1::TOPIC_GATEWAY_STATE, gateways);
  subscribe<v1::LineStatePubSubType>(options.lines || options.commands, v1::TOPIC_LINE_STATE,
                                     lines);
  for (fast::DataReader* reader : {gateways, lines}) {
    if (reader != nullptr)
      reader->set_listener(&line_writers, WriterWatch::statuses());
  }
  subscribe<v1::NodeStatePubSubType>(options.nodes, v1::TOPIC_NODE_STATE, nodes);
  subscribe<v1::OutputStatePubSubType>(options.output_states, v1::TOPIC_OUTPUT_STATE,
                                       output_states);
  subscribe<v1::ImageLayoutPubSubType>(options.layouts, v1::TOPIC_IMAGE_LAYOUT, layouts);
  subscribe<v1::ProcessImagePubSubType>(options.images, v1::TOPIC_PROCESS_IMAGE, images);
  subscribe<v1::PdoUpdatePubSubType>(options.pdos, v1::TOPIC_PDO_UPDATE, pdos);
  subscribe<v1::PdoReceptionPubSubType>(options.receptions, v1::TOPIC_PDO_RECEPTION, receptions);
  subscribe<v1::EventPubSubType>(options.events, v1::TOPIC_EVENT, events);
  subscribe_to_replies(options);
  if (options.commands)
    endpoints.add_topic<v1::CommandRequestPubSubType>(v1::TOPIC_COMMAND_REQUEST);
  if (options.outputs)
    endpoints.add_topic<v1::OutputWritePubSubType>(v1::TOPIC_OUTPUT_WRITE);
}

template <class PubSubType>
void Edge::subscribe(bool wanted, const std::string& topic, fast::DataReader*& reader) {
  if (wanted)
    reader = endpoints.reader<PubSubType>(topic);
}

// With DDS-Security the replies to each identity have a partition of their own.
void Edge::subscribe_to_replies(const ClientOptions& options) {
  using Type = v1::CommandReplyPubSubType;
  if (!options.security.enabled())
    return subscribe<Type>(options.commands, v1::TOPIC_COMMAND_REPLY, replies);
  if (options.commands)
    replies =
        endpoints.reader_in<Type>(replies_to(options.security.right), v1::TOPIC_COMMAND_REPLY);
}

bool Edge::uses_tcp() const {
  eprosima::fastdds::rtps::LocatorList locators;
  if (lines != nullptr)
    lines->get_listening_locators(locators);
  return std::any_of(locators.begin(), locators.end(), [](const auto& one) {
    return one.kind == LOCATOR_KIND_TCPv4 || one.kind == LOCATOR_KIND_TCPv6;
  });
}

// Of a reader: the number of writers that it has matched.
int matched(fast::DataReader* reader) {
  fast::SubscriptionMatchedStatus status;
  if (reader != nullptr)
    reader->get_subscription_matched_status(status);
  return status.current_count;
}

// Whether `next` has matched as many gateways as `present`.
bool has_matched_all(Edge& next, Edge& present) {
  const auto now = present.readers();
  const auto then = next.readers();
  for (std::size_t i = 0; i < now.size(); ++i) {
    if (matched(*then[i]) < matched(*now[i]))
      return false;
  }
  return peers_of(next.requests) >= peers_of(present.requests) &&
         peers_of(next.outputs) >= peers_of(present.outputs);
}

}  // namespace

struct Client::Impl {
  Impl(const ClientOptions& the_options, std::vector<Diagnostic>& diagnostics);
  ~Impl();

  bool is_of_gateway(const std::string& gateway);
  bool is_repetition();
  enum class Repeated { passed, dropped };  // samples that a former participant received, too
  template <class Sample, class Handle>
  void drain(fast::DataReader* reader, Sample& sample, Handle handle,
             Repeated repeated = Repeated::dropped);
  template <class Sample, class Handle, class Ended>
  void drain(fast::DataReader* reader, Sample& sample, Handle handle, Ended ended,
             Repeated repeated);
  void line_ended(ClientListener& listener);
  void drain_layouts(ClientListener& listener);
  void drain_states(ClientListener& listener);
  void drain_nodes(ClientListener& listener);
  void drain_output_states(ClientListener& listener);
  using Instances = StateInstances<fast::InstanceHandle_t>;
  void note_instance(Instances& instances, const Source& of, std::uint16_t number);
  std::optional<Instances::Place> end_instance(Instances& instances);
  void report_lines_gone(ClientListener& listener);
  void drain_values(ClientListener& listener);
  void drain_events(ClientListener& listener);
  void drain_replies(ClientListener& listener);
  void finish(RequestTracker::Done done, ClientListener& listener);
  void keep_asking(ClientListener& listener);
  void follow_events(ClientListener& listener);
  bool send(const Request& request, fast::DataWriter& writer);
  // Assigns id, data and deadline, and sends it. Returns the id, or 0 for a client without
  // commands.
  std::uint64_t start(Request request, Duration timeout);
  template <class PubSubType>
  fast::DataWriter* writer_to(Edge& from, Edge::Writers& writers, const std::string& topic,
                              const std::string& partition);
  fast::DataWriter* requests_to(Edge& from, const std::string& partition);
  fast::DataWriter* outputs_to(Edge& from, const std::string& partition);
  std::string partition_of(const Target& target) const;
  Edge* edge_of(std::uint64_t number);
  bool note_publisher(const std::string& gateway, const std::string& line);
  // The change to another participant
  std::unique_ptr<Edge> make_edge(std::vector<Diagnostic>& diagnostics);
  void begin_change();
  void advance_change();
  void end_change();
  void retire(Edge& one);

  const ClientOptions options;
  const std::string name;
  const Security& security = options.security;
  const bool sends_commands = options.commands;
  const bool sends_outputs = options.outputs;
  const bool of_gateway = options.of_gateway;
  const std::set<std::string> only;
  std::uint64_t participants = 0;  // made so far
  AddressWatch addresses{options.network.interfaces};
  ParticipantChange change;
  std::unique_ptr<Edge> edge;
  std::unique_ptr<Edge> next;                 // discovers gateways, and is not used yet
  std::vector<std::unique_ptr<Edge>> former;  // have requests that are not answered
  Waiting waiting;
  std::size_t handled = 0;  // samples, in the present poll
  fast::SampleInfo info;    // of the sample being handled
  LinePublishers publishers;
  std::map<fast::InstanceHandle_t, std::pair<std::string, std::string>> line_names;
  Instances node_instances;
  Instances group_instances;
  std::uint64_t left_out = 0;  // samples, in the present poll
  std::uint64_t foreign_samples = 0;
  GatewayHolders holders{security.is_holder};
  // The newest sample of each writer, and that until which a former participant received them
  std::map<WriterGuid, eprosima::fastrtps::rtps::SequenceNumber_t> newest;
  std::map<WriterGuid, eprosima::fastrtps::rtps::SequenceNumber_t> received;
  std::set<WriterGuid> state_writers;  // of gateways and lines
  std::set<WriterGuid> unconfirmed;    // those that the present participant did not receive from
  Instant confirm_by = kNever;

  v1::GatewayState gateway_sample;
  v1::LineState line_sample;
  v1::NodeState node_sample;
  v1::OutputState output_state_sample;
  v1::ImageLayout layout_sample;
  v1::ProcessImage image_sample;
  v1::PdoUpdate pdo_sample;
  v1::PdoReception reception_sample;
  v1::Event event_sample;
  v1::CommandReply reply_sample;
  v1::CommandRequest request_sample;
  v1::OutputWrite output_sample;

  LayoutAssembly assembly;
  RequestTracker tracker;
  std::optional<EventFollower> follower;  // with complete_events
  EventFilter filter;                     // of a gateway
  std::set<std::uint64_t> pages;          // ids of the requests of the follower
  std::uint64_t next_id;
  std::uint64_t called = 0;  // id of the request that call() waits for
  std::optional<CommandResult> call_result;
};

Client::Impl::Impl(const ClientOptions& the_options, std::vector<Diagnostic>& diagnostics)
    : options(the_options),
      name(options.name.empty() ? default_name() : options.name),
      only(options.only.begin(), options.only.end()),
      tracker(options.retry) {
  if (options.complete_events && options.events && options.commands)
    follower.emplace(options.events_from_oldest);
  // Ids are never reused, not even by the next client of the same name.
  std::random_device random;
  next_id = (std::uint64_t{random()} << 32U | random()) >> 1U | 1U;
  edge = make_edge(diagnostics);
  for (fast::DataReader** reader : edge->readers()) {
    if (*reader != nullptr)
      waiting.watch(*reader);
  }
}

Client::Impl::~Impl() {
  for (Edge* one : {edge.get(), next.get()}) {
    if (one != nullptr)
      one->line_writers.close();
  }
}

std::unique_ptr<Edge> Client::Impl::make_edge(std::vector<Diagnostic>& diagnostics) {
  addresses.look();
  auto out = std::make_unique<Edge>(options, name, ++participants, waiting, diagnostics);
  addresses.created();
  if (!security.enabled()) {
    if (sends_commands)
      requests_to(*out, "");
    if (sends_outputs)
      outputs_to(*out, "");
  }
  out->endpoints.seal();
  return out;
}

// With DDS-Security a writer is created with the first request to a line: requests that it writes
// before the gateway has matched it are lost and repeated.
template <class PubSubType>
fast::DataWriter* Client::Impl::writer_to(Edge& from, Edge::Writers& writers,
                                          const std::string& topic, const std::string& partition) {
  const auto [known, added] = writers.try_emplace(partition);
  if (added) {
    const std::uint32_t strength = options.output_strength;
    const Duration lifetime = of_gateway ? kSampleLifetime : Duration{};
    known->second = security.enabled()
                        ? from.endpoints.writer_in<PubSubType>(partition, topic, strength, lifetime)
                        : from.endpoints.writer<PubSubType>(topic, strength, lifetime);
  }
  return known->second;
}

std::string Client::Impl::partition_of(const Target& target) const {
  return security.enabled() ? request_partition(target.gateway, target.line, security.right) : "";
}

fast::DataWriter* Client::Impl::requests_to(Edge& from, const std::string& partition) {
  return writer_to<v1::CommandRequestPubSubType>(from, from.requests, v1::TOPIC_COMMAND_REQUEST,
                                                 partition);
}

fast::DataWriter* Client::Impl::outputs_to(Edge& from, const std::string& partition) {
  return writer_to<v1::OutputWritePubSubType>(from, from.outputs, v1::TOPIC_OUTPUT_WRITE,
                                              partition);
}

bool is_line_name(std::string_view text) {
  const std::size_t slash = text.find('/');
  return slash != 0 && slash != std::string_view::npos && slash + 1 < text.size() &&
         text.find_first_of("/*?[", slash + 1) == std::string_view::npos &&
         text.find_first_of("*?[") == std::string_view::npos;
}

Loaded<std::unique_ptr<Client>> Client::make(const ClientOptions& options) {
  Loaded<std::unique_ptr<Client>> result;
  auto impl = std::make_unique<Impl>(options, result.diagnostics);
  if (impl->edge->endpoints.ok()) {
    result.value = std::unique_ptr<Client>(new Client(std::move(impl)));
  }
  return result;
}

Client::Client(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {
}
Client::~Client() = default;

const std::string& Client::name() const {
  return impl_->name;
}

// Nothing is received of a gateway without a line that is wanted.
Peers Client::peers() const {
  Peers out = impl_->edge->endpoints.peers();
  const std::set<std::string>& only = impl_->only;
  std::erase_if(out.gateways, [&only](const std::string& gateway) {
    const auto line = only.lower_bound(gateway + "/");
    return !only.empty() && (line == only.end() || !line->starts_with(gateway + "/"));
  });
  return out;
}

std::vector<ObservedEndpoint> Client::own_readers() const {
  std::vector<ObservedEndpoint> out;
  for (fast::DataReader** const one : impl_->edge->readers()) {
    const fast::DataReader* const reader = *one;
    if (reader == nullptr)
      continue;
    const fast::DataReaderQos& qos = reader->get_qos();
    const fast::SubscriberQos& subscriber = reader->get_subscriber()->get_qos();
    ObservedEndpoint own{
        .guid = guid_of(eprosima::fastrtps::rtps::InstanceHandle_t(reader->guid())),
        .own = true,
        .topic = reader->get_topicdescription()->get_name(),
        .type = reader->get_topicdescription()->get_type_name(),
        .qos = observed_qos(qos.reliability(), qos.durability(), qos.ownership(), qos.deadline(),
                            qos.liveliness()),
    };
    for (const std::string& name : subscriber.partition().names())
      own.qos.partitions.push_back(name);
    out.push_back(std::move(own));
  }
  return out;
}

void Client::change_participant() {
  impl_->change.want();
}

std::uint64_t Client::participants() const {
  return impl_->edge->number;
}

void Client::wake() {
  impl_->waiting.wake();
}

// --- receiving -----------------------------------------------------------------------------------

std::size_t Client::poll(Duration timeout, ClientListener& listener) {
  impl_->handled = 0;
  impl_->advance_change();
  impl_->edge->endpoints.limit_stalls();
  impl_->keep_asking(listener);
  impl_->follow_events(listener);
  const Instant wake =
      earlier(impl_->tracker.next_wake(), impl_->follower ? impl_->follower->next_wake() : kNever);
  const Instant look =
      impl_->options.follow_interfaces ? earlier(wake, impl_->change.next_wake()) : wake;
  const Duration until_wake = look == kNever ? timeout : look - steady_now();
  if (impl_->waiting.wait(std::min(timeout, until_wake))) {
    impl_->drain_layouts(listener);
    impl_->drain_states(listener);
    impl_->report_lines_gone(listener);
    impl_->drain_values(listener);
    impl_->drain_events(listener);
    impl_->drain_replies(listener);
    const std::uint64_t unreadable = impl_->edge->endpoints.pop_unreadable();
    if (unreadable != 0)
      listener.on_unreadable(unreadable);
    if (impl_->left_out != 0)
      listener.on_left_out(std::exchange(impl_->left_out, 0));
  }
  impl_->keep_asking(listener);
  impl_->follow_events(listener);
  return impl_->handled;
}

template <class Sample, class Handle>
void Client::Impl::drain(fast::DataReader* reader, Sample& sample, Handle handle,
                         Repeated repeated) {
  drain(
      reader, sample, handle, [] {}, repeated);
}

// ended: called when an instance has ended; `info` identifies it.
template <class Sample, class Handle, class Ended>
void Client::Impl::drain(fast::DataReader* reader, Sample& sample, Handle handle, Ended ended,
                         Repeated repeated) {
  if (reader == nullptr)
    return;
  for (int i = 0; i < kSamplesPerTopic; ++i) {
    if (reader->take_next_sample(&sample, &info) != ReturnCode_t::RETCODE_OK)
      return;
    if (!info.valid_data) {
      ended();
      continue;
    }
    if (!is_of_gateway(sample.gateway().to_string())) {
      ++foreign_samples;
      continue;
    }
    if (is_repetition() && repeated == Repeated::dropped)
      continue;
    ++handled;
    handle(sample);
  }
  waiting.wake();
}

// Of the sample that `info` describes.
bool Client::Impl::is_of_gateway(const std::string& gateway) {
  return holders.has(participant_of(guid_of(info.publication_handle)), gateway);
}

// Whether a former participant received it, too: DDS numbers the samples of a writer for all of its
// readers.
bool Client::Impl::is_repetition() {
  if (!options.follow_interfaces && participants == 1)
    return false;
  const WriterGuid writer = guid_of(info.publication_handle);
  const auto& number = info.sample_identity.sequence_number();
  const auto before = received.find(writer);
  if (before != received.end()) {
    if (number <= before->second)
      return true;
    received.erase(before);
  }
  if (newest.size() >= kMostWriters && !newest.contains(writer))
    newest.clear();
  newest[writer] = number;
  return false;
}

// Called before values are drained, so that a layout is known when its first image arrives.
void Client::Impl::drain_layouts(ClientListener& listener) {
  drain(edge->layouts, layout_sample, [&](const v1::ImageLayout& sample) {
    image::Layout layout;
    if (assembly.take(sample, layout))
      listener.on_layout(source(sample), layout);
  });
}

// The writer of the sample that `info` describes. Returns false if there are too many lines.
bool Client::Impl::note_publisher(const std::string& gateway, const std::string& line) {
  const WriterGuid writer = guid_of(info.publication_handle);
  unconfirmed.erase(writer);
  if (state_writers.size() < kMostWriters)
    state_writers.insert(writer);
  return publishers.note(gateway, line, writer, steady_now());
}

void Client::Impl::drain_states(ClientListener& listener) {
  drain(
      edge->gateways, gateway_sample,
      [&](const v1::GatewayState& sample) {
        if (!note_publisher(sample.gateway().to_string(), "")) {
          ++left_out;
          return;
        }
        GatewayInfo gateway;
        from_wire(sample, kUtc, gateway);
        std::erase_if(gateway.lines, [&](const GatewayInfo::Line& line) {
          return !only.empty() && !only.contains(sample.gateway().to_string() + "/" + line.name);
        });
        if (follower) {
          follower->receive_gateway(sample.gateway().to_string(), sample.incarnation(),
                                    gateway.event_stream, gateway.events, steady_now());
        }
        listener.on_gateway(source(sample), gateway);
      },
      Repeated::passed);
  std::vector<Property> properties;
  const auto receive_line = [&](const v1::LineState& sample) {
    if (!note_publisher(sample.gateway().to_string(), sample.line().to_string())) {
      ++left_out;
      return;
    }
    line_names[info.instance_handle] = {sample.gateway().to_string(), sample.line().to_string()};
    LineInfo line;
    line::LineState state;
    from_wire(sample, line, state);
    from_wire(sample.properties(), properties);
    if (!only.empty())  // the number of lines of the gateway, which are not all received
      std::erase_if(properties, [](const Property& one) { return one.name == "lines"; });
    if (follower) {
      follower->receive_line(sample.gateway().to_string(), sample.line().to_string(),
                             state.counters.events, steady_now());
    }
    listener.on_line(source(sample), line, state, properties);
  };
  drain(
      edge->lines, line_sample, receive_line, [&] { line_ended(listener); }, Repeated::passed);
  drain_nodes(listener);
  drain_output_states(listener);
}

void Client::Impl::drain_nodes(ClientListener& listener) {
  std::vector<Property> properties;
  const auto receive = [&](const v1::NodeState& sample) {
    NodeInfo node;
    line::NodeState state;
    from_wire(sample, kUtc, node, state);
    from_wire(sample.properties(), properties);
    const Source of = source(sample);
    note_instance(node_instances, of, state.node);
    listener.on_node(of, node, state, properties);
  };
  drain(
      edge->nodes, node_sample, receive,
      [&] {
        if (const auto ended = end_instance(node_instances))
          listener.on_node_gone(ended->gateway, ended->line,
                                static_cast<std::uint8_t>(ended->number));
      },
      Repeated::passed);
}

void Client::Impl::drain_output_states(ClientListener& listener) {
  const auto receive = [&](const v1::OutputState& sample) {
    line::OutputState state;
    from_wire(sample, kUtc, state);
    const Source of = source(sample);
    note_instance(group_instances, of, state.group);
    listener.on_output_state(of, state);
  };
  drain(
      edge->output_states, output_state_sample, receive,
      [&] {
        if (const auto ended = end_instance(group_instances))
          listener.on_output_state_gone(ended->gateway, ended->line, ended->number);
      },
      Repeated::passed);
}

// The one of the sample that `info` describes.
void Client::Impl::note_instance(Instances& instances, const Source& of, std::uint16_t number) {
  instances.note(info.instance_handle, {of.gateway, of.line, number},
                 guid_of(info.publication_handle));
}

// An instance without writers has not ended: its gateway may only be late.
std::optional<Client::Impl::Instances::Place> Client::Impl::end_instance(Instances& instances) {
  if (info.instance_state != fast::NOT_ALIVE_DISPOSED_INSTANCE_STATE)
    return std::nullopt;
  auto ended = instances.end(info.instance_handle, guid_of(info.publication_handle));
  if (ended)
    ++handled;
  return ended;
}

// The gateway removed the line and continues without it. A lost writer is handled by
// report_lines_gone().
void Client::Impl::line_ended(ClientListener& listener) {
  const auto found = line_names.find(info.instance_handle);
  if (info.instance_state != fast::NOT_ALIVE_DISPOSED_INSTANCE_STATE || found == line_names.end())
    return;
  const auto [gateway, line] = found->second;
  if (!publishers.forget(gateway, line, guid_of(info.publication_handle)))
    return;
  line_names.erase(found);
  ++handled;
  listener.on_line_gone(gateway, line);
}

// Called after states are drained: the lines of a gateway that was restarted meanwhile are not
// gone.
void Client::Impl::report_lines_gone(ClientListener& listener) {
  std::vector<WriterGuid> gone;
  for (const WriterWatch::Handle& lost : edge->line_writers.pop_lost())
    gone.push_back(guid_of(lost));
  if (steady_now() >= confirm_by) {
    gone.insert(gone.end(), unconfirmed.begin(), unconfirmed.end());
    unconfirmed.clear();
    confirm_by = kNever;
  }
  for (const WriterGuid& lost : gone) {
    state_writers.erase(lost);
    for (const LinePublishers::Line& line : publishers.lose(lost)) {
      std::erase_if(line_names, [&](const auto& known) { return known.second == line; });
      ++handled;
      listener.on_line_gone(line.first, line.second);
    }
  }
}

void Client::Impl::drain_values(ClientListener& listener) {
  drain(edge->images, image_sample, [&](const v1::ProcessImage& sample) {
    image::Snapshot snapshot;
    if (from_wire(sample, kUtc, snapshot))
      listener.on_image(source(sample), snapshot);
  });
  drain(edge->pdos, pdo_sample, [&](const v1::PdoUpdate& sample) {
    PdoUpdate update;
    from_wire(sample, kUtc, update);
    listener.on_pdo(source(sample), update);
  });
  drain(edge->receptions, reception_sample, [&](const v1::PdoReception& sample) {
    PdoReception reception;
    from_wire(sample, kUtc, reception);
    listener.on_reception(source(sample), reception);
  });
}

void Client::Impl::drain_events(ClientListener& listener) {
  const auto pass_on = [&](const FollowedEvent& it) {
    listener.on_event(it.source, it.event, it.text, it.properties);
  };
  if (of_gateway)
    filter.advance(publishers, steady_now(), pass_on);
  drain(edge->events, event_sample, [&](const v1::Event& sample) {
    FollowedEvent of{.source = source(sample)};
    from_wire(sample, kUtc, of.event);
    if (!of_gateway) {  // many may wait, and these are most of their octets
      of.text = sample.text().to_string();
      from_wire(sample.properties(), of.properties);
    }
    if (follower) {
      follower->take(std::move(of), steady_now());
    } else if (of_gateway) {
      filter.take(std::move(of), participant_of(guid_of(info.publication_handle)), publishers,
                  steady_now(), pass_on);
    } else {
      pass_on(of);
    }
  });
}

// A request is sent, and answered, by one participant: two would each have it carried out.
void Client::Impl::drain_replies(ClientListener& listener) {
  const auto receive = [&](const Edge& by, const v1::CommandReply& sample) {
    if (sample.client() != name.c_str() || tracker.participant_of(sample.id()) != by.number)
      return;
    const ParticipantPrefix sender = participant_of(guid_of(info.publication_handle));
    if (auto done = tracker.take(sample, sender, publishers, steady_now()))
      finish(std::move(*done), listener);
  };
  const auto drain_those_of = [&](const Edge& by) {
    drain(
        by.replies, reply_sample, [&](const v1::CommandReply& sample) { receive(by, sample); },
        Repeated::passed);
  };
  drain_those_of(*edge);
  for (const auto& one : former)
    drain_those_of(*one);
}

// --- another participant -------------------------------------------------------------------------

Edge* Client::Impl::edge_of(std::uint64_t number) {
  if (edge->number == number)
    return edge.get();
  const auto found =
      std::ranges::find_if(former, [&](const auto& one) { return one->number == number; });
  return found == former.end() ? nullptr : found->get();
}

void Client::Impl::advance_change() {
  std::erase_if(former, [this](const auto& one) {
    const bool done = !tracker.has_requests_of(one->number);
    if (done && one->replies != nullptr)
      waiting.forget(one->replies);
    return done;
  });
  const Instant now = steady_now();
  if (next != nullptr) {
    if (has_matched_all(*next, *edge)) {
      end_change();
    } else if (change.gives_up(now)) {
      next.reset();
      change.failed(now);
    }
  } else if (options.follow_interfaces && change.looks(now) && !edge->uses_tcp()) {
    if (!addresses.added().empty())
      change.want();
    if (former.size() < kMostFormer && change.begins(now))
      begin_change();
  }
}

void Client::Impl::begin_change() {
  std::vector<Diagnostic> diagnostics;
  try {
    next = make_edge(diagnostics);
  } catch (const std::exception&) {  // of the cryptographic library, or no memory
    next.reset();
  }
  if (next != nullptr && !next->endpoints.ok())
    next.reset();
  if (next == nullptr)
    return change.failed(steady_now());
  change.began(steady_now());
  for (const auto& [partition, writer] : edge->requests)
    requests_to(*next, partition);
  for (const auto& [partition, writer] : edge->outputs)
    outputs_to(*next, partition);
}

void Client::Impl::end_change() {
  change.ended();
  received = newest;
  unconfirmed = state_writers;
  confirm_by = steady_now() + kConfirmation;
  retire(*edge);
  former.push_back(std::exchange(edge, std::move(next)));
  tracker.move(former.back()->number, edge->number);
  for (fast::DataReader** reader : edge->readers()) {
    if (*reader != nullptr)
      waiting.watch(*reader);
  }
  waiting.wake();  // there are samples already
}

// It receives replies alone. Another writer owns the outputs now.
void Client::Impl::retire(Edge& one) {
  one.line_writers.close();
  for (fast::DataReader** reader : one.readers()) {
    if (*reader == nullptr || *reader == one.replies)
      continue;
    waiting.forget(*reader);
    (*reader)->set_listener(nullptr);
    one.endpoints.remove(std::exchange(*reader, nullptr));
  }
  for (const auto& [partition, writer] : std::exchange(one.outputs, {})) {
    if (writer != nullptr)
      one.endpoints.remove(writer);
  }
}

// --- commands ------------------------------------------------------------------------------------

void Client::Impl::finish(RequestTracker::Done done, ClientListener& listener) {
  if (pages.erase(done.result.id) != 0) {
    follower->receive_answer(done.target.gateway, done.target.line, done.result, steady_now());
    return;
  }
  if (done.result.id == called) {
    call_result = std::move(done.result);
  } else {
    listener.on_reply(done.target, done.result);
  }
}

void Client::Impl::keep_asking(ClientListener& listener) {
  const Instant now = steady_now();
  const auto host_of = [this](const ParticipantPrefix& it) { return edge->endpoints.host_of(it); };
  while (auto done = tracker.disputed(publishers, host_of))
    finish(std::move(*done), listener);
  while (auto done = tracker.expired(now))
    finish(std::move(*done), listener);
  while (const Request* request = tracker.due(now)) {
    Edge* const by = edge_of(request->participant);
    fast::DataWriter* writer =
        by == nullptr ? nullptr : requests_to(*by, partition_of(request->target));
    if (writer == nullptr) {
      finish(tracker.refuse(request->id, kNotPermitted), listener);
    } else if (!send(*request, *writer)) {
      return;
    }
  }
}

// Passes on the events that are in order, and requests those that are missing.
void Client::Impl::follow_events(ClientListener& listener) {
  if (!follower)
    return;
  while (auto fetch = follower->due(steady_now())) {
    const std::uint64_t id = start(
        {.target = std::move(fetch->target), .request = std::move(fetch->read)}, kPageTimeout);
    pages.insert(id);
  }
  for (EventFollower::Item item; follower->pop(item);) {
    if (const auto* const event = std::get_if<FollowedEvent>(&item)) {
      listener.on_event(event->source, event->event, event->text, event->properties);
    } else if (const auto* const missing = std::get_if<MissingEvents>(&item)) {
      listener.on_events_missing({missing->gateway, missing->line}, missing->stream, missing->first,
                                 missing->last);
    } else if (const auto* const stream = std::get_if<NewEventStream>(&item)) {
      listener.on_event_stream({stream->gateway, stream->line}, stream->before, stream->now,
                               stream->lost);
    }
  }
}

bool Client::Impl::send(const Request& request, fast::DataWriter& writer) {
  v1::CommandRequest& sample = request_sample;
  sample.gateway(request.target.gateway);
  sample.line(request.target.line);
  sample.client(name);
  sample.incarnation(request.target.incarnation);
  sample.id(request.id);
  sample.layout_id(request.layout_id);
  sample.reply_offset(tracker.reply_offset(request.id));
  to_wire(request.request, RequestTracker::gateway_timeout(request, steady_now()), sample);
  if (sample.reply_offset() != 0) {
    set_chunk({}, 0, sample);
    return writer.write(&sample);
  }
  std::size_t offset = 0;
  do {
    set_chunk(request.data, offset, sample);
    if (!writer.write(&sample))
      return false;
    offset += sample.data().size();
  } while (!sample.last());
  return true;
}

std::uint64_t Client::Impl::start(Request request, Duration timeout) {
  if (!sends_commands)
    return 0;
  const Instant now = steady_now();
  request.data = encode_data(request.request);
  request.id = next_id++;
  request.deadline = timeout > kNever - now ? kNever : now + timeout;
  request.once = of_gateway;
  request.participant = edge->number;
  const std::uint64_t id = request.id;
  const bool disputed = publishers.disputed(request.target.gateway, request.target.line);
  tracker.add(std::move(request), now);
  if (disputed)
    return id;  // poll() ends it: of several receivers each would carry it out
  const Request* due = tracker.due(now);
  Edge* const by = due == nullptr ? nullptr : edge_of(due->participant);
  fast::DataWriter* writer = by == nullptr ? nullptr : requests_to(*by, partition_of(due->target));
  if (writer != nullptr)
    send(*due, *writer);
  return id;
}

std::uint64_t Client::send(const Target& target, const line::Command& command, Duration timeout,
                           std::uint64_t layout_id) {
  return impl_->start({.target = target,
                       .request = command.request,
                       .timeout = command.timeout,
                       .layout_id = layout_id},
                      timeout);
}

std::uint64_t Client::send_request(const Target& target, const request::Request& request,
                                   Duration command_timeout, Duration timeout,
                                   std::uint64_t layout_id) {
  return impl_->start(
      {.target = target, .request = request, .timeout = command_timeout, .layout_id = layout_id},
      timeout);
}

void Client::prepare(const Target& target) {
  if (impl_->sends_commands && impl_->security.enabled())
    impl_->requests_to(*impl_->edge, impl_->partition_of(target));
}

void Client::cancel(std::uint64_t id) {
  impl_->tracker.cancel(id);
}

CommandResult Client::wait_for(std::uint64_t id, Duration timeout, ClientListener& listener) {
  impl_->call_result.reset();
  impl_->called = id;
  if (id == 0) {
    return {0, {0, line::to_error(line::Refusal::bad_request), {}}, "this client has no commands"};
  }
  while (!impl_->call_result)
    poll(timeout, listener);
  poll(Duration::zero(), listener);  // receives an event that arrived just before the reply
  impl_->called = 0;
  return std::move(*impl_->call_result);
}

CommandResult Client::call(const Target& target, const line::Command& command, Duration timeout,
                           ClientListener& listener, std::uint64_t layout_id) {
  return wait_for(send(target, command, timeout, layout_id), timeout, listener);
}

CommandResult Client::call_gateway(const Target& target, const request::GatewayRequest& request,
                                   Duration timeout, ClientListener& listener) {
  return wait_for(impl_->start({.target = target, .request = request}, timeout), timeout, listener);
}

void Client::begin_events_after(const std::string& gateway, const std::string& line,
                                request::EventPosition position) {
  if (impl_->follower)
    impl_->follower->begin_after(gateway, line, position);
}

bool Client::write_outputs(const Target& target, const line::OutputWrite& write) {
  fast::DataWriter* writer =
      impl_->sends_outputs ? impl_->outputs_to(*impl_->edge, impl_->partition_of(target)) : nullptr;
  if (writer == nullptr)
    return false;
  v1::OutputWrite& sample = impl_->output_sample;
  sample.gateway(target.gateway);
  sample.line(target.line);
  sample.incarnation(target.incarnation);
  sample.client(impl_->name);
  return to_wire(write, sample) && writer->write(&sample);
}

guard::Stall Client::longest_stall() const {
  return impl_->edge->endpoints.longest_stall();
}

void Client::watch_timers() {
  impl_->edge->endpoints.watch_timers();
}

guard::Counters Client::guard_counters() const {
  return impl_->edge->endpoints.guard_counters();
}

std::uint64_t Client::foreign_replies() const {
  return impl_->tracker.foreign();
}

std::uint64_t Client::foreign_samples() const {
  return impl_->foreign_samples;
}

std::size_t Client::command_peers() const {
  return peers_of(impl_->edge->requests);
}

std::size_t Client::output_peers() const {
  return peers_of(impl_->edge->outputs);
}

std::size_t Client::layout_peers() const {
  return static_cast<std::size_t>(std::max(matched(impl_->edge->layouts), 0));
}

}  // namespace linegate::dds

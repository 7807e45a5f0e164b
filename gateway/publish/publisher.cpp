// SPDX-License-Identifier: Apache-2.0
#include "gateway/publish/publisher.h"

#include <algorithm>
#include <cerrno>
#include <ctime>
#include <utility>

#include <fmt/format.h>
#include <poll.h>
#include <pthread.h>
#include <spdlog/spdlog.h>

#include "gateway/publish/access.h"
#include "gateway/publish/boot_text.h"
#include "gateway/publish/controller_text.h"
#include "gateway/publish/event_text.h"
#include "gateway/publish/output_groups.h"
#include "gateway/publish/routing_text.h"
#include "gateway/runtime/channels.h"
#include "stack/can/cob_id.h"
#include "stack/diagnosis/network_state.h"
#include "stack/line/event_severity.h"
#include "stack/usdo/abort_form.h"

namespace linegate::gateway {
namespace {

constexpr Duration kClockPeriod = std::chrono::milliseconds(500);
constexpr Duration kStatePeriod = std::chrono::seconds(1);
constexpr Duration kImageRetry = std::chrono::milliseconds(5);
constexpr Duration kEndRetry = std::chrono::milliseconds(250);
constexpr std::size_t kMostEnding = 256;  // lines whose values have to be ended
constexpr Duration kFailurePeriod = std::chrono::seconds(10);

// Compares the members whose changes are published at once; counters and load follow every second.
bool same_state(const line::LineState& a, const line::LineState& b) {
  return a.role == b.role && a.node_id == b.node_id && a.own_state == b.own_state &&
         a.indicators == b.indicators && a.manager == b.manager && a.network == b.network &&
         a.bus == b.bus && a.transmit_errors == b.transmit_errors &&
         a.receive_errors == b.receive_errors && a.nodes_configured == b.nodes_configured &&
         a.nodes_operational == b.nodes_operational && a.sleep == b.sleep;
}

// Compares the members whose changes are published at once.
bool same_outputs(const line::OutputState& a, const line::OutputState& b) {
  return a.owner == b.owner && a.refused == b.refused && a.arming == b.arming &&
         a.arming_wanted == b.arming_wanted && a.watchdog == b.watchdog && a.waiting == b.waiting &&
         a.waits == b.waits && (a.applied == 0) == (b.applied == 0);
}

std::string indicators_text(const node::Indicators& shown) {
  return "run " + std::string(node::name(shown.run)) + ", error " +
         std::string(node::name(shown.error));
}

// NodeState's properties, idl/README.md.
std::vector<Property> node_properties(const NodeStatus& status) {
  std::vector<Property> out = boot_properties(status.state);
  if (status.own) {
    const std::uint8_t id = status.own->node_id;
    out.push_back({"node-id", id == 0 ? "none" : std::to_string(id)});
    out.push_back({"indicators", indicators_text(status.own->indicators)});
  }
  return out;
}

void add_network(std::uint8_t state, std::vector<Property>& out) {
  out.push_back(
      {"ixxat_state", fmt::format("0x{:02X} {}", state, diagnosis::name_of_network_state(state))});
}

// Of a line of CANopen FD.
void add_fd(const line::LineConfig& config, const can_bridge::ControllerSetup& controller,
            std::vector<Property>& out) {
  if (!config.canopen_fd) {
    return;
  }
  out.push_back({"usdo-abort", std::string(usdo::name(config.usdo_abort))});
  const std::uint32_t rate =
      config.data_bit_rate != 0 ? config.data_bit_rate : controller.data_bit_rate;
  if (rate != 0) {
    out.push_back({"data-bit-rate", std::to_string(rate)});
  }
}

// LineState's properties, idl/README.md.
void set_properties(std::string_view outputs_access, const QueueDepths& queues,
                    std::vector<Property>& out) {
  out.resize(5);
  out[0] = {"outputs-access", std::string(outputs_access)};
  out[1] = {"receive-queue-peak", std::to_string(queues.receive_peak)};
  out[2] = {"transmit-queue", std::to_string(queues.transmit)};
  out[3] = {"transmit-stalls", std::to_string(queues.transmit_stalls)};
  out[4] = {"event-queue", std::to_string(queues.events)};
}

// Properties by which a subscriber determines whether it has received the states of all lines of
// all gateways: the number of lines of this gateway, and the other gateways that it has discovered,
// as far as they fit.
void add_gateways(std::size_t lines, const std::vector<std::string>& others,
                  std::vector<Property>& out) {
  constexpr std::size_t kMost = 240;  // bytes; a value has up to 256
  std::string text;
  std::size_t left_out = 0;
  for (const std::string& other : others) {
    if (left_out != 0 || text.size() + other.size() > kMost) {
      ++left_out;
    } else {
      text += (text.empty() ? "" : ",") + other;
    }
  }
  if (left_out != 0) {
    text += (text.empty() ? "+" : ",+") + std::to_string(left_out);
  }
  out.push_back({"lines", std::to_string(lines)});
  out.push_back({"other-gateways", text});
}

void wait_readable(int descriptor, Instant until, Instant now) {
  pollfd p{descriptor, POLLIN, 0};
  if (until == kNever) {
    poll(&p, 1, -1);
    return;
  }
  const Duration left = std::max(Duration::zero(), until - now);
  const auto seconds = std::chrono::floor<std::chrono::seconds>(left);
  const timespec ts{static_cast<std::time_t>(seconds.count()),
                    static_cast<long>((left - seconds).count())};
  ppoll(&p, 1, &ts, nullptr);
}

}  // namespace

Publisher::Line::Line(LineHost& line_host, LineHistory& line_history, NumberedLine* numbered_line)
    : host(&line_host),
      history(&line_history),
      numbers(numbered_line),
      info{line_host.name(), line_host.plan.interface.uri, line_host.plan.config.bit_rate,
           line_host.plan.commands},
      output_groups(output_group_properties(line_host.plan.config.groups)),
      layouts(line_host.layouts),
      updates(line_host.plan.pdo_min_period),
      sequences{ImageSequence(line_host.plan.publish.rule),
                ImageSequence(line_host.plan.publish.rule)} {
  for (const auto& node : line_host.plan.config.nodes) {
    nodes[node.id].name = node.name;
  }
  for (const auto& device : line_host.plan.config.devices) {
    nodes[device.id].name = device.name;
  }
  if (line_host.plan.named.published) {
    for (auto& samples : named) {
      samples = std::make_unique<NamedSamples>(line_host.plan);
    }
  }
  if (numbered_line != nullptr && !line_host.plan.history.entries.empty()) {
    values = std::make_unique<ValueSampler>(line_host.plan.history, line_host.name(), layouts);
  }
}

Publisher::Publisher(DataEdge& edge, std::span<const std::unique_ptr<LineHost>> lines,
                     JournalThread* journal)
    : edge_(edge), journal_(journal) {
  if (journal_ != nullptr) {
    gateway_numbers_ = &journal_->add_line({});
    gateway_.events = gateway_numbers_->before;
  }
  edge_.watch_readers([this] {
    readers_changed_.raise();
    wakeup_.signal();
  });
  set_lines(lines);
}

void Publisher::set_lines(std::span<const std::unique_ptr<LineHost>> lines) {
  std::vector<std::unique_ptr<Line>> before = std::exchange(lines_, {});
  for (const auto& host : lines) {
    const auto known = std::find_if(before.begin(), before.end(), [&](const auto& line) {
      return line != nullptr && line->host == host.get();
    });
    if (known != before.end()) {
      lines_.push_back(std::move(*known));
      continue;
    }
    const auto [past, is_new] = past_.try_emplace(host->name());
    auto& [history, numbers] = past->second;
    if (is_new && journal_ != nullptr) {
      numbers = &journal_->add_line(host->name());
      history.begin_after(numbers->before);
    }
    history.restart();
    lines_.push_back(std::make_unique<Line>(*host, history, numbers));
  }
  for (const auto& gone : before) {
    if (gone != nullptr && gone->values != nullptr) {
      ending_.push_back(std::move(gone->values));
    }
  }
  if (ending_.size() > kMostEnding) {
    ending_.erase(ending_.begin(), ending_.end() - kMostEnding);
  }
  end_values();
  interfaces_.clear();
  for (const auto& host : lines) {
    interfaces_.emplace_back(host->interface(), host->name());
    for (const routing::Interface& each : host->plan.config.routing.interfaces) {
      if (each.way != nullptr) {
        interfaces_.emplace_back(each.number, each.name);
      }
    }
  }
}

Publisher::~Publisher() {
  edge_.watch_readers({});
  stop();
}

void Publisher::start() {
  stop_.lower();
  thread_ = std::thread([this] { run(); });
}

void Publisher::stop() {
  stop_.raise();
  wakeup_.signal();
  if (thread_.joinable()) {
    thread_.join();
  }
}

void Publisher::run() {
  pthread_setname_np(pthread_self(), "publisher");
  refresh_clock(monotonic_now());
  publish_layouts();
  for (;;) {
    wakeup_.clear();
    const bool last = stop_.raised();
    const Instant next = step(monotonic_now());
    rounds_.add();
    if (last) {
      return;
    }
    wait_readable(wakeup_.descriptor(), next, monotonic_now());
  }
}

void Publisher::publish_layouts() {
  for (const auto& line : lines_) {
    if (!std::exchange(line->layouts_known, true)) {
      publish_layout(*line, line->host->layout(image::Direction::inputs));
      publish_layout(*line, line->host->layout(image::Direction::outputs));
      if (line->host->port.direct != nullptr) {
        edge_.share_images(line->info.name, line->host->port.direct);
      }
    }
  }
}

// The types of named topics follow from the layout. A configuration whose names collide is refused
// when it is read, so this is a layout that a scan or an observer has found.
void Publisher::publish_layout(Line& line, const image::Layout& layout) {
  edge_.publish_layout(line.info.name, layout);
  const auto& named = line.named[static_cast<std::size_t>(layout.direction)];
  if (named == nullptr) {
    return;
  }
  for (const std::string& collision : named->use(layout)) {
    spdlog::warn("{}: no named topic: {}", line.info.name, collision);
  }
  edge_.set_named_types(line.info.name, layout.direction, named->types());
  named->update_readers([&](const auto& type) { return edge_.has_readers(type); });
}

Instant Publisher::step(Instant now) {
  refresh_clock(now);
  for (line::Reply reply; refusals_.pop(reply);) {
    edge_.reply(reply);
  }
  const Instant ends_due = end_values();
  const Instant gateway_next = publish_gateway(now);
  for (const auto& line : lines_) {
    poll_replies(*line);
    publish_events(*line, now);
    publish_replies();
  }
  for (const auto& line : lines_) {
    publish_states(*line, now);
    publish_output_states(*line, now);
  }
  Instant next = publish_page() ? now : gateway_next;
  update_readers();
  for (const auto& line : lines_) {
    publish_new_layouts(*line);
    if (publish_receptions(*line)) {
      next = now;
    }
    for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
      if (!publish_image(*line, direction, now)) {
        next = earlier(next, now + kImageRetry);
      }
    }
    rounds_.add();
    next = earlier(next, publish_named(*line, now));
    next = earlier(next, publish_updates(*line, now));
    next = earlier(next, store_values(*line, now));
  }
  report_failures(now);
  return earlier(next, ends_due);
}

void Publisher::refresh_clock(Instant now) {
  if (now >= clock_due_) {
    clock_.refresh();
    edge_.set_clock(clock_.map());
    clock_due_ = now + kClockPeriod;
  }
}

// Replies are taken before events: events that precede a reply are then already in the event ring,
// and are published before it.
void Publisher::poll_replies(Line& line) {
  for (line::Reply reply; line.host->port.replies.pop(reply);) {
    replies_.push_back(std::move(reply));
  }
}

void Publisher::publish_replies() {
  for (const line::Reply& reply : replies_) {
    edge_.reply(reply);
    rounds_.add();
  }
  replies_.clear();
}

// A page is up to eight samples: only one at once, because other data is waiting, too. Returns true
// if there are more.
bool Publisher::publish_page() {
  if (line::Reply page; pages_.pop(page)) {
    edge_.reply(page);
    rounds_.add();
  }
  return !pages_.empty();
}

void Publisher::publish_events(Line& line, Instant now) {
  for (Event event; line.host->port.events.pop(event);) {
    line.history->correct(event);
    std::uint8_t& node_id = line.node_ids[event.node & can::kMaxNodeId];
    if (const auto* const own = event.get<event::OwnState>()) {
      node_id = own->node_id;
    }
    const std::string text =
        describe(event, line.host->plan.config, name_for_people(line.host->plan.interface),
                 &clients_, node_id);
    journalise(line.numbers, event, text);
    edge_.publish_event(line.info.name, event, text);
    line.logger.write(line.info.name, event, text, now);
    rounds_.add();
  }
  line.logger.advance(line.info.name, now);
}

// Before the event is published: subscribers then have the stream of its number.
void Publisher::journalise(NumberedLine* numbers, const Event& event, std::string_view text) {
  if (journal_ != nullptr) {
    journal_->use_number(*numbers, event.number);
  }
  if (gateway_known_ && stream() != stream_published_) {
    publish_gateway_state(monotonic_now());
  }
  if (journal_ == nullptr) {
    return;
  }
  EventMembers members = edge_.members(event.data);
  entry_.line = numbers->name;
  entry_.number = event.number;
  entry_.time = event.time + clock_.map().offset;
  entry_.clock = clock_.map().quality;
  entry_.kind = event.kind();
  entry_.severity = line::severity_of(event.data);
  entry_.node = event.node;
  entry_.code = members.code;
  entry_.value = members.value;
  entry_.data = std::move(members.data);
  entry_.text = text;
  journal_->record(entry_);
}

void Publisher::publish_states(Line& line, Instant now) {
  if (LineStatus* status = line.host->port.status.fetch()) {
    line.history->correct(status->state);
    status->queues.merge(line.queues);
    line.queues = status->queues;
    update_controller(line, status->controller);
    if (update_routes(line) || !line.state_known || !same_state(line.last_state, status->state) ||
        now - line.state_published >= kStatePeriod || stop_.raised()) {
      const QueueDepths queues = std::exchange(line.queues, {});
      set_properties(config::name(line.host->plan.outputs), queues, line.properties);
      add_gateways(lines_.size(), edge_.other_gateways(), line.properties);
      if (const std::size_t others = edge_.namesakes(); others > 0) {
        line.properties.push_back({"namesakes", std::to_string(others)});
      }
      if (status->state.role != line::Role::observer) {
        line.properties.push_back({"indicators", indicators_text(status->state.indicators)});
        if (line.host->plan.config.devices.empty()) {
          add_network(status->state.network, line.properties);
        }
      }
      line.properties.insert(line.properties.end(), line.output_groups.begin(),
                             line.output_groups.end());
      if (status->sync_period != Duration::zero()) {
        const auto us = std::chrono::duration_cast<std::chrono::microseconds>(status->sync_period);
        line.properties.push_back({"sync-period-us", std::to_string(us.count())});
      }
      add_fd(line.host->plan.config, line.controller, line.properties);
      add_properties(line.controller, line.properties);
      add_forwarding(status->state.routing, line.properties);
      add_srdos(status->state.srdos, line.properties);
      add_sleep(status->state, line.properties);
      if (line.host->interface() != 0) {
        add_properties(status->state.routing, queues.route_stalls, line.properties);
        line.properties.insert(line.properties.end(), line.routes.begin(), line.routes.end());
      }
      edge_.publish_line(line.info, status->state, status->time, line.properties);
      line.host->shown.draft().value = status->state;
      line.host->shown.publish();
      line.state_published = now;
      line.last_state = status->state;
      line.state_known = true;
    }
  }
  for (NodeStatus status; line.host->port.nodes.pop(status);) {
    publish_node(line, status);
    rounds_.add();
  }
}

void Publisher::publish_output_states(Line& line, Instant now) {
  OutputStatus* const status = line.host->port.outputs_status.fetch();
  if (status == nullptr) {
    return;
  }
  const bool all = line.output_states.size() != status->groups.size() ||
                   now - line.outputs_published >= kStatePeriod || stop_.raised();
  for (std::size_t i = 0; i < status->groups.size(); ++i) {
    line::OutputState& group = status->groups[i];
    if (group.refused_client.empty() && group.refused_number != 0) {
      group.refused_client = clients_.name(group.refused_number);
    }
    if (all || !same_outputs(line.output_states[i], status->groups[i])) {
      edge_.publish_output_state(line.info.name, status->groups[i], status->time);
      rounds_.add();
    }
  }
  line.output_states = status->groups;
  if (NamedSamples* const outputs = line.named[1].get(); outputs != nullptr) {
    outputs->note_waits(line.output_states);
  }
  line.outputs_published = all ? now : line.outputs_published;
}

// Returns true if they changed.
bool Publisher::update_routes(Line& line) const {
  const auto* const fresh = line.host->port.routes.fetch();
  if (fresh != nullptr) {
    line.routes = route_properties(*fresh, interfaces_);
  }
  return fresh != nullptr;
}

// The bit rate of the controller overrides the configured one; each difference is reported once.
void Publisher::update_controller(Line& line, const can_bridge::ControllerSetup& controller) {
  if (controller == line.controller) {
    return;
  }
  line.controller = controller;
  const config::LinePlan& plan = line.host->plan;
  line.info.bit_rate = controller.bit_rate != 0 ? controller.bit_rate : plan.config.bit_rate;
  for (const std::string& complaint : complaints(plan, controller)) {
    spdlog::warn("{}: {}", line.info.name, complaint);
  }
}

void Publisher::publish_node(Line& line, const NodeStatus& status) {
  const line::NodeState& state = status.state;
  if (state.node >= line.nodes.size()) {
    return;
  }
  Node& node = line.nodes[state.node];
  if (!node.known || node.last.state != state.state || node.last.presence != state.presence) {
    node.since = status.time;
  }
  node.known = true;
  node.last = state;
  edge_.publish_node(line.info.name, {node.name, node.since}, state, status.time,
                     node_properties(status));
}

// Pending PDO updates of the old layout are invalid in the new one and are discarded.
void Publisher::publish_new_layouts(Line& line) {
  const auto* fresh = line.host->port.layouts.fetch();
  if (fresh == nullptr) {
    return;
  }
  for (const auto direction : {image::Direction::inputs, image::Direction::outputs}) {
    image::Layout& known = line.layouts[static_cast<std::size_t>(direction)];
    const image::Layout& layout = (*fresh)[static_cast<std::size_t>(direction)];
    if (known.id != layout.id) {
      known = layout;
      publish_layout(line, known);
    }
  }
  line.updates = PdoUpdates(line.host->plan.pdo_min_period);
  if (line.values != nullptr) {
    line.values->use(line.layouts, monotonic_now());
  }
}

bool Publisher::publish_image(Line& line, image::Direction direction, Instant now) {
  const auto place = static_cast<std::size_t>(direction);
  if (line.host->port.direct != nullptr) {
    if (direction == image::Direction::inputs) {
      add_direct_inputs(line);
    }
    return true;
  }
  const bool accepted = stop_.raised() || edge_.accepts_image(line.info.name, direction);
  if (!accepted && (line.values == nullptr || !line.deferred[place].is_due(now))) {
    return false;
  }
  image::Snapshot* snapshot = fetch_image(line, direction);
  if (!accepted) {
    if (snapshot != nullptr) {
      line.deferred[place].defer(*snapshot, now);
    }
    return false;
  }
  snapshot = line.deferred[place].take(snapshot);
  if (snapshot == nullptr || snapshot->layout_id != line.layouts[place].id) {
    return true;  // its layout was already replaced
  }
  if (direction == image::Direction::inputs) {
    line.updates.add(*snapshot);
  }
  if (line.sequences[place].admit(*snapshot)) {
    edge_.publish_image(line.info.name, *snapshot);
    if (line.named[place] != nullptr) {
      line.named[place]->note(*snapshot);
    }
  }
  return true;
}

// The line publishes its images itself.
void Publisher::add_direct_inputs(Line& line) {
  if (image::Snapshot* const inputs = line.host->port.image(image::Direction::inputs).fetch()) {
    line.fetched[0] = inputs;
    line.updates.add(*inputs);
  }
}

void Publisher::update_readers() {
  if (!readers_changed_.raised()) {
    return;
  }
  readers_changed_.lower();
  for (const auto& line : lines_) {
    for (const auto& named : line->named) {
      if (named != nullptr) {
        named->update_readers([&](const auto& type) { return edge_.has_readers(type); });
      }
    }
  }
}

// Of the newest image that was published: a reader may come, or the minimum separation may pass,
// when no image follows. Returns when it must be called again.
Instant Publisher::publish_named(Line& line, Instant now) {
  Instant next = kNever;
  for (std::size_t place = 0; place < line.named.size(); ++place) {
    const image::Snapshot* const snapshot = line.fetched[place];
    if (line.named[place] == nullptr || snapshot == nullptr || line.deferred[place].waits() ||
        snapshot->layout_id != line.layouts[place].id) {
      continue;
    }
    const auto emit = [&](const NamedSample& sample) {
      edge_.publish_named(sample, *snapshot);
      rounds_.add();
    };
    const auto accepts = [&](const auto& type) { return edge_.accepts_named(type); };
    next =
        earlier(next, line.named[place]->emit_due(*snapshot, now, stop_.raised(), accepts, emit));
  }
  return next;
}

// The newest one, of which the value history has the values. nullptr: there is no newer one.
image::Snapshot* Publisher::fetch_image(Line& line, image::Direction direction) {
  image::Snapshot* const snapshot = line.host->port.image(direction).fetch();
  if (snapshot == nullptr) {
    return nullptr;
  }
  const image::Layout& layout = line.layouts[static_cast<std::size_t>(direction)];
  if (snapshot->layout_id != layout.id) {
    publish_new_layouts(line);  // the layout was handed over before this image
  }
  line.fetched[static_cast<std::size_t>(direction)] = snapshot;
  if (line.values != nullptr && snapshot->layout_id == layout.id) {
    line.values->add(*snapshot);
  }
  return snapshot;
}

Instant Publisher::publish_updates(Line& line, Instant now) {
  const Instant due = line.updates.publish_due(now, [&](const image::PdoMark& mark,
                                                        std::uint32_t receptions) {
    edge_.publish_pdo_update(line.info.name, line.layouts[0], *line.fetched[0], mark, receptions);
  });
  return line.host->port.direct == nullptr ? due : earlier(due, line.updates.next_look(now));
}

// The values of an earlier line with the same name must end first. end_values() has failed for want
// of room in the queue, which this line would not find either.
Instant Publisher::store_values(Line& line, Instant now) {
  if (line.values == nullptr || !ending_.empty()) {
    return kNever;
  }
  if (const std::uint64_t file = journal_->replaced_files(); file != line.values_file) {
    line.values_file = file;
    line.values->repeat();
  }
  return line.values->store_due(
      now, clock_.map(), [&](StoredValue value) { return journal_->record(std::move(value)); });
}

// Of lines that have ended, in the order of their ends: two of them may have had the same name.
// While the disk fails, the queue of the journal may have no room.
Instant Publisher::end_values() {
  const Instant now = monotonic_now();
  bool has_room = true;
  std::erase_if(ending_, [&](const auto& values) {
    return values->end(now, clock_.map(), [&](StoredValue value) {
      has_room = has_room && journal_->record(std::move(value));
      return has_room;
    });
  });
  return ending_.empty() ? kNever : now + kEndRetry;
}

// Publishes at most as many as the ring holds, because other data is waiting, too. The layout of a
// reception was handed over before it. If a later layout has replaced it, the reception is dropped,
// which the gap in its numbers shows.
bool Publisher::publish_receptions(Line& line) {
  pdo::Reception reception;
  for (std::size_t n = line.host->port.receptions.capacity(); n > 0; --n) {
    if (!line.host->port.receptions.pop(reception)) {
      return false;
    }
    if (reception.layout_id != line.layouts[0].id) {
      publish_new_layouts(line);
    }
    edge_.publish_reception(line.info.name, line.layouts[0], reception);
    rounds_.add();
  }
  return !line.host->port.receptions.empty();
}

void Publisher::report(GatewayNews news) {
  news_.push(std::move(news));
  wakeup_.signal();
}

// Returns when its state must be published again.
Instant Publisher::publish_gateway(Instant now) {
  bool changed = false;
  for (GatewayNews news; news_.pop(news);) {
    news.info.events = gateway_.events;
    gateway_ = std::move(news.info);
    gateway_known_ = changed = true;
    publish_gateway_event(news.event, news.text, now);
  }
  if (!gateway_known_) {
    return kNever;
  }
  for (GatewayNotice notice; notices_.pop(notice);) {
    changed = true;
    publish_gateway_event(notice.event, notice.text, now);
  }
  changed = changed || edge_.participants() != participants_seen_;
  if (changed || now >= gateway_due_ || stop_.raised()) {
    publish_gateway_state(now);
  }
  return gateway_due_;
}

void Publisher::publish_gateway_event(Event& event, const std::string& text, Instant now) {
  gateway_.events = event.number = gateway_.events + 1;
  journalise(gateway_numbers_, event, text);
  edge_.publish_event({}, event, text);
  gateway_logger_.write("gateway", event, text, now);
}

void Publisher::publish_gateway_state(Instant now) {
  refresh_gateway();
  edge_.publish_gateway(gateway_, now);
  gateway_due_ = now + kStatePeriod;
}

std::uint64_t Publisher::stream() const {
  return journal_ == nullptr ? gateway_.event_stream : journal_->stream();
}

void Publisher::refresh_gateway() {
  EdgeStatistics statistics = edge_.statistics();
  gateway_.event_stream = stream_published_ = stream();
  participants_seen_ = statistics.participants;
  gateway_.participants = statistics.participants;
  gateway_.participants_most = statistics.participants_most;
  gateway_.counters = std::move(statistics.counters);
  for (const auto& [name, counter] : added_counters_) {
    gateway_.counters.push_back({name, counter->value()});
  }
}

void Publisher::report_failures(Instant now) {
  const std::uint64_t failed = edge_.failed_samples();
  if (failed != failures_reported_ && now >= failures_due_) {
    spdlog::warn("DDS did not take {} samples", failed - failures_reported_);
    failures_reported_ = failed;
    failures_due_ = now + kFailurePeriod;
  }
}

}  // namespace linegate::gateway

#include "tests/plant/scenario.h"

#include <algorithm>
#include <functional>
#include <optional>
#include <random>
#include <utility>

#include "stack/base/byte_order.h"
#include "stack/eds/reader.h"
#include "stack/od/dictionary.h"
#include "tests/plant/oracles.h"
#include "tests/plant/words.h"
#include "tests/plant/world.h"

namespace linegate::plant {
namespace {

using image::Direction;

// A network as described so far; it is built when the first `at` comes.
struct NetworkPlan {
  line::LineConfig config;
  sim::BusOptions bus;
  std::vector<sim::DeviceOptions> devices;
};

class Scenario {
 public:
  explicit Scenario(unsigned long seed) : seed_(seed), chance_(seed) {}

  void statement(Words words);
  void finish();
  World& world() { return world_; }
  unsigned expectations() const { return expectations_; }

 private:
  void describe_line(Words& words);
  void describe_device(Words& words);
  void build();
  void act(Words& words);
  void expect(Words& words);
  void node_action(Words& words);
  void sdo_action(Words& words);
  void nmt_action(Words& words);
  void group_write(Words& words);
  void inject(Words& words);
  void set_losses(Words& words);
  std::function<bool()> condition(Words& words);
  std::function<bool()> event_condition(Words& words);
  std::function<bool()> reply_condition(Words& words);
  std::uint32_t output_entry(const std::string& text);
  std::optional<std::uint64_t> input_value(const std::string& text);
  void command(line::Command request, const std::string& name);
  void check_always_all();
  LineSeat& seat();

  unsigned long seed_;
  std::mt19937_64 chance_;
  World world_;
  std::vector<NetworkPlan> plans_;
  bool built_ = false;
  LineSeat* current_ = nullptr;
  std::size_t event_cursor_ = 0;
  std::map<std::string, std::uint64_t> tags_;
  std::map<LineSeat*, std::uint64_t> commands_;
  std::uint64_t next_tag_ = 1;
  unsigned expectations_ = 0;
};

constexpr Instant kStart{std::chrono::seconds(1)};

LineSeat& Scenario::seat() {
  if (current_ == nullptr) {
    throw BadStatement("there is no line yet");
  }
  return *current_;
}

void Scenario::statement(Words words) {
  if (words.done()) {
    return;
  }
  const std::string verb = words.take();
  if (verb == "line") {
    describe_line(words);
  } else if (verb == "device") {
    describe_device(words);
  } else if (verb == "on") {
    build();
    current_ = world_.find(words.take());
    (void)seat();
    event_cursor_ = 0;
  } else if (verb == "at") {
    build();
    world_.run(kStart + words.duration());
    event_cursor_ = seat().events.size();
    act(words);
  } else if (verb == "expect") {
    build();
    expect(words);
  } else {
    throw BadStatement("unknown statement '" + verb + "'");
  }
  if (!words.done()) {
    throw BadStatement("'" + words.peek() + "' is left over");
  }
  if (built_) {
    check_always_all();
  }
}

void Scenario::describe_line(Words& words) {
  NetworkPlan plan;
  plan.config.name = words.take();
  plan.config.heartbeat = std::chrono::milliseconds(500);
  while (!words.done()) {
    const std::string key = words.take();
    if (key == "bitrate") {
      plan.bus.bit_rate = static_cast<std::uint32_t>(words.number());
    } else if (key == "sync") {
      plan.config.sync_period = words.duration();
    } else if (key == "own") {
      plan.config.node_id = words.node();
    } else {
      throw BadStatement("unknown property of a line '" + key + "'");
    }
  }
  plan.config.bit_rate = plan.bus.bit_rate;
  plans_.push_back(std::move(plan));
}

void Scenario::describe_device(Words& words) {
  if (plans_.empty() || built_) {
    throw BadStatement("a device comes after its line and before the first 'at'");
  }
  sim::DeviceOptions device{.node_id = words.node()};
  device.profile = words.take();
  device.seed = seed_ * 128 + device.node_id;
  line::NodeConfig node{.id = device.node_id};
  node.name = device.profile + std::to_string(device.node_id);
  node.heartbeat = std::chrono::milliseconds(100);
  bool listed = true;
  bool present = true;
  while (!words.done()) {
    const std::string key = words.take();
    if (key == "heartbeat") {
      node.heartbeat = words.duration();
    } else if (key == "consumer") {
      node.heartbeat_consumer = words.duration();
    } else if (key == "mandatory") {
      node.mandatory = true;
    } else if (key == "serial") {
      node.serial = static_cast<std::uint32_t>(words.number());
    } else if (key == "boot-timeout") {
      node.boot_timeout = words.duration();
    } else if (key == "unlisted") {
      listed = false;
    } else if (key == "absent") {
      present = false;
    } else {
      throw BadStatement("unknown property of a device '" + key + "'");
    }
  }
  NetworkPlan& plan = plans_.back();
  if (listed) {
    const auto file = eds::load(sim::eds_text(device.profile), sim::eds_name(device.profile), node.id);
    if (!file.ok()) {
      throw BadStatement("no device profile '" + device.profile + "'");
    }
    node.device = *file.value;
    plan.config.nodes.push_back(std::move(node));
    std::ranges::sort(plan.config.nodes, {}, &line::NodeConfig::id);
  }
  if (present) {
    plan.devices.push_back(std::move(device));
  }
}

void Scenario::build() {
  if (std::exchange(built_, true)) {
    return;
  }
  for (NetworkPlan& plan : plans_) {
    auto made = line::Line::make(std::move(plan.config));
    if (!made.ok()) {
      throw BadStatement(to_string(made.diagnostics.front()));
    }
    LineSeat& seat = world_.add_line(*std::move(made.value), plan.bus);
    for (const sim::DeviceOptions& options : plan.devices) {
      auto device = sim::Device::make(options);
      if (!device.ok()) {
        throw BadStatement(to_string(device.diagnostics.front()));
      }
      world_.add_device(seat, *std::move(device.value));
    }
    current_ = current_ == nullptr ? &seat : current_;
  }
  world_.start();
}

void Scenario::act(Words& words) {
  if (words.done()) {
    return;
  }
  const std::string verb = words.take();
  if (verb == "node") {
    node_action(words);
  } else if (verb == "sdo") {
    sdo_action(words);
  } else if (verb == "nmt") {
    nmt_action(words);
  } else if (verb == "output") {
    line::Command request{.kind = line::CommandKind::output_write};
    const std::string name = words.peek();
    request.entry = output_entry(words.take());
    words.expect("=");
    request.data = words.hex();
    command(std::move(request), name);
  } else if (verb == "write") {
    group_write(words);
  } else if (verb == "frame") {
    inject(words);
  } else if (verb == "losses") {
    set_losses(words);
  } else if (verb == "stop") {
    seat().line->stop(world_.now());
  } else {
    throw BadStatement("unknown action '" + verb + "'");
  }
}

void Scenario::node_action(Words& words) {
  const std::uint8_t id = words.node();
  DeviceSeat* device = seat().find(id);
  if (device == nullptr) {
    throw BadStatement("there is no device " + std::to_string(id));
  }
  const std::string what = words.take();
  if (what == "dies") {
    device->device->kill();
  } else if (what == "returns") {
    if (!device->device->alive()) {
      device->device->revive(world_.now());
    }
  } else if (what == "unplugged") {
    seat().bus.set_connected(device->end, false);
  } else if (what == "plugged") {
    seat().bus.set_connected(device->end, true);
  } else {
    throw BadStatement("a node dies, returns, is unplugged or plugged; not '" + what + "'");
  }
}

void Scenario::command(line::Command request, const std::string& name) {
  request.tag = next_tag_++;
  tags_[name] = request.tag;
  ++commands_[&seat()];
  seat().line->execute(std::move(request), world_.now());
}

void Scenario::sdo_action(Words& words) {
  line::Command request;
  const bool write = words.accept("write");
  if (!write) {
    words.expect("read");
  }
  request.kind = write ? line::CommandKind::sdo_write : line::CommandKind::sdo_read;
  const std::string name = words.take();
  request.node = words.node();
  const od::Address address = words.address();
  request.index = address.index;
  request.sub = address.sub;
  if (write) {
    request.data = words.hex();
  }
  if (words.accept("timeout")) {
    request.timeout = words.duration();
  }
  command(std::move(request), name);
}

void Scenario::nmt_action(Words& words) {
  line::Command request{.kind = line::CommandKind::nmt};
  const std::string name = words.take();
  constexpr std::pair<std::string_view, nmt::Command> kCommands[] = {
      {"start", nmt::Command::start},
      {"stop", nmt::Command::stop},
      {"pre-operational", nmt::Command::enter_pre_operational},
      {"reset-node", nmt::Command::reset_node},
      {"reset-communication", nmt::Command::reset_communication},
  };
  const auto it = std::ranges::find(kCommands, name, [](const auto& c) { return c.first; });
  if (it == std::end(kCommands)) {
    throw BadStatement("unknown NMT command '" + name + "'");
  }
  request.nmt = it->second;
  request.node = words.node();
  command(std::move(request), "nmt");
}

// write GROUP arming N [watchdog T] [reactions BITS] NODE.INDEX:SUB=HEX ...
void Scenario::group_write(Words& words) {
  const image::Layout& layout = seat().line->layout(Direction::outputs);
  line::OutputWrite write;
  write.group = static_cast<std::uint16_t>(words.number());
  write.layout_id = layout.id;
  words.expect("arming");
  write.arming = words.number();
  if (words.accept("watchdog")) {
    write.watchdog = words.duration();
  }
  if (words.accept("reactions")) {
    write.reactions = static_cast<std::uint8_t>(words.number());
  }
  while (!words.done()) {
    const std::string name = words.take();
    words.expect("=");
    const std::vector<std::byte> data = words.hex();
    line::OutputValue value{.entry = output_entry(name),
                            .length = static_cast<std::uint8_t>(data.size())};
    std::copy_n(data.begin(), std::min(data.size(), value.data.size()), value.data.begin());
    write.values.push_back(value);
  }
  seat().line->write_outputs(write, world_.now());
}

// frame ID [HEX]: from a stranger on the bus.
void Scenario::inject(Words& words) {
  const auto id = static_cast<std::uint32_t>(words.number());
  const std::vector<std::byte> data = words.done() ? std::vector<std::byte>{} : words.hex();
  LineSeat& target = seat();
  target.bus.submit(target.witness_end, can::make_frame(id, std::span<const std::byte>(data)),
                    world_.now());
}

// losses N: so many of a thousand frames reach nobody, as many are destroyed and sent again.
void Scenario::set_losses(Words& words) {
  const std::uint64_t permille = words.number();
  seat().bus.set_disturbance([this, permille](const can::Frame&, sim::Bus::Endpoint) {
    const std::uint64_t dice = chance_() % 1000;
    if (dice < permille) {
      return sim::Fate::lost;
    }
    return dice < 2 * permille ? sim::Fate::disturbed : sim::Fate::delivered;
  });
}

// NODE.INDEX:SUB -> entry of the output layout.
std::uint32_t Scenario::output_entry(const std::string& text) {
  const std::size_t dot = text.find('.');
  const auto node = to_number(text.substr(0, dot));
  const od::Address address = to_address(text.substr(dot + 1));
  const image::Layout& layout = seat().line->layout(Direction::outputs);
  for (std::uint32_t i = 0; i < layout.entries.size(); ++i) {
    const image::Entry& entry = layout.entries[i];
    if (entry.node == node && od::Address{entry.index, entry.sub} == address) {
      return i;
    }
  }
  throw BadStatement("no output entry " + text);
}

// Nothing while the entry is not valid.
std::optional<std::uint64_t> Scenario::input_value(const std::string& text) {
  const std::size_t dot = text.find('.');
  const auto node = to_number(text.substr(0, dot));
  const od::Address address = to_address(text.substr(dot + 1));
  const image::Layout& layout = seat().line->layout(Direction::inputs);
  for (std::size_t i = 0; i < layout.entries.size(); ++i) {
    const image::Entry& entry = layout.entries[i];
    if (entry.node != node || od::Address{entry.index, entry.sub} != address) {
      continue;
    }
    image::Snapshot snapshot;
    seat().line->snapshot(Direction::inputs, snapshot, world_.now(), false);
    if (!snapshot.is_valid(i)) {
      return std::nullopt;
    }
    snapshot.bytes.resize(snapshot.bytes.size() + 8);
    const std::uint64_t word =
        load_le<std::uint64_t>(snapshot.bytes.data() + entry.bit_offset / 8) >>
        (entry.bit_offset % 8);
    return entry.bit_length >= 64 ? word : word & ((std::uint64_t{1} << entry.bit_length) - 1);
  }
  throw BadStatement("no input entry " + text);
}

void Scenario::expect(Words& words) {
  ++expectations_;
  const bool never = words.accept("no");
  const std::function<bool()> holds = condition(words);
  Instant until = world_.now();
  if (words.accept("within")) {
    until += words.duration();
  }
  bool held = holds();
  while (!held && world_.failure().empty() && world_.step(until)) {
    held = holds();
  }
  held = held || holds();
  if (held == never && world_.failure().empty()) {
    throw BadStatement(never ? "it happened" : "it did not happen");
  }
}

std::function<bool()> Scenario::condition(Words& words) {
  const std::string what = words.peek();
  if (words.accept("node")) {
    const std::uint8_t id = words.node();
    const std::string state = words.take();
    return [this, id, state] {
      const line::NodeState node = seat().line->node_state(id);
      return line::name(node.presence) == state || nmt::name(node.state) == state;
    };
  }
  if (words.accept("manager")) {
    return [this, state = words.take()] { return line::name(seat().line->state().manager) == state; };
  }
  if (words.accept("own")) {
    return [this, state = words.take()] { return nmt::name(seat().line->state().own_state) == state; };
  }
  if (words.accept("input")) {
    const std::string name = words.take();
    if (words.accept("invalid")) {
      return [this, name] { return !input_value(name).has_value(); };
    }
    if (words.accept("valid")) {
      return [this, name] { return input_value(name).has_value(); };
    }
    words.expect("=");
    return [this, name, value = words.number()] { return input_value(name) == value; };
  }
  if (words.accept("device")) {
    const std::uint8_t id = words.node();
    const od::Address address = words.address();
    words.expect("=");
    return [this, id, address, value = words.number()] {
      DeviceSeat* device = seat().find(id);
      return device != nullptr && device->device->dictionary().number(address) == value;
    };
  }
  if (words.accept("frame")) {
    const auto id = static_cast<std::uint32_t>(words.number());
    const bool any = words.peek() == "within" || words.done();
    const std::vector<std::byte> data = any ? std::vector<std::byte>{} : words.hex();
    return [this, id, any, data, from = seat().frames.size()] {
      return std::any_of(seat().frames.begin() + static_cast<long>(from), seat().frames.end(),
                         [&](const can::Frame& f) {
                           return f.id == id && (any || std::ranges::equal(f.bytes(), data));
                         });
    };
  }
  if (words.accept("reply")) {
    return reply_condition(words);
  }
  return event_condition(words);
}

// expect reply NAME ok [HEX] | abort CODE | refused
std::function<bool()> Scenario::reply_condition(Words& words) {
  const std::string name = words.take();
  const std::string how = words.take();
  const auto find = [this, name]() -> const line::Reply* {
    const auto it = seat().replies.find(tags_.at(name));
    return it == seat().replies.end() ? nullptr : &it->second;
  };
  if (how == "ok") {
    const bool any = words.peek() == "within" || words.done();
    const std::vector<std::byte> data = any ? std::vector<std::byte>{} : words.hex();
    return [find, any, data] {
      const line::Reply* reply = find();
      return reply != nullptr && reply->ok() && (any || reply->data == data);
    };
  }
  if (how == "abort" || how == "refused") {
    const Domain domain = how == "abort" ? Domain::sdo : Domain::command;
    return [find, domain, code = words.number()] {
      const line::Reply* reply = find();
      return reply != nullptr && reply->error == Error{domain, static_cast<std::uint32_t>(code)};
    };
  }
  if (how == "any") {
    return [find] { return find() != nullptr; };
  }
  throw BadStatement("a reply is ok, abort CODE, refused CODE or any");
}

// expect EVENT-NAME [node=N] [code=N] [value=N]
std::function<bool()> Scenario::event_condition(Words& words) {
  const std::string kind = words.take();
  std::optional<EventKind> wanted;
  for (std::size_t i = 0; i < kEventKinds; ++i) {
    if (name(static_cast<EventKind>(i)) == kind) {
      wanted = static_cast<EventKind>(i);
    }
  }
  if (!wanted) {
    throw BadStatement("unknown event '" + kind + "'");
  }
  std::optional<std::uint64_t> node;
  std::optional<std::uint64_t> code;
  std::optional<std::uint64_t> value;
  while (words.peek().find('=') != std::string::npos) {
    const std::string pair = words.take();
    const std::size_t equals = pair.find('=');
    const std::uint64_t number = to_number(pair.substr(equals + 1));
    const std::string key = pair.substr(0, equals);
    if (key == "node") {
      node = number;
    } else if (key == "code") {
      code = number;
    } else if (key == "value") {
      value = number;
    } else {
      throw BadStatement("an event has node, code and value, not '" + key + "'");
    }
  }
  return [this, wanted, node, code, value] {
    return std::any_of(seat().events.begin() + static_cast<long>(event_cursor_),
                       seat().events.end(), [&](const Event& event) {
                         return event.kind == *wanted && (!node || event.node == *node) &&
                                (!code || event.code == *code) && (!value || event.value == *value);
                       });
  };
}

void Scenario::check_always_all() {
  for (const auto& line : world_.lines()) {
    if (std::string text = check_always(*line, world_.now()); !text.empty()) {
      throw BadStatement("oracle: " + text);
    }
  }
}

// Whatever is under way may come to its end, then nothing may be left.
void Scenario::finish() {
  build();
  for (const auto& line : world_.lines()) {
    line->bus.set_disturbance({});
  }
  world_.run(world_.now() + std::chrono::seconds(5));
  check_always_all();
  for (const auto& line : world_.lines()) {
    if (std::string text = check_settled(*line, commands_[line.get()]); !text.empty()) {
      throw BadStatement("oracle: " + text);
    }
  }
}

}  // namespace

Outcome run_scenario(std::string_view name, std::string_view text, unsigned long seed) {
  Scenario scenario(seed);
  Outcome outcome;
  unsigned line = 0;
  try {
    while (!text.empty() && scenario.world().failure().empty()) {
      ++line;
      const std::size_t end = text.find('\n');
      const std::string_view statement = text.substr(0, end);
      text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
      scenario.statement(Words(statement));
    }
    scenario.finish();
    outcome.failure = scenario.world().failure();
  } catch (const BadStatement& problem) {
    outcome.failure = problem.what();
  }
  if (!outcome.failure.empty()) {
    outcome.failure = std::string(name) + ':' + std::to_string(line) + ": " + outcome.failure;
  }
  for (const auto& seat : scenario.world().lines()) {
    outcome.frames += seat->bus.frames();
  }
  outcome.expectations = scenario.expectations();
  return outcome;
}

}  // namespace linegate::plant

// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/diagnosis.h"

#include "stack/nmt/node_control.h"
#include "stack/od/objects.h"

namespace linegate::diagnosis {
namespace {

using manager::NodeState;
using manager::Presence;

constexpr od::Address kBootTime{od::objects::kBootTime, 0};
constexpr std::uint64_t kIsSlave = 1U << 0U;
constexpr std::uint64_t kIsMandatory = 1U << 3U;

// Time limit for a node to carry out an NMT command.
constexpr Duration kObedience = std::chrono::milliseconds(100);

// The boot process of the node ended because of its configuration.
bool ends_with_configuration(const Event& event) {
  const auto* const result = event.get<event::BootResult>();
  return result != nullptr && result->letter == manager::kConfigurationFailed;
}

bool booted(const NodeState& node) {
  constexpr char kKeptAlive = 'L';
  return node.boot == manager::kBooted || node.boot == kKeptAlive;
}

template <class Action>
void each_node(Action action) {
  for (std::uint8_t node = can::kMinNodeId; node <= can::kMaxNodeId; ++node) {
    action(node);
  }
}

// Whether this state change of the manager begins an initialisation of the network, or (after a
// fatal error) continues it.
bool begins(const event::ManagerState& change, bool fatal) {
  using manager::ManagerState;
  const bool rested = change.before == ManagerState::inactive ||
                      change.before == ManagerState::stopped ||
                      (fatal && change.before == ManagerState::halted);
  return change.state == ManagerState::resetting ||
         (rested && change.state != ManagerState::inactive &&
          change.state != ManagerState::stopped);
}

// Sets the node in the list of its state and clears it in the two other lists.
void list_state(NodeLists& lists, std::uint8_t node, nmt::State state) {
  lists.operational.set(node, state == nmt::State::operational);
  lists.stopped.set(node, state == nmt::State::stopped);
  lists.pre_operational.set(node, state == nmt::State::pre_operational);
}

}  // namespace

Diagnosis::Diagnosis(const Options& options, const od::Dictionary& dictionary, const Source& source)
    : options_(options), dictionary_(dictionary), source_(source) {
}

void Diagnosis::emitted(const Event& event) {
  latest_ = event.time;
  changed_ = true;
  communication_.note(event);
  node_status_.note(event);
  const auto* const change = event.get<event::ManagerState>();
  if (change != nullptr && begins(*change, state_.fatal())) {
    begin();
  }
  const bool of_node = event.node >= can::kMinNodeId && event.node <= can::kMaxNodeId;
  if (event.get<event::BootUp>() != nullptr && of_node) {
    expected_[event.node] = {};
    disobedient_.set(event.node, false);
    forget_refusal(event.node);
  }
  const NetworkFacts now = source_.network();
  if (now.manages) {
    const std::uint16_t news = global_events(event, {.own_node = options_.own_node,
                                                     .mandatory = of_node && mandatory(event.node),
                                                     .scanning = now.scanning});
    events_ |= news;
    if ((news & options_.fatal_events) == 0 || state_.fatal()) {
      return;
    }
    if (ends_with_configuration(event)) {
      note_refusal(event.node, event.time);
    } else {
      fail();
    }
  }
}

void Diagnosis::fail() {
  state_.fail();
  failed_ = true;
  changed_ = true;
  forget_refusals();
}

void Diagnosis::note_refusal(std::uint8_t node, Instant now) {
  fatal_from_[node] = earlier(fatal_from_[node], now + manager::kBootUpDelay);
  refusal_counts_ = earlier(refusal_counts_, fatal_from_[node]);
}

void Diagnosis::forget_refusal(std::uint8_t node) {
  if (std::exchange(fatal_from_[node], kNever) != kNever) {
    refusal_counts_ = *std::ranges::min_element(fatal_from_);
  }
}

void Diagnosis::forget_refusals() {
  fatal_from_.fill(kNever);
  refusal_counts_ = kNever;
}

void Diagnosis::look_at_refusals(Instant now) {
  if (now < refusal_counts_) {
    return;
  }
  forget_refusals();
  if (source_.network().manages) {
    fail();
  }
}

void Diagnosis::emergency(std::uint8_t node, const emcy::Message& message) {
  emcys_.note(node, message);
}

void Diagnosis::heard(std::uint8_t node, nmt::State state, Instant now) {
  latest_ = now;
  const Expectation& wanted = expected_[node];
  const bool known = wanted.state != nmt::State::unknown && now - wanted.since > kObedience;
  const bool disobeys = known && state != wanted.state;
  if (disobedient_.has(node) != disobeys) {
    disobedient_.set(node, disobeys);
    changed_ = true;
  }
}

void Diagnosis::commanded(nmt::Command command, std::uint8_t node) {
  const bool resets = nmt::is_reset(command);  // the node may be started after a reset
  changed_ = true;
  node_status_.commanded(command, node);
  each_node([&](std::uint8_t each) {
    if (node == 0 || node == each) {
      expected_[each] = {resets ? nmt::State::unknown : nmt::state_after(command), latest_};
      disobedient_.set(each, false);
    }
  });
  if (node != 0) {
    return;
  }
  if (resets) {
    begin();
  } else {
    state_.commanded(command, facts(lists()));
  }
}

bool Diagnosis::strayed(std::uint8_t node) const {
  return disobedient_.has(node) && expected_[node].state == nmt::State::operational &&
         assigned_to_master(node) && booted(source_.node_seen(node));
}

void Diagnosis::requested(std::uint8_t node) {
  events_ |= node == 0 ? kNetworkRequested : kNodeRequested;
}

void Diagnosis::begin() {
  state_.begin();
  failed_ = false;
  forget_refusals();
  events_ = 0;
  communication_.begin();
  began_ = latest_;
  boot_time_over_ = false;
  changed_ = true;
}

// A new value of 1F89h ends or prolongs the running boot time.
void Diagnosis::look_at_boot_time(Instant now) {
  const std::uint64_t milliseconds = dictionary_.number(kBootTime).value_or(0);
  boot_time_ends_ =
      milliseconds == 0
          ? kNever
          : began_ + std::chrono::milliseconds(static_cast<std::int64_t>(milliseconds));
  boot_time_over_ = boot_time_over_ || now >= boot_time_ends_;
}

void Diagnosis::update(Instant now) {
  latest_ = now;
  look_at_refusals(now);
  if (!changed_ && (boot_time_over_ || now < boot_time_ends_)) {
    return;
  }
  changed_ = false;
  look_at_boot_time(now);
  const NodeLists fresh = lists();
  if (fresh != last_lists_) {
    last_lists_ = fresh;
    events_ |= kListChanged;
  }
  const NetworkFacts network = source_.network();
  const NetworkFacts found = facts(fresh);
  const auto value = [&] { return state_.value(network.manages ? found : network); };
  const std::uint8_t before = value();
  state_.update(found);
  changed_ = value() != before;
}

// The state of a slave depends on its own NMT state alone.
std::uint8_t Diagnosis::network_state() const {
  const NetworkFacts network = source_.network();
  return state_.value(network.manages ? facts(lists()) : network);
}

bool Diagnosis::assigned_to_master(std::uint8_t node) const {
  const auto entry = dictionary_.number({od::objects::kSlaveAssignment, node});
  return entry ? (*entry & kIsSlave) != 0 : options_.assigned.has(node);
}

bool Diagnosis::mandatory(std::uint8_t node) const {
  const auto entry = dictionary_.number({od::objects::kSlaveAssignment, node});
  return entry ? (*entry & (kIsSlave | kIsMandatory)) == (kIsSlave | kIsMandatory)
               : options_.mandatory.has(node);
}

// Nodes whose heartbeat the own node monitors: those of the configuration, and those of 1016h.
NodeList Diagnosis::monitored() const {
  NodeList out = options_.assigned;
  const std::uint64_t entries =
      dictionary_.number({od::objects::kConsumerHeartbeatTime, 0}).value_or(0);
  for (unsigned sub = 1; sub <= entries; ++sub) {
    const auto entry =
        dictionary_.number({od::objects::kConsumerHeartbeatTime, static_cast<std::uint8_t>(sub)})
            .value_or(0);
    const auto node = static_cast<std::uint8_t>(entry >> 16U & 0xFFU);
    if ((entry & 0xFFFFU) != 0 && node >= can::kMinNodeId && node <= can::kMaxNodeId) {
      out.set(node);
    }
  }
  return out;
}

bool Diagnosis::wrong(std::uint8_t node, bool assigned) const {
  const NodeState& seen = source_.node_seen(node);
  if (!assigned) {
    return seen.presence == Presence::present;
  }
  return !booted(seen) || seen.presence == Presence::missing || disobedient_.has(node);
}

NodeLists Diagnosis::lists() const {
  NodeLists out;
  const NetworkFacts network = source_.network();
  if (!network.running) {
    return out;
  }
  const bool of_master = network.manages && network.manager != manager::ManagerState::inactive;
  const NodeList heard = of_master ? NodeList{} : monitored();
  each_node([&](std::uint8_t node) {
    if (node == options_.own_node) {
      list_state(out, node, network.own);
      return;
    }
    const NodeState& seen = source_.node_seen(node);
    out.assigned.set(node, of_master ? assigned_to_master(node) : heard.has(node));
    if (!of_master && !heard.has(node)) {
      return;
    }
    if (seen.presence == Presence::present) {
      list_state(out, node, seen.state);
    }
    out.configured.set(node, of_master && out.assigned.has(node) && booted(seen) &&
                                 seen.presence == Presence::present);
    out.fault.set(
        node, of_master ? wrong(node, out.assigned.has(node)) : seen.presence == Presence::missing);
    out.emergency.set(node, of_master && emcys_.erroneous(node));
  });
  return out;
}

bool Diagnosis::first_boot_runs() const {
  bool out = false;
  each_node([&](std::uint8_t node) {
    out = out ||
          (node != options_.own_node && source_.node_seen(node).boot == manager::kBootUnfinished &&
           assigned_to_master(node));
  });
  return out;
}

NetworkFacts Diagnosis::facts(const NodeLists& lists) const {
  NetworkFacts out = source_.network();
  out.boot_time_over = boot_time_over_;
  out.booting = first_boot_runs();
  each_node([&](std::uint8_t node) {
    if (node == options_.own_node) {
      return;
    }
    if (lists.fault.has(node)) {
      (mandatory(node) ? out.mandatory_wrong : out.optional_wrong) = true;
    }
    out.some_operational = out.some_operational || lists.operational.has(node);
  });
  return out;
}

}  // namespace linegate::diagnosis

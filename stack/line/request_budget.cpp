// SPDX-License-Identifier: Apache-2.0
#include "stack/line/request_budget.h"

#include <algorithm>
#include <bitset>
#include <iterator>
#include <limits>
#include <utility>
#include <variant>

#include "stack/base/assert.h"
#include "stack/can/cob_id.h"
#include "stack/can/frame.h"

namespace linegate::line {
namespace {

// Levels are in bits / kScale: an account is filled exactly, in steps of 1 ns at 1 bit/s.
constexpr std::int64_t kScale = 1'000'000'000;
constexpr std::uint8_t kFullFrame = 8;

// Frames of a procedure of the manager with one node, or of a scan of node-IDs.
constexpr std::int64_t kProcedureFrames = 64;
// Frames that an NMT command causes, with the boot-up messages after a reset.
constexpr std::int64_t kFramesOfOneNode = 2;
constexpr std::int64_t kFramesOfAllNodes = 32;
// A transfer through another network: a request and a response, with the node's abort.
constexpr std::int64_t kRoutedFrames = 4;

std::int64_t bits_of(std::int64_t frames) {
  return frames * bits_on_bus({.length = kFullFrame});
}

// Cost in bits that is known before the command is executed.
struct CostOf {
  std::int64_t operator()(const CanSend& send) const {
    return bits_on_bus({send.frame.id, send.frame.length, send.frame.flags});
  }
  std::int64_t operator()(const NmtRequest& nmt) const {
    return bits_of(nmt.node == 0 ? kFramesOfAllNodes : kFramesOfOneNode);
  }
  std::int64_t operator()(const EmcySend&) const { return bits_of(1); }
  std::int64_t operator()(const SingleOutput&) const { return bits_of(1); }
  std::int64_t operator()(const ObjectWrite&) const { return bits_of(1); }
  std::int64_t operator()(const PdoTrigger&) const { return bits_of(1); }
  std::int64_t operator()(const MpdoWrite&) const { return bits_of(1); }
  std::int64_t operator()(const PdoRequest&) const { return bits_of(2); }
  std::int64_t operator()(const NetworkRead&) const { return bits_of(kRoutedFrames); }
  std::int64_t operator()(const NetworkWrite& write) const {
    return bits_of(kRoutedFrames + 2 * static_cast<std::int64_t>(write.data.size() / 7));
  }
  std::int64_t operator()(const Boot&) const { return bits_of(kProcedureFrames); }
  std::int64_t operator()(const Configure&) const { return bits_of(kProcedureFrames); }
  std::int64_t operator()(const Scan&) const { return bits_of(kProcedureFrames); }
  std::int64_t operator()(const ScanApply&) const { return bits_of(kProcedureFrames); }
  std::int64_t operator()(const ProgramDownload&) const { return bits_of(kProcedureFrames); }
  std::int64_t operator()(const LssRequest&) const { return bits_of(kProcedureFrames); }
  // SDO transfers are counted frame by frame; the others send nothing.
  template <class Other>
  std::int64_t operator()(const Other& /*other*/) const {
    return 0;
  }
};

// The node whose SDO server serves the command; 0 = none.
std::uint8_t served_by(const Command& command) {
  switch (kind(command)) {
    case CommandKind::sdo_read:
    case CommandKind::sdo_write:
    case CommandKind::object_write: {
      const std::uint8_t node = node_of(command);
      return node <= can::kMaxNodeId ? node : std::uint8_t{0};
    }
    default:
      return 0;
  }
}

bool costs_nothing(const Command& command) {
  return served_by(command) == 0 && std::visit(CostOf{}, command.request) == 0;
}

}  // namespace

std::int64_t bits_on_bus(const can::Header& header) {
  constexpr std::int64_t kStandard = 47;  // start of frame to intermission, without data
  constexpr std::int64_t kExtended = 67;
  const bool extended = (header.flags & can::Frame::kExtended) != 0;
  const std::int64_t bits = (extended ? kExtended : kStandard) + 8 * std::int64_t{header.length};
  return bits * 11 / 10;  // stuff bits
}

// --- accounts ------------------------------------------------------------------------------------

void RequestBudget::Account::set(std::int64_t bits_a_second) {
  rate = bits_a_second;
  // At least one full frame: the burst of a slow bus would never permit one otherwise.
  burst = std::max(rate * kBurst.count(), bits_of(1) * kScale);
  level = std::min(level, burst);
}

void RequestBudget::Account::fill(Duration time) {
  const std::int64_t missing = burst - level;
  const bool full = time.count() >= missing / rate + 1;
  level = full ? burst : level + time.count() * rate;
}

void RequestBudget::Account::charge(std::int64_t bits) {
  level -= bits * kScale;
}

Duration RequestBudget::Account::wait() const {
  return permits() ? Duration::zero() : Duration(-level / rate + 1);
}

RequestBudget::RequestBudget(BudgetOptions options) : options_(options) {
  LINEGATE_ASSERT(options.share >= 1 && options.client_share >= 1, "clients have a share");
  const std::uint32_t rate = options_.bit_rate;
  options_.bit_rate = 0;
  set_bit_rate(rate != 0 ? rate : kAssumedBitRate);
  line_.level = line_.burst;
}

void RequestBudget::set_bit_rate(std::uint32_t bit_rate) {
  if (bit_rate == 0 || bit_rate == options_.bit_rate) {
    return;
  }
  options_.bit_rate = bit_rate;
  line_.set(std::int64_t{bit_rate} * options_.share / 1000);
  for (Client& client : clients_) {
    client.account.set(std::int64_t{bit_rate} * options_.client_share / 1000);
  }
}

void RequestBudget::advance(Instant now) {
  const Duration time = now - filled_;
  if (time <= Duration::zero()) {
    return;
  }
  filled_ = now;
  line_.fill(time);
  for (Client& client : known()) {
    client.account.fill(time);
  }
}

RequestBudget::Client* RequestBudget::find(std::uint32_t number) {
  const auto found = std::ranges::find(known(), number, &Client::number);
  return found == known().end() ? nullptr : &*found;
}

// A client that is idle gives its place to a new one: its account is full, like that of a new one.
RequestBudget::Client* RequestBudget::find_or_make(std::uint32_t number) {
  if (Client* const client = find(number)) {
    return client;
  }
  auto free = std::ranges::find_if(known(), &Client::is_idle);
  if (free == known().end()) {
    if (known_ == kClients) {
      return nullptr;
    }
    free = known().begin() + static_cast<std::ptrdiff_t>(known_++);
  }
  free->number = number;
  free->account.level = free->account.burst;
  free->counts = {};
  return &*free;
}

void RequestBudget::charge(Client& client, std::int64_t bits) {
  line_.charge(bits);
  client.account.charge(bits);
}

// --- commands ------------------------------------------------------------------------------------

RequestBudget::Put RequestBudget::put(Command& command, Instant now) {
  Client* const client = find_or_make(command.client);
  if (client == nullptr) {
    return Put::no_place;
  }
  if (client->queue.size() >= kQueued) {
    note(*client, &event::ClientLimited::refused, now);
    return Put::queue_full;
  }
  client->queue.push_back({.command = std::move(command), .since = now});
  ++waiting_;
  return Put::queued;
}

bool RequestBudget::may_run(const Client& client, const Command& command) const {
  const std::uint8_t node = served_by(command);
  return node == 0 || (client.running < kRunning && !nodes_[node].used);
}

// The clients take turns, each with one command.
bool RequestBudget::next(Admitted& out, Instant now) {
  if (waiting_ == 0) {
    return false;
  }
  for (std::size_t i = 0; i < known_; ++i) {
    Client& client = clients_[(turn_ + i) % known_];
    if (!client.queue.empty() && next_of(client, out, now)) {
      turn_ = (turn_ + i + 1) % known_;
      return true;
    }
  }
  return false;
}

// The order of the commands of a client to one node is kept: the first one for a node that is free
// precedes later ones for it. Commands that send nothing do not wait for the account, and those
// whose time-out has passed wait for nothing.
bool RequestBudget::next_of(Client& client, Admitted& out, Instant now) {
  const bool permitted = client.account.permits() && line_.permits();
  std::bitset<can::kMaxNodeId + 1> preceded;  // nodes of commands that keep waiting
  bool exhausted = false;                     // a command waits for the account
  for (auto it = client.queue.begin(); it != client.queue.end(); ++it) {
    if (it->is_late(now)) {
      take(client, it, out, now);
      return true;
    }
    if (exhausted) {
      continue;
    }
    if (!permitted && !costs_nothing(it->command)) {
      if (!std::exchange(it->delayed, true)) {
        note(client, &event::ClientLimited::delayed, now);
      }
      exhausted = true;
      continue;
    }
    const std::uint8_t node = std::min(node_of(it->command), can::kMaxNodeId);
    if (preceded[node] || !may_run(client, it->command)) {
      preceded[node] = node != 0;
      continue;
    }
    take(client, it, out, now);
    start(client, out.command);
    return true;
  }
  return false;
}

void RequestBudget::take(Client& client, std::deque<Waiting>::iterator from, Admitted& out,
                         Instant now) {
  out.late = from->is_late(now);
  const Duration waited = now - from->since;
  out.command = std::move(from->command);
  if (!out.late && out.command.timeout > Duration::zero()) {
    out.command.timeout -= waited;
  }
  client.queue.erase(from);
  --waiting_;
}

void RequestBudget::start(Client& client, const Command& command) {
  if (const std::int64_t bits = std::visit(CostOf{}, command.request); bits != 0) {
    charge(client, bits);
  }
  if (const std::uint8_t node = served_by(command); node != 0) {
    nodes_[node] = {.used = true,
                    .tag = command.tag,
                    .client = static_cast<std::uint8_t>(&client - clients_.data())};
    ++client.running;
    ++running_;
  }
}

void RequestBudget::answered(std::uint64_t tag) {
  if (running_ == 0) {
    return;
  }
  const auto found = std::ranges::find_if(
      nodes_, [tag](const Running& running) { return running.used && running.tag == tag; });
  if (found != nodes_.end()) {
    --clients_[found->client].running;
    --running_;
    *found = {};
  }
}

bool RequestBudget::remove(Command& out) {
  for (Client& client : known()) {
    if (!client.queue.empty()) {
      out = std::move(client.queue.front().command);
      client.queue.pop_front();
      --waiting_;
      return true;
    }
  }
  return false;
}

// --- outputs -------------------------------------------------------------------------------------

void RequestBudget::set_outputs(const image::Layout& layout,
                                const std::vector<bool>& event_driven) {
  LINEGATE_ASSERT(event_driven.size() == layout.entries.size(), "each entry has a flag");
  entries_.clear();
  std::uint16_t most = 0;
  for (std::size_t i = 0; i < layout.entries.size(); ++i) {
    const image::Entry& entry = layout.entries[i];
    const std::uint16_t pdo = event_driven[i] ? entry.local_pdo : std::uint16_t{0};
    entries_.push_back({entry.bit_offset, entry.bit_length, pdo});
    most = std::max(most, pdo);
  }
  counted_.assign(most + 1U, 0);
}

// Each event-driven PDO that carries one of the values counts once, even if no value changes.
std::int64_t RequestBudget::cost_of(const OutputWrite& write) {
  ++writes_;
  std::int64_t frames = 0;
  const auto add = [&](const OutputPlace& place) {
    if (place.pdo != 0 && std::exchange(counted_[place.pdo], writes_) != writes_) {
      ++frames;
    }
  };
  for (const OutputValue& value : write.values) {
    if (value.entry < entries_.size()) {
      add(entries_[value.entry]);
    }
  }
  for (const OutputBytes& run : write.bytes) {
    const std::uint64_t begin = std::uint64_t{run.offset} * 8U;
    const std::uint64_t end = begin + std::uint64_t{run.data.size()} * 8U;
    for (const OutputPlace& place : entries_) {
      if (place.bit_offset >= begin && place.bit_offset < end) {
        add(place);
      }
    }
  }
  return bits_of(frames);
}

RequestBudget::Admission RequestBudget::admits(const OutputWrite& write) {
  Client* const client = find_or_make(write.client_number);
  if (client == nullptr) {
    return Admission::no_place;
  }
  const bool precedes = std::ranges::any_of(
      outputs_, [&](const Kept& kept) { return kept.used && kept.write.group == write.group; });
  return precedes || !client->account.permits() || !line_.permits() ? Admission::later
                                                                    : Admission::now;
}

void RequestBudget::applied(const OutputWrite& write) {
  if (Client* const client = find(write.client_number)) {
    charge(*client, cost_of(write));
  }
}

void RequestBudget::hold(OutputWrite& write, Instant now) {
  auto kept = std::ranges::find_if(outputs_,
                                   [&](const Kept& one) { return one.write.group == write.group; });
  if (kept == outputs_.end()) {
    outputs_.emplace_back();
    kept = std::prev(outputs_.end());
  }
  if (kept->used) {
    Client* const before = find(kept->write.client_number);
    LINEGATE_ASSERT(before != nullptr && before->kept > 0, "a client with outputs has its place");
    --before->kept;
    note(*before, &event::ClientLimited::replaced, now);
    if (kept->write.arming == write.arming && kept->write.layout_id == write.layout_id) {
      add_earlier(write, kept->write, entries_);
    }
  } else {
    kept->used = true;
    ++kept_;
  }
  Client* const client = find(write.client_number);
  LINEGATE_ASSERT(client != nullptr, "admits() found or made its place");
  ++client->kept;
  std::swap(kept->write, write);
}

bool RequestBudget::next_output(OutputWrite& out) {
  for (std::size_t i = 0; kept_ != 0 && line_.permits() && i < outputs_.size(); ++i) {
    const std::size_t place = (output_turn_ + i) % outputs_.size();
    Kept& kept = outputs_[place];
    if (!kept.used) {
      continue;
    }
    Client* const client = find(kept.write.client_number);
    LINEGATE_ASSERT(client != nullptr && client->kept > 0, "a client with outputs has its place");
    if (!client->account.permits()) {
      continue;
    }
    charge(*client, cost_of(kept.write));
    --client->kept;
    out = kept.write;  // copied: the group of the place is needed to find it again
    kept.used = false;
    --kept_;
    output_turn_ = place + 1;
    return true;
  }
  return false;
}

// --- sdo::Pace -----------------------------------------------------------------------------------

bool RequestBudget::permits(std::uint8_t node) const {
  const Running& running = nodes_[node];
  return line_.permits() && (!running.used || clients_[running.client].account.permits());
}

void RequestBudget::count(std::uint8_t node) {
  const std::int64_t bits = bits_of(1);
  line_.charge(bits);
  if (nodes_[node].used) {
    clients_[nodes_[node].client].account.charge(bits);
  }
}

// --- time and reports ----------------------------------------------------------------------------

Instant RequestBudget::next_wake() const {
  Instant wake = kNever;
  if (waiting_ == 0 && kept_ == 0 && reports_ == 0) {
    return wake;
  }
  for (const Client& client : known()) {
    wake = earlier(wake, client.report_due);
    if (!client.queue.empty()) {
      wake = earlier(wake, wake_of(client.number));
    }
    for (const Waiting& waiting : client.queue) {
      if (waiting.command.timeout > Duration::zero()) {
        wake = earlier(wake, deadline(waiting.since, waiting.command.timeout));
      }
    }
  }
  if (kept_ != 0) {
    for (const Kept& kept : outputs_) {
      wake = kept.used ? earlier(wake, wake_of(kept.write.client_number)) : wake;
    }
  }
  return wake;
}

// When both accounts permit a request again. If they permit it now, what waits awaits an answer.
Instant RequestBudget::wake_of(std::uint32_t number) const {
  const auto client = std::ranges::find(known(), number, &Client::number);
  const Duration own = client == known().end() ? Duration::zero() : client->account.wait();
  const Duration wait = std::max(own, line_.wait());
  return wait == Duration::zero() ? kNever : filled_ + wait;
}

void RequestBudget::note(Client& client, std::uint32_t event::ClientLimited::*count, Instant now) {
  std::uint32_t& counted = client.counts.*count;
  counted += counted != std::numeric_limits<std::uint32_t>::max() ? 1U : 0U;
  if (client.report_due == kNever) {
    client.report_due = now + kFirstReport;
    ++reports_;
  }
}

std::optional<event::ClientLimited> RequestBudget::take_report(Instant now) {
  if (reports_ == 0) {
    return std::nullopt;
  }
  for (Client& client : known()) {
    if (client.report_due > now) {
      continue;
    }
    event::ClientLimited out = std::exchange(client.counts, {});
    out.client = client.number;
    if (out == event::ClientLimited{.client = client.number}) {
      --reports_;
      client.report_due = kNever;  // the client keeps within its share again
      continue;
    }
    client.report_due = now + kNextReport;
    return out;
  }
  return std::nullopt;
}

}  // namespace linegate::line

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
#include "stack/sdo/outbox.h"

namespace linegate::line {
namespace {

// Levels are in bits / kScale: an account is filled exactly, in steps of 1 ns at 1 bit/s.
constexpr std::int64_t kScale = 1'000'000'000;

// The part of the share that is divided equally, in quarters: the rest lets the line recover from
// requests of several clients at once.
constexpr std::int64_t kCreditQuarters = 3;
// How long after the last frame of a transfer or procedure others of it are expected.
constexpr Duration kInProgress = std::chrono::seconds(1);
// A transfer through another network: a request and a response, with the node's abort.
constexpr std::int64_t kRoutedFrames = 4;

// The release of an SDO connection: four downloads.
constexpr std::int64_t kReleaseFrames = 8;

// Cost in bits that is known before the command is executed.
struct CostOf {
  BitRates rates;
  std::int64_t full;  // bits of a frame of the greatest length on the line
  bool emcy_fd = false;

  std::int64_t bits_of(std::int64_t frames) const { return frames * full; }
  std::int64_t classical(std::int64_t frames) const {
    return frames * bits_on_bus({.length = can::kMaxClassicData}, rates);
  }
  std::int64_t operator()(const CanSend& send) const {
    return bits_on_bus({send.frame.id, send.frame.length, send.frame.flags}, rates);
  }
  // The frames of the boot processes that follow a reset are counted one by one.
  // Classical frames on a line of CANopen FD, too.
  std::int64_t operator()(const NmtRequest&) const { return classical(1); }
  std::int64_t operator()(const EmcySend&) const {
    constexpr can::Header kFdEmcy{.length = 20,
                                  .flags = can::Frame::kFd | can::Frame::kBitRateSwitch};
    return emcy_fd ? bits_on_bus(kFdEmcy, rates) : classical(1);
  }
  std::int64_t operator()(const SleepRequest&) const { return classical(2); }
  std::int64_t operator()(const SingleOutput&) const { return bits_of(1); }
  std::int64_t operator()(const ObjectWrite&) const { return bits_of(1); }
  std::int64_t operator()(const PdoTrigger&) const { return bits_of(1); }
  std::int64_t operator()(const MpdoWrite&) const { return bits_of(1); }
  // An object may be mapped into an event-driven PDO, or order a frame. A procedure that it orders
  // is counted frame by frame.
  std::int64_t operator()(const LocalWrite&) const { return bits_of(1); }
  std::int64_t operator()(const PdoRequest&) const { return bits_of(2); }
  std::int64_t operator()(const NetworkRead&) const { return bits_of(kRoutedFrames); }
  std::int64_t operator()(const NetworkWrite& write) const {
    return bits_of(kRoutedFrames + 2 * static_cast<std::int64_t>(write.data.size() / 7));
  }
  // Procedures are counted frame by frame. One more frame for each command limits the number of
  // those that are refused.
  std::int64_t operator()(const Boot&) const { return bits_of(1); }
  std::int64_t operator()(const Configure&) const { return bits_of(1); }
  std::int64_t operator()(const Scan&) const { return bits_of(1); }
  std::int64_t operator()(const ScanApply&) const { return bits_of(1); }
  std::int64_t operator()(const ProgramDownload&) const { return bits_of(1); }
  std::int64_t operator()(const LssRequest&) const { return bits_of(1); }
  std::int64_t operator()(const ConnectionOpen&) const { return bits_of(1); }
  std::int64_t operator()(const ConnectionClose&) const { return bits_of(kReleaseFrames); }
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

// Whether the frames of the command, which are counted later, precede new commands of its client
// already before the first one: any number of such commands is begun, and would use up the account.
bool precedes_new_ones(CommandKind kind) {
  return kind == CommandKind::network_read || kind == CommandKind::network_write ||
         kind == CommandKind::connection_open || kind == CommandKind::connection_close;
}

bool costs_nothing(const Command& command) {
  return served_by(command) == 0 &&
         std::visit(CostOf{.rates = {}, .full = 1}, command.request) == 0;
}

}  // namespace

// --- accounts ------------------------------------------------------------------------------------

void RequestBudget::Account::set(std::int64_t bits_a_second, Duration burst_time,
                                 std::int64_t full_frame) {
  rate = bits_a_second;
  // The burst of a slow bus would never permit a frame otherwise.
  burst = std::max(rate * burst_time.count(), full_frame * kScale);
  level = std::min(level, burst);
}

[[gnu::hot]] void RequestBudget::Account::fill(Duration time) {
  const std::int64_t missing = burst - level;
  const bool full = time.count() >= missing / rate + 1;
  level = full ? burst : level + time.count() * rate;
}

void RequestBudget::Account::charge(std::int64_t bits) {
  level -= bits * kScale;
}

Duration RequestBudget::Account::wait(std::int64_t reserved) const {
  return permits(reserved) ? Duration::zero() : Duration((reserved - level) / rate + 1);
}

RequestBudget::RequestBudget(BudgetOptions options) : options_(options) {
  LINEGATE_ASSERT(options.share >= 1 && options.client_share >= 1, "clients have a share");
  BitRates rates = std::exchange(options_.bit_rates, {});
  rates.nominal = rates.nominal != 0 ? rates.nominal : kAssumedBitRate;
  set_bit_rates(rates);
  line_.level = line_.burst;
}

void RequestBudget::set_bit_rates(BitRates rates) {
  if (rates.nominal == 0 || rates == options_.bit_rates) {
    return;
  }
  options_.bit_rates = rates;
  const std::int64_t full = bits_of(1);
  line_.set(std::int64_t{rates.nominal} * options_.share / 1000, kBurst, full);
  for (Client& client : clients_) {
    client.account.set(std::int64_t{rates.nominal} * options_.client_share / 1000, kClientBurst,
                       full);
    client.credit.burst = bits_of(kCredit) * kScale;
  }
  share_credit();
}

can::Header RequestBudget::full_frame() const {
  if (!options_.canopen_fd) {
    return {.length = can::kMaxClassicData};
  }
  return {.length = can::kMaxFdData, .flags = can::Frame::kFd | can::Frame::kBitRateSwitch};
}

std::int64_t RequestBudget::bits_of(std::int64_t frames) const {
  return frames * bits_on_bus(full_frame(), options_.bit_rates);
}

// Divides the credit among the clients that use it.
void RequestBudget::share_credit() {
  const auto parts = static_cast<std::int64_t>(std::max<std::size_t>(sharing_, 1));
  for (Client& client : clients_) {
    client.credit.rate = std::max<std::int64_t>(line_.rate * kCreditQuarters / 4 / parts, 1);
  }
}

[[gnu::hot]] void RequestBudget::advance(Instant now) {
  const Duration time = now - filled_;
  if (time <= Duration::zero()) {
    return;
  }
  filled_ = now;
  if (line_.is_full() && all_full_ && sharing_ == 0) {
    return;
  }
  line_.fill(time);
  all_full_ = true;
  std::size_t sharing = 0;
  for (Client& client : known()) {
    client.account.fill(time);
    client.credit.fill(time);
    compare_credit(client);
    all_full_ = all_full_ && client.account.is_full() && client.credit.is_full();
    sharing += client.is_idle() ? 0U : 1U;
  }
  if (std::exchange(sharing_, sharing) != sharing) {
    share_credit();
  }
}

RequestBudget::Client* RequestBudget::find(std::uint32_t number) {
  const auto found = std::ranges::find(known(), number, &Client::number);
  return found == known().end() ? nullptr : &*found;
}

const RequestBudget::Client* RequestBudget::find(std::uint32_t number) const {
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
  free->credit.level = free->credit.burst;
  free->has_credit = true;
  free->counted = {};
  free->counts = {};
  return &*free;
}

void RequestBudget::charge(Client& client, std::int64_t bits) {
  charge(client, bits, bits);
}

// A client that has used up its credit does not owe any: it is one of many without.
void RequestBudget::charge(Client& client, std::int64_t bits, std::int64_t of_line) {
  line_.charge(of_line);
  client.account.charge(bits);
  client.credit.charge(bits);
  client.credit.level = std::max(client.credit.level, -client.credit.burst);
  compare_credit(client);
  all_full_ = all_full_ && bits == 0;
}

// A client with credit may be admitted behind one without, see may_run(). So the search is repeated
// for a client that has credit again, and, if one with a command in progress has none any more, for
// those that have.
void RequestBudget::compare_credit(Client& client) {
  const bool has = client.credit.level >= client.credit.burst / 2;
  if (std::exchange(client.has_credit, has) == has) {
    return;
  }
  for (Client& other : known()) {
    const bool concerned = has ? &other == &client : client.running != 0 && other.has_credit;
    if (concerned && other.searched == Searched::occupied) {
      other.searched = Searched::no;
      next_due_ = true;
    }
  }
}

// Proportional to the missing credit: many clients that have just got a little of it at the same
// time leave the rest to those with more.
std::int64_t RequestBudget::reserved_before(const Client& client) const {
  const std::int64_t missing = client.credit.burst - std::max(client.credit.level, std::int64_t{0});
  return line_.burst / 2 / (client.credit.burst / kScale) * (missing / kScale);
}

bool RequestBudget::is_permitted(const Client& client) const {
  return client.account.permits() && line_.permits(reserved_before(client));
}

// A new request leaves a part of the account to what is in progress.
bool RequestBudget::may_begin(const Client& client) const {
  const bool in_progress = client.counted != Instant{} && filled_ - client.counted < kInProgress;
  return client.account.permits(in_progress ? client.account.burst / 4 : 0) &&
         line_.permits(reserved_before(client));
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
  client->late_at = earlier(client->late_at, client->queue.back().late_at());
  client->searched = Searched::no;
  ++waiting_;
  return Put::queued;
}

bool RequestBudget::may_run(const Client& client, const Command& command) const {
  const std::uint8_t node = served_by(command);
  if (node == 0 || client.running >= kRunning) {
    return node == 0;
  }
  const auto& [current, behind] = nodes_[node];
  if (!current.used) {
    return true;
  }
  // The SDO arbiter sees that it waits, and lets the transfer in progress end earlier.
  const Client& other = clients_[current.client];
  return !behind.used && &other != &client && client.has_credit && !other.has_credit;
}

// Whether next_of() may find a command.
bool RequestBudget::may_be_served(const Client& client, Instant now) const {
  if (client.queue.empty()) {
    return false;
  }
  return client.late_at <= now || client.searched == Searched::no ||
         (client.searched == Searched::exhausted && may_begin(client));
}

// The client with the most credit is first; those with the same take turns, each with one command.
[[gnu::hot]] bool RequestBudget::next(Admitted& out, Instant now) {
  if (waiting_ == 0) {
    return false;
  }
  std::array<std::uint8_t, kClients> places{};
  std::size_t count = 0;
  for (std::size_t i = 0; i < known_; ++i) {
    const std::size_t place = (turn_ + i) % known_;
    if (!may_be_served(clients_[place], now)) {
      continue;
    }
    std::size_t to = count++;
    for (; to > 0 && clients_[places[to - 1]].credit.level < clients_[place].credit.level; --to) {
      places[to] = places[to - 1];
    }
    places[to] = static_cast<std::uint8_t>(place);
  }
  for (const std::uint8_t place : std::span(places).first(count)) {
    if (next_of(clients_[place], out, now)) {
      turn_ = (place + 1U) % known_;
      return true;
    }
  }
  return false;
}

// The order of the commands of a client to one node is kept: the first one for a node that is free
// precedes later ones for it. Commands that send nothing do not wait for the account, and those
// whose time-out has passed wait for nothing.
bool RequestBudget::next_of(Client& client, Admitted& out, Instant now) {
  const bool permitted = may_begin(client);
  std::bitset<can::kMaxNodeId + 1> preceded;  // nodes of commands that keep waiting
  bool exhausted = false;                     // a command waits for the account
  for (auto it = client.queue.begin(); it != client.queue.end(); ++it) {
    if (it->late_at() <= now) {
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
      if (now < client.late_at) {
        break;
      }
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
  client.searched = exhausted ? Searched::exhausted : Searched::occupied;
  return false;
}

void RequestBudget::take(Client& client, std::deque<Waiting>::iterator from, Admitted& out,
                         Instant now) {
  const Instant late_at = from->late_at();
  out.late = late_at <= now;
  const Duration waited = now - from->since;
  out.command = std::move(from->command);
  if (!out.late && out.command.timeout > Duration::zero()) {
    out.command.timeout -= waited;
  }
  client.queue.erase(from);
  client.searched = Searched::no;
  --waiting_;
  if (late_at == client.late_at && late_at != kNever) {
    client.late_at = kNever;
    for (const Waiting& waiting : client.queue) {
      client.late_at = earlier(client.late_at, waiting.late_at());
    }
  }
}

void RequestBudget::start(Client& client, const Command& command) {
  const CostOf cost{.rates = options_.bit_rates, .full = bits_of(1), .emcy_fd = options_.emcy_fd};
  if (const std::int64_t bits = std::visit(cost, command.request); bits != 0) {
    // The segments of a long value to another network are sent there, one after the other: they
    // must not keep the other clients of this line waiting.
    const bool routed = kind(command) == CommandKind::network_write;
    charge(client, bits, routed ? std::min(bits, bits_of(kRoutedFrames)) : bits);
  }
  if (precedes_new_ones(kind(command))) {
    client.counted = filled_;
  }
  if (const std::uint8_t node = served_by(command); node != 0) {
    auto& [current, behind] = nodes_[node];
    (current.used ? behind : current) = {
        .used = true,
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
  for (auto& of_node : nodes_) {
    const auto found = std::ranges::find_if(
        of_node, [tag](const Running& running) { return running.used && running.tag == tag; });
    if (found == of_node.end()) {
      continue;
    }
    --clients_[found->client].running;
    --running_;
    *found = {};
    if (!of_node[0].used) {
      std::swap(of_node[0], of_node[1]);
    }
    for (Client& client : known()) {
      client.searched = Searched::no;  // a command may have waited for this one
    }
    return;
  }
}

bool RequestBudget::remove(Command& out) {
  for (Client& client : known()) {
    if (!client.queue.empty()) {
      out = std::move(client.queue.front().command);
      client.queue.pop_front();
      client.searched = Searched::no;
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
  pdos_.clear();
  for (std::size_t i = 0; i < layout.entries.size(); ++i) {
    const image::Entry& entry = layout.entries[i];
    const std::uint16_t pdo = event_driven[i] ? entry.local_pdo : std::uint16_t{0};
    entries_.push_back({entry.bit_offset, entry.bit_length, pdo});
    pdos_.resize(std::max<std::size_t>(pdos_.size(), pdo + 1U));
    pdos_[pdo].bits += entry.bit_length;
  }
}

// Each event-driven PDO that carries one of the values counts once, even if no value changes.
std::int64_t RequestBudget::cost_of(const OutputWrite& write) {
  ++writes_;
  std::int64_t bits = 0;
  const auto add = [&](const OutputPlace& place) {
    if (place.pdo == 0 || std::exchange(pdos_[place.pdo].counted, writes_) == writes_) {
      return;
    }
    can::Header frame = full_frame();
    if (options_.canopen_fd) {
      const std::uint32_t bytes = (pdos_[place.pdo].bits + 7) / 8;
      frame.length = static_cast<std::uint8_t>(std::min<std::uint32_t>(bytes, can::kMaxFdData));
    }
    bits += bits_on_bus(frame, options_.bit_rates);
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
  return bits;
}

RequestBudget::Admission RequestBudget::admits(const OutputWrite& write) {
  Client* const client = find_or_make(write.client_number);
  if (client == nullptr) {
    return Admission::no_place;
  }
  const bool precedes = std::ranges::any_of(
      outputs_, [&](const Kept& kept) { return kept.used && kept.write.group == write.group; });
  return precedes || !may_begin(*client) ? Admission::later : Admission::now;
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

[[gnu::hot]] bool RequestBudget::next_output(OutputWrite& out) {
  for (std::size_t i = 0; kept_ != 0 && i < outputs_.size(); ++i) {
    const std::size_t place = (output_turn_ + i) % outputs_.size();
    Kept& kept = outputs_[place];
    if (!kept.used) {
      continue;
    }
    Client* const client = find(kept.write.client_number);
    LINEGATE_ASSERT(client != nullptr && client->kept > 0, "a client with outputs has its place");
    if (!may_begin(*client)) {
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

// A client without a place is like a new one. At the bound its frames count for the line alone.
bool RequestBudget::permits(std::uint32_t number, bool awaited) const {
  const Client* const client = find(number);
  if (client == nullptr || awaited) {
    return line_.permits() &&
           (client == nullptr || client->account.permits(-client->account.burst));
  }
  return is_permitted(*client);
}

void RequestBudget::count(std::uint32_t number, const can::Header& frame) {
  const std::int64_t bits = bits_on_bus(frame, options_.bit_rates);
  if (Client* const client = find_or_make(number)) {
    client->counted = filled_;
    charge(*client, bits);
  } else {
    line_.charge(bits);
  }
}

// --- time and reports ----------------------------------------------------------------------------

[[gnu::hot]] Instant RequestBudget::next_wake() const {
  Instant wake = kNever;
  if (waiting_ == 0 && kept_ == 0 && reports_ == 0) {
    return wake;
  }
  for (const Client& client : known()) {
    wake = earlier(wake, client.report_due);
    if (!client.queue.empty()) {
      wake = earlier(wake, earlier(wake_of(&client), client.late_at));
      if (client.searched == Searched::occupied && !client.has_credit) {
        wake = earlier(wake, filled_ + client.credit.wait(client.credit.burst / 2));
      }
    }
  }
  if (kept_ != 0) {
    for (const Kept& kept : outputs_) {
      wake = kept.used ? earlier(wake, wake_of(find(kept.write.client_number))) : wake;
    }
  }
  return wake;
}

// When both accounts permit a request again. If they permit it now, what waits awaits an answer.
Instant RequestBudget::wake_of(const Client* client) const {
  if (client == nullptr) {
    return line_.permits() ? kNever : filled_ + line_.wait();
  }
  if (may_begin(*client)) {
    return kNever;
  }
  // With more credit less is reserved, and new requests may begin when nothing is in progress.
  return filled_ + std::max(client->account.wait(), sdo::Outbox::kRetry);
}

void RequestBudget::note(Client& client, std::uint32_t event::ClientLimited::*count, Instant now) {
  std::uint32_t& counted = client.counts.*count;
  counted += counted != std::numeric_limits<std::uint32_t>::max() ? 1U : 0U;
  if (client.report_due == kNever) {
    client.report_due = now + kFirstReport;
    ++reports_;
  }
}

[[gnu::hot]] std::optional<event::ClientLimited> RequestBudget::pop_report(Instant now) {
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

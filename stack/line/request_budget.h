// SPDX-License-Identifier: Apache-2.0
// The share of the bus that clients may use: an account in bit times for the line and for each
// client, and the commands and outputs that wait for it.
//
// Invariant: in each interval of t seconds, frames that clients cause occupy at most
// share x (t + kBurst) of the bus, and those of one client at most client_share x (t +
// kClientBurst), plus the cost of one request and the responses under way. So lower priorities on
// the bus, heartbeats among them, always get the rest. Frames that the line sends on its own (boot
// at start, recovery, SYNC, PDOs of its own) are neither counted nor delayed.
//
// The cost of a request is the number of bits of its frames: known in advance for frames that the
// request names, and counted frame by frame for SDO transfers and for the procedures that a command
// starts (boot, configure, scan, program, LSS; and the boot processes that follow an NMT reset),
// see sdo::Pace, also of those that a write to the own dictionary orders (1F25h, 1F82h, the
// CANopenIA records).
//
// An account is filled up to its burst and may be overdrawn by one request; it is not overdrawn
// further. Frames of transfers and procedures in progress precede new requests of their client, so
// that it cannot hold a node by starving its own transfer. A transfer for whose end another client
// waits may overdraw the account by another burst.
//
// A client has one SDO command at a node at a time, and each node has one of all clients, so
// another client waits for one transfer at most.
//
// Fairness: each client has a credit of kCredit, which is filled with an equal part of three
// quarters of the share, among the clients that use it. The client with the most credit is served
// first. The lower half of the line's burst is reserved: a client may use as much of it as its
// credit is full. So a client that uses less than its part is never delayed by the account of the
// line, whatever the others do; no division of a finite share can give more clients more than that.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "stack/base/events.h"
#include "stack/base/time.h"
#include "stack/image/layout.h"
#include "stack/line/command.h"
#include "stack/line/frame_bits.h"
#include "stack/line/output_merge.h"
#include "stack/line/output_write.h"
#include "stack/sdo/pace.h"

namespace linegate::line {

struct BudgetOptions {
  BitRates bit_rates{};              // nominal 0 = unknown: kAssumedBitRate
  bool canopen_fd = false;           // requests are FD frames of up to 64 bytes
  bool emcy_fd = false;              // EMCYs are FD frames of 20 bytes
  std::uint16_t share = 300;         // of the bit rate, for all clients, in thousandths
  std::uint16_t client_share = 150;  // of the bit rate, for each client, in thousandths
};

class RequestBudget final : public sdo::Pace {
 public:
  static constexpr std::uint32_t kAssumedBitRate = 1'000'000;
  static constexpr std::size_t kClients = 64;  // with requests or an overdrawn account
  static constexpr std::size_t kQueued = 256;  // waiting commands of a client
  static constexpr std::size_t kRunning = 16;  // SDO commands of a client in progress
  static constexpr Duration kBurst = std::chrono::milliseconds(50);  // of the line
  // Of a client. A flood begins with it, and delays the frames of another client by as much: at 15
  // % by less than an expedited transfer takes on a slow bus.
  static constexpr Duration kClientBurst = std::chrono::milliseconds(25);
  // Frames of the greatest length on the line: two expedited SDO transfers.
  static constexpr std::int64_t kCredit = 4;
  // A client that exceeds its share is reported after kFirstReport, then each kNextReport.
  static constexpr Duration kFirstReport = std::chrono::seconds(1);
  static constexpr Duration kNextReport = std::chrono::seconds(10);

  explicit RequestBudget(BudgetOptions options);

  // From now on; a nominal bit rate of 0 has no effect.
  void set_bit_rates(BitRates rates);
  // The layout of the outputs, and whether each of its entries is sent with an event-driven PDO:
  // the rate of others does not depend on clients.
  void set_outputs(const image::Layout& layout, const std::vector<bool>& event_driven);
  // Fills the accounts. Call it before any other function, with a time that never decreases.
  void advance(Instant now);

  // --- commands ----------------------------------------------------------------------------------

  // Queues the command, unless it is to be refused as busy.
  enum class Put : std::uint8_t {
    queued,
    queue_full,  // that of its client; counted
    no_place,    // there are kClients other clients
  };
  Put put(Command& command, Instant now);
  // The next command that may be executed now; false if there is none. A command that waited longer
  // than its time-out is `late`: it is to be refused as timed out.
  struct Admitted {
    Command command;
    bool late = false;
  };
  bool next(Admitted& out, Instant now);
  // Returns once that the credits of clients changed so that next() may return a command that
  // waited for a node: call it, whatever next_wake() was before.
  bool pop_next_due() { return std::exchange(next_due_, false); }
  // The command with this tag, which next() returned, was answered. No effect for other tags.
  void answered(std::uint64_t tag);
  // Removes any waiting command, to be cancelled; false if there is none.
  bool remove(Command& out);

  // --- outputs -----------------------------------------------------------------------------------

  // Whether a write may be applied now: then call applied() when it was, or hold() it, or it is to
  // be refused as busy, because there are kClients other clients.
  enum class Admission : std::uint8_t { now, later, no_place };
  Admission admits(const OutputWrite& write);
  void applied(const OutputWrite& write);
  // Keeps a valid write until next_output() returns it. A write of the same group that is kept is
  // joined with it if both have the same arming number and layout, or else replaced: values from
  // before an interruption are never applied after it. It is counted. Precondition: admits()
  // returned `later`.
  void hold(OutputWrite& write, Instant now);
  // The next kept write that may be applied now, which is charged; false if there is none.
  bool next_output(OutputWrite& out);

  // --- sdo::Pace ---------------------------------------------------------------------------------

  bool permits(std::uint32_t client, bool awaited) const override;
  using sdo::Pace::count;
  void count(std::uint32_t client, const can::Header& frame) override;

  // Whether frames may be counted, which needs advance() before: a client is known, so a transfer
  // or procedure of it may be in progress.
  bool is_in_use() const { return known_ != 0; }
  // Commands that wait, see remove().
  std::size_t waiting() const { return waiting_; }
  // When to call advance(), next() and next_output() again; kNever: after the next input.
  Instant next_wake() const;
  // A report that is due; nothing if there is none.
  std::optional<event::ClientLimited> pop_report(Instant now);
  // Clients that have an account.
  std::size_t clients() const { return known_; }

 private:
  // level and burst in bits / 10^9, so that an account is filled exactly.
  struct Account {
    std::int64_t level = 0;
    std::int64_t burst = 0;
    std::int64_t rate = 0;  // bit/s

    // full_frame: in bits; the burst is at least one.
    void set(std::int64_t bits_a_second, Duration burst_time, std::int64_t full_frame);
    void fill(Duration time);
    void charge(std::int64_t bits);
    bool is_full() const { return level == burst; }
    // Whether more than `reserved` is left, and the time until then.
    bool permits(std::int64_t reserved = 0) const { return level > reserved; }
    Duration wait(std::int64_t reserved = 0) const;
  };
  struct Waiting {
    Command command;
    Instant since{};
    bool delayed = false;  // counted

    Instant late_at() const {
      return command.timeout > Duration::zero() ? deadline(since, command.timeout) : kNever;
    }
  };
  // What the last search for a command that may be executed found: none, while the account did not
  // permit any or because of commands in progress. It is not repeated until that changes, or the
  // credits are compared differently.
  enum class Searched : std::uint8_t { no, exhausted, occupied };
  struct Client {
    std::uint32_t number = 0;
    Account account;
    Account credit;
    std::deque<Waiting> queue;
    Instant late_at = kNever;  // the earliest of the queue
    Searched searched = Searched::no;
    Instant counted{};        // the last frame of a transfer or procedure
    std::size_t running = 0;  // SDO commands
    std::size_t kept = 0;     // outputs
    event::ClientLimited counts{};
    Instant report_due = kNever;
    bool has_credit = true;  // at least half of it, see compare_credit()

    bool is_idle() const {
      return queue.empty() && running == 0 && kept == 0 && account.is_full() && credit.is_full() &&
             report_due == kNever;
    }
  };
  // An SDO command in progress at a node.
  struct Running {
    bool used = false;
    std::uint64_t tag = 0;
    std::uint8_t client = 0;  // place
  };
  struct Kept {
    OutputWrite write;
    bool used = false;
  };

  // A service without requests reads none of the places, most of which are never used.
  std::span<Client> known() { return {clients_.data(), known_}; }
  std::span<const Client> known() const { return {clients_.data(), known_}; }
  Client* find(std::uint32_t number);
  const Client* find(std::uint32_t number) const;
  Client* find_or_make(std::uint32_t number);
  std::int64_t reserved_before(const Client& client) const;
  bool is_permitted(const Client& client) const;
  bool may_begin(const Client& client) const;
  bool may_be_served(const Client& client, Instant now) const;
  void share_credit();
  void compare_credit(Client& client);
  bool may_run(const Client& client, const Command& command) const;
  bool next_of(Client& client, Admitted& out, Instant now);
  void take(Client& client, std::deque<Waiting>::iterator from, Admitted& out, Instant now);
  void start(Client& client, const Command& command);
  can::Header full_frame() const;
  std::int64_t bits_of(std::int64_t frames) const;
  std::int64_t cost_of(const OutputWrite& write);
  Instant wake_of(const Client* client) const;
  void charge(Client& client, std::int64_t bits);
  void charge(Client& client, std::int64_t bits, std::int64_t of_line);
  void note(Client& client, std::uint32_t event::ClientLimited::*count, Instant now);

  BudgetOptions options_;
  Account line_;
  Instant filled_{};
  std::array<Client, kClients> clients_;
  std::size_t known_ = 0;    // the first of them have a client
  std::size_t turn_ = 0;     // the place whose turn is next, among those of equal credit
  std::size_t sharing_ = 0;  // clients that share the credit
  bool all_full_ = true;     // the accounts of the clients
  bool next_due_ = false;    // see pop_next_due()
  std::size_t waiting_ = 0;  // commands
  std::size_t kept_ = 0;     // outputs
  std::size_t reports_ = 0;  // clients with a report_due
  // By node-ID: the command in progress, and one of a client with credit that waits for its end.
  std::array<std::array<Running, 2>, 128> nodes_;
  std::vector<Kept> outputs_;
  std::size_t output_turn_ = 0;
  std::size_t running_ = 0;           // SDO commands
  std::vector<OutputPlace> entries_;  // of the output layout
  // By event-driven PDO that carries outputs: its bits, and the number of the write that counted it
  // last
  struct OutputPdo {
    std::uint32_t bits = 0;
    std::uint64_t counted = 0;
  };
  std::vector<OutputPdo> pdos_;
  std::uint64_t writes_ = 0;
};

}  // namespace linegate::line

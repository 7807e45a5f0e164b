// SPDX-License-Identifier: Apache-2.0
// The SDO manager of a line (CiA 302-5): connects an SDO client of one node with an SDO server of
// another one. It takes two CAN-IDs of a pool, and writes a free record 1280h to 12FFh of the
// client's node and a free record 1201h to 127Fh of the server's node:
//   sub 1  U32  COB-ID client to server, bit 31 = not valid, bit 30 = assigned dynamically
//   sub 2  U32  COB-ID server to client, likewise
//   sub 3  U8   node-ID of the other node
// Each is set to not valid first, and becomes valid with the last writes, the server's record
// before the client's. How a device requests a connection (1F00h to 1F11h) has no public
// definition: connections are requested by the owner of this object. OWN.
//
// Invariants, whatever the devices answer:
//   - an assigned CAN-ID is of no other connection in the table, but one that a node restored when
//     it booted, which is released at once;
//   - an assigned CAN-ID is not restricted (CiA 301 7.3.5), and is of no other service that the
//     line has, that a device reported in a record that was read, or that was received from the bus
//     in the last kQuiet;
//   - a record that was valid once is written as not valid again when its node boots, because the
//     node may have stored it (1010h);
//   - a connection leaves the table only when both records were written as not valid, or their
//     nodes answered that they have no such record. Until then its CAN-IDs are not assigned again.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

#include "stack/base/event_log.h"
#include "stack/base/time.h"
#include "stack/manager/connection.h"
#include "stack/sdo/arbiter.h"

namespace linegate::manager {

// What the connections need from their line.
class ConnectionHost {
 public:
  ConnectionHost() = default;
  ConnectionHost(const ConnectionHost&) = delete;
  ConnectionHost& operator=(const ConnectionHost&) = delete;
  virtual ~ConnectionHost() = default;

  // Whether a service of the line uses the CAN-ID of 11 bits.
  virtual bool uses(std::uint32_t id) = 0;
  // The objects from first to last that the node has according to its device file, ascending; empty
  // if it has none, or no file.
  virtual std::vector<std::uint16_t> records(std::uint8_t node, std::uint16_t first,
                                             std::uint16_t last) const = 0;
  // The request to open or to close that connection has ended, exactly once for each. none:
  // completed, see Connections::find() after an opening. expired: its deadline is over; a
  // connection that was being opened is released.
  virtual void ended(std::uint32_t number, AbortCode why, bool expired, Instant now) = 0;
};

class Connections final : public sdo::TransferOwner {
 public:
  static constexpr std::size_t kMostWaiting = 16;  // requests that wait for the one under way
  static constexpr Duration kLongest = std::chrono::seconds(30);  // of a request
  static constexpr Duration kQuiet = std::chrono::seconds(10);

  struct Options {
    ConnectionPool pool{};
    Duration sdo_timeout = std::chrono::milliseconds(500);
  };
  // All must outlive it.
  Connections(const Options& options, sdo::Arbiter& sdo, EventLog& events, ConnectionHost& host);
  ~Connections() override { sdo_.disown(*this); }

  struct Request {
    Duration timeout{};        // 0 or longer than kLongest: kLongest
    std::uint32_t client = 0;  // whose frames those of an opening are, see sdo::Pace
  };
  // Assigns a connection of two nodes, 1..127 and not the same, and returns its number; the host is
  // notified of the end. Returns 0 if kMostWaiting requests wait.
  std::uint32_t open(std::uint8_t client, std::uint8_t server, Request request, Instant now);
  // Releases a connection that is open or stale: sets its records to not valid. Returns false if it
  // is neither, is being released already, or kMostWaiting requests wait.
  bool close(std::uint32_t number, Request request, Instant now);

  // The node has booted: it has lost its records, or restored them (1010h). Its connections are
  // released.
  void boot_up(std::uint8_t node, Instant now);
  // The node, which did not answer, is back: its stale records are written again.
  void recovered(std::uint8_t node, Instant now);
  // A frame with an identifier of 11 bits that no service of the line uses was received.
  void heard(std::uint32_t id, Instant now);
  // Releases all connections, because the line stops: busy() until that has ended.
  void release_all(Instant now);
  // The line is no longer NMT master and sends no SDO requests: its connections become stale.
  void abandon(Instant now);

  // sdo::TransferOwner
  void completed(sdo::Completion& completion, Instant now) override;
  void advance(Instant now);
  Instant next_wake() const;

  // A request is under way.
  bool busy() const { return task_.has_value() || !waiting_.empty(); }
  // Ascending by number.
  std::vector<Connection> table() const;
  const Connection* find(std::uint32_t number) const;

 private:
  // One of the two ends of a connection.
  enum class End : std::uint8_t { server, client };
  struct Entry {
    Connection value;
    // By End: its record is valid, or may be: a write that makes it valid was sent, and since then
    // not all that make it not valid were confirmed.
    std::array<bool, 2> valid{};
    std::array<bool, 2> was_valid{};
    bool requested = false;  // the host waits for ended()
    bool queued = false;     // waits, or is under way
    bool is_past = false;    // it was released before, and its node has booted since
  };
  struct Waiting {
    std::uint32_t number = 0;
    bool opens = false;
    Instant deadline = kNever;
    std::uint32_t client = 0;
    event::ConnectionResult result{};  // to report when it is released
  };
  enum class Phase : std::uint8_t { search, prepare, release };
  // A write to the record of one end.
  struct Step {
    End end = End::server;
    std::uint8_t sub = 0;
    std::uint32_t value = 0;
  };
  // The request under way.
  struct Task {
    Waiting request;
    Phase phase = Phase::search;
    std::uint64_t transfer = 0;  // number of the SDO transfer; 0 = none
    std::uint8_t node = 0;       // of the transfer
    Instant retry_at = kNever;   // the queue of the node was full
    // search
    End searched = End::server;
    std::vector<std::uint16_t> candidates{};
    bool probes = false;  // the candidates are not from a device file
    std::size_t candidate = 0;
    std::uint8_t sub = 0;
    bool is_free = true;
    bool has_record = false;
    std::vector<bool> taken{};  // by place in the pool: in records that were read
    // prepare, release
    std::vector<Step> steps{};
    std::size_t step = 0;
    std::array<AbortCode, 2> refused{};   // by End, in the release
    AbortCode failure = AbortCode::none;  // why it was not opened
    unsigned restarts = 0;                // of the release, by boot-ups
  };

  static std::size_t place(End end) { return static_cast<std::size_t>(end); }
  static std::uint8_t node_of(const Connection& connection, End end);
  static std::uint16_t record_of(const Connection& connection, End end);
  Entry* entry(std::uint32_t number);
  Entry& current();
  void erase(std::uint32_t number);
  void start_next(Instant now);
  void continue_task(Instant now);
  void submit(od::Address address, std::optional<Step> write, Instant now);
  void drop_transfer();
  void expire(Instant now);
  void expire_waiting(Instant now);
  // connections_search.cpp
  void begin_search(End end, Instant now);
  void read_next(Instant now);
  void read_completed(const sdo::Completion& completion, Instant now);
  void record_read(Instant now);
  void leave_record(Instant now);
  void note_taken(std::uint32_t raw);
  bool is_ours(std::uint8_t node, std::uint16_t record) const;
  std::optional<std::uint16_t> free_pair(const std::vector<bool>& taken, Instant now);
  bool is_assigned(std::uint16_t id) const;
  // connections_write.cpp
  void begin_writes(Instant now);
  void begin_release(Instant now);
  void write_next(Instant now);
  void write_completed(const sdo::Completion& completion, Instant now);
  void release_completed(AbortCode why, const Step& step);
  void fail(AbortCode why, Instant now);
  void opened(Instant now);
  void released(Instant now);
  void answer(Entry& entry, AbortCode why, bool expired, Instant now);
  void queue_release(Entry& entry, event::ConnectionResult result, Request request, Instant now);
  void remember(const Connection& connection, End end);
  void revive(std::uint8_t node, Instant now);
  bool is_watched(std::uint8_t node, std::uint16_t record) const;
  void report(const Connection& connection, event::ConnectionResult result, AbortCode why,
              Instant now);

  Options options_;
  sdo::Arbiter& sdo_;
  EventLog& events_;
  ConnectionHost& host_;
  std::deque<Entry> table_;  // ascending by number
  std::deque<Waiting> waiting_;
  std::optional<Task> task_;
  // The last connection of each record that has been valid; `valid` of that end alone is set.
  std::vector<Entry> past_;
  std::vector<std::optional<Instant>> heard_;  // by place in the pool
  std::uint32_t numbers_ = 0;                  // assigned so far
  std::uint64_t transfers_ = 0;                // assigned so far
};

}  // namespace linegate::manager

// SPDX-License-Identifier: Apache-2.0
// The assignment of node-IDs to the devices of a network that have none (CiA 305), by the identity
// that the configuration knows of its nodes: service by service, without I/O or time.
//
// A round begins with the question whether anybody has no node-ID: silence ends it. Nodes whose
// whole LSS address is known are then selected by it, the others found by fastscan with the parts
// that are known. Before a device is given a node-ID the owner checks that no other device uses it
// (node_to_check()): this waits, the others have their turn after it. Who is left after that is no
// node of the configuration: it is found by fastscan bit by bit and reported, and stays in
// configuration until the round ends, so that the next is found.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <string_view>
#include <vector>

#include "stack/lss/fastscan.h"
#include "stack/lss/master.h"

namespace linegate::lss {

// A node of the configuration. Parts of the address that are not known are left out.
struct Candidate {
  std::uint8_t node = 0;
  Known address{};

  bool complete() const;
  bool fits(const Address& other) const;
};

// Grows at the end only: the numbers are those of the DDS contract (EVENT_LSS_RESULT).
enum class Verdict : std::uint8_t {
  given,               // it has its node-ID
  unknown_device,      // no node of the configuration has its identity
  ambiguous,           // several nodes have its identity and no serial number
  node_id_in_use,      // the node with its identity is on the line; it has no serial number
  node_id_refused,     // with an error
  bit_timing_refused,  // with an error; it has its node-ID
  not_stored,          // with an error, or none; it has its node-ID until it is switched off
  no_answer,           // it fell silent before it had its node-ID
  nobody_found,        // somebody has no node-ID, but no known address and no fastscan finds it
  answers_in_configuration,  // it answers fastscan in configuration state: the search ends
  node_id_not_free,          // another device uses the node-ID: it is tried again
  reset_to_boot,             // given, but it did not boot before it got NMT reset communication
  node_id_unchecked,         // whether the node-ID is free could not be asked: it is tried again
};

// In words, of "a device without a node-ID".
std::string_view describe(Verdict verdict);
// The device has its node-ID, whatever else went wrong.
bool has_node_id(Verdict verdict);

struct Finding {
  Verdict verdict = Verdict::given;
  std::uint8_t node = 0;  // 0 where none is meant
  std::optional<Address> address;
  std::uint8_t error = 0;     // of the device, see message.h
  std::uint8_t specific = 0;  // the same
};

struct AssignerOptions {
  bool store = false;                      // the device keeps what it is given
  std::optional<std::uint8_t> bit_timing;  // given besides, index of table 0
};

// What the assigner asks of the line.
class AssignerHost {
 public:
  virtual ~AssignerHost() = default;
  // Something with that node-ID was heard and is not missing.
  virtual bool is_present(std::uint8_t node) const = 0;
  // The same, and its error control would tell if it were not.
  virtual bool is_watched(std::uint8_t node) const = 0;
};

class Assigner {
 public:
  // host must outlive it.
  Assigner(std::vector<Candidate> candidates, const AssignerOptions& options,
           const AssignerHost& host);

  // A new round. No effect while one is under way.
  void begin();
  bool active() const { return step_ != Step::idle; }
  // The nodes of the configuration have had their turn in this round: what goes on is the search
  // for others.
  bool nodes_done() const { return nodes_done_; }
  // Ends the round but for that nobody is left in configuration.
  void end_early();
  // Ends it at once.
  void cancel();

  const std::vector<Candidate>& candidates() const { return candidates_; }

  // The node-ID that is given next, as soon as checked() says that no other device uses it. There
  // is no service until then.
  std::optional<std::uint8_t> node_to_check() const;
  const Address& address_to_check() const { return address_; }
  void checked(bool free);
  // It cannot be asked whether the node-ID is free: it is given to nobody in this round.
  void cannot_check();
  // The next service. Precondition: active, no node-ID is to be checked, the service before has
  // been answered.
  Request request() const;
  void answered(const Answer& answer);

  // What came of a device, the oldest first. What is as it was in an earlier round is not told
  // again.
  std::optional<Finding> take();
  // All of this round, told before or not.
  const std::vector<Finding>& found() const { return found_; }

 private:
  enum class Step : std::uint8_t {
    idle,
    clear,   // nobody is in configuration
    ask,     // is there anybody
    select,  // by address_
    inquire,
    scan,
    check,  // whether node_ is free
    give,
    timing,
    store,
    leave,  // the one that was selected boots
    last,   // nobody is left in configuration
  };
  struct Told {
    Address address{};
    Verdict verdict = Verdict::given;
  };

  // What is looked for, in this order: complete_, partial_, the rest.
  bool is_complete() const { return target_ < complete_.size(); }
  bool is_rest() const { return target_ >= complete_.size() + partial_.size(); }
  void try_target();
  void next_target();
  void resume();
  void scan_for(const Known& known);
  void scan_rest();
  void scanned(bool yes);
  void nobody_there();
  void identified(Address address, bool sure);
  bool is_parked(const Address& address) const;
  void scan_on();
  void disturbed(const Address& address);
  bool check_parked(const Address& newest);
  void park(Verdict why, std::uint8_t node, const Address& address);
  void select(const Address& address, std::uint8_t node);
  void not_given(Verdict why);
  void gave(const Answer& answer);
  void conclude(Verdict verdict, const Answer& answer = {});
  void left();
  void report(const Finding& finding);
  bool is_news(const Finding& finding);
  bool asks_again(const Answer& answer);
  bool is_taken(std::uint8_t node) const;
  // nullptr and why not, if it is for none; why then has the node that is meant, if one is.
  const Candidate* candidate_of(const Address& address, Finding& why) const;

  std::vector<Candidate> candidates_;
  AssignerOptions options_;
  const AssignerHost& host_;
  std::vector<std::size_t> complete_;  // candidates whose address is known
  std::vector<Known> partial_;         // identities of the others, each once
  Step step_ = Step::idle;
  std::size_t target_ = 0;
  bool begun_ = false;  // somebody has no node-ID: a target was tried
  bool nodes_done_ = true;
  bool any_parked_ = false;         // somebody is in configuration who is given nothing
  std::size_t parking_ = 0;         // of strangers_, in the rest
  std::vector<Address> parked_;     // in configuration, as far as known
  std::vector<Address> failed_;     // in this round: tried again in the next one
  bool disturbed_ = false;          // in this round
  std::optional<Address> checked_;  // of these, the one that must not answer to scan_
  Fastscan scan_;
  bool selecting_ = false;  // address_ and node_ mean something
  Address address_{};
  std::uint8_t node_ = 0;
  std::optional<Finding> result_;  // of the selected one
  unsigned repeats_ = 0;           // of the present step
  unsigned finds_ = 0;             // of this round
  std::vector<Address> strangers_;
  std::vector<Told> told_;
  bool told_nobody_ = false;
  std::vector<Finding> found_;
  std::deque<Finding> news_;
};

}  // namespace linegate::lss

// SPDX-License-Identifier: Apache-2.0
// Assigns node-IDs to the unconfigured devices of a network (CiA 305), by the identities in the
// configuration; service by service, without I/O or time.
//
// A round begins with the question whether any device has no node-ID; without an answer the round
// ends. Nodes with a complete LSS address are then selected by it, the others are found by fastscan
// with the known parts. Before a device gets a node-ID, the owner checks that no other device uses
// it (node_to_check()); the device waits meanwhile, and the others are served after the check.
// Devices that remain are not in the configuration: fastscan finds and reports them one by one, and
// each stays in configuration state until the round ends, so that the next one is found.
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

// A node of the configuration. Unknown parts of the address are empty.
struct Candidate {
  std::uint8_t node = 0;
  Known address{};

  bool complete() const;
  bool fits(const Address& other) const;
};

// Only append: the numbers are part of the DDS contract (EVENT_LSS_RESULT).
enum class Verdict : std::uint8_t {
  given,           // the device has its node-ID
  unknown_device,  // its identity matches no node of the configuration
  ambiguous,       // its identity matches several nodes, and the configuration has no serial number
  // The node with its identity is on the line; the configuration has no serial number.
  node_id_in_use,
  node_id_refused,     // the device refused it with an error
  bit_timing_refused,  // refused with an error; the node-ID was given
  not_stored,          // refused with an error, or unanswered; the node-ID is lost at power-off
  no_answer,           // the device stopped answering before it had its node-ID
  nobody_found,        // a device has no node-ID, but neither a known address nor fastscan finds it
  // The device answers to fastscan in configuration state: the search ends.
  answers_in_configuration,
  node_id_not_free,  // another device uses the node-ID; tried again
  // The node-ID was given, but the device did not boot, and NMT reset communication was sent to it.
  reset_to_boot,
  node_id_unchecked,  // the check of the node-ID was impossible; tried again
};

// The verdict in words, for a message that names the node: "was given its node-ID".
std::string_view describe(Verdict verdict);
// Whether the device has its node-ID, possibly with another error.
bool has_node_id(Verdict verdict);

struct Finding {
  Verdict verdict = Verdict::given;
  std::uint8_t node = 0;  // 0 if unknown
  std::optional<Address> address;
  std::uint8_t error = 0;     // error code of the device, see message.h
  std::uint8_t specific = 0;  // its specific error code
};

struct AssignerOptions {
  bool store = false;                      // send `store` to the device
  std::optional<std::uint8_t> bit_timing;  // also configure this index of table 0
};

// The assigner's view of the line.
class AssignerHost {
 public:
  virtual ~AssignerHost() = default;
  // A frame of that node-ID was received, and the node is not missing.
  virtual bool is_present(std::uint8_t node) const = 0;
  // The same, and the loss of the node would be detected by its error control.
  virtual bool is_watched(std::uint8_t node) const = 0;
};

class Assigner {
 public:
  // host must outlive it.
  Assigner(std::vector<Candidate> candidates, const AssignerOptions& options,
           const AssignerHost& host);

  // Begins a round. No effect while one is under way.
  void begin();
  bool active() const { return step_ != Step::idle; }
  // The nodes of the configuration were served in this round; only the search for other devices
  // goes on.
  bool nodes_done() const { return nodes_done_; }
  // Ends the round after taking all devices out of configuration.
  void end_early();
  // Ends the round at once.
  void cancel();

  const std::vector<Candidate>& candidates() const { return candidates_; }

  // The next node-ID to assign, once checked() confirms that no other device uses it. There is no
  // request() until then.
  std::optional<std::uint8_t> node_to_check() const;
  const Address& address_to_check() const { return address_; }
  void checked(bool free);
  // The check is impossible: the node-ID is not assigned in this round.
  void cannot_check();
  // The next service. Precondition: active, no node-ID to check, and the previous service was
  // answered or timed out.
  Request request() const;
  void answered(const Answer& answer);

  // Returns results of devices, oldest first. A result that is unchanged since an earlier round is
  // not returned again.
  std::optional<Finding> take();
  // All results of this round, returned by take() or not.
  const std::vector<Finding>& found() const { return found_; }

 private:
  enum class Step : std::uint8_t {
    idle,
    clear,   // all devices leave configuration
    ask,     // is any device unconfigured?
    select,  // by address_
    inquire,
    scan,
    check,  // whether node_ is free
    give,
    timing,
    store,
    leave,  // the selected device boots
    last,   // all devices leave configuration at the end
  };
  struct Reported {
    Address address{};
    Verdict verdict = Verdict::given;
  };

  // Targets in this order: complete_, partial_, all remaining devices.
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
  // Returns nullptr if the address belongs to no candidate, with the reason in why and, if known,
  // the node.
  const Candidate* candidate_of(const Address& address, Finding& why) const;

  std::vector<Candidate> candidates_;
  AssignerOptions options_;
  const AssignerHost& host_;
  std::vector<std::size_t> complete_;  // candidates with a complete address
  std::vector<Known> partial_;         // identities of the others, without duplicates
  Step step_ = Step::idle;
  std::size_t target_ = 0;
  bool begun_ = false;  // a device is unconfigured: the first target was tried
  bool nodes_done_ = true;
  bool any_parked_ = false;         // a device that gets no node-ID is in configuration
  std::size_t parking_ = 0;         // index in strangers_, while they are parked
  std::vector<Address> parked_;     // in configuration, as far as known
  std::vector<Address> failed_;     // in this round: tried again in the next
  bool disturbed_ = false;          // in this round
  std::optional<Address> checked_;  // the parked device that must not answer to scan_
  Fastscan scan_;
  bool selecting_ = false;  // address_ and node_ are valid
  Address address_{};
  std::uint8_t node_ = 0;
  std::optional<Finding> result_;  // of the selected device
  unsigned repeats_ = 0;           // of the current step
  unsigned finds_ = 0;             // in this round
  std::vector<Address> strangers_;
  std::vector<Reported> reported_;
  bool reported_none_ = false;
  std::vector<Finding> found_;
  std::deque<Finding> news_;
};

}  // namespace linegate::lss

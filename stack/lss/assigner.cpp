// SPDX-License-Identifier: Apache-2.0
#include "stack/lss/assigner.h"

#include <algorithm>
#include <utility>

#include "stack/base/assert.h"

namespace linegate::lss {
namespace {

constexpr unsigned kRepeats = 1;      // of a service that addresses one device
constexpr unsigned kMostFinds = 256;  // in a round: the same devices may be found again and again
constexpr std::size_t kMostKept = 128;

}  // namespace

std::string_view describe(Verdict verdict) {
  switch (verdict) {
    case Verdict::given:
      return "was given its node-ID";
    case Verdict::unknown_device:
      return "a device without a node-ID, and no node of the configuration has its identity";
    case Verdict::ambiguous:
      return "a device without a node-ID, and several nodes of the configuration have its identity";
    case Verdict::node_id_in_use:
      return "another device of its identity has no node-ID, while this one is on the line";
    case Verdict::node_id_refused:
      return "refuses its node-ID";
    case Verdict::bit_timing_refused:
      return "was given its node-ID, but refuses the bit timing";
    case Verdict::not_stored:
      return "was given its node-ID, but has not stored it";
    case Verdict::no_answer:
      return "fell silent before it had its node-ID";
    case Verdict::nobody_found:
      return "a device has no node-ID, and neither a known address nor fastscan finds it";
    case Verdict::answers_in_configuration:
      return "a device answers fastscan in configuration state, which hides other devices: give it "
             "a "
             "node-ID by its address, or take it off the line";
    case Verdict::node_id_not_free:
      return "has no node-ID and waits: another device uses its node-ID";
    case Verdict::reset_to_boot:
      return "was given its node-ID, but did not boot: NMT reset communication was sent to it";
    case Verdict::node_id_unchecked:
      return "has no node-ID and waits: the gateway could not check whether its node-ID is free";
  }
  return "unknown";
}

bool has_node_id(Verdict verdict) {
  return verdict == Verdict::given || verdict == Verdict::bit_timing_refused ||
         verdict == Verdict::not_stored;
}

bool Candidate::complete() const {
  return std::ranges::all_of(address, [](const auto& part) { return part.has_value(); });
}

bool Candidate::fits(const Address& other) const {
  for (std::size_t i = 0; i < kParts; ++i) {
    if (address[i] && *address[i] != other[i]) {
      return false;
    }
  }
  return true;
}

Assigner::Assigner(std::vector<Candidate> candidates, const AssignerOptions& options,
                   const AssignerHost& host)
    : candidates_(std::move(candidates)), options_(options), host_(host) {
  for (std::size_t i = 0; i < candidates_.size(); ++i) {
    if (candidates_[i].complete()) {
      complete_.push_back(i);
    } else if (std::ranges::find(partial_, candidates_[i].address) == partial_.end()) {
      partial_.push_back(candidates_[i].address);
    }
  }
}

void Assigner::begin() {
  if (active()) {
    return;
  }
  step_ = Step::clear;
  begun_ = nodes_done_ = any_parked_ = selecting_ = disturbed_ = false;
  parked_.clear();
  failed_.clear();
  checked_.reset();
  target_ = 0;
  finds_ = repeats_ = 0;
  found_.clear();
}

void Assigner::end_early() {
  if (active()) {
    nodes_done_ = true;
    repeats_ = 0;
    step_ = Step::last;
  }
}

void Assigner::cancel() {
  step_ = Step::idle;
  nodes_done_ = true;
}

std::optional<Finding> Assigner::take() {
  if (news_.empty()) {
    return std::nullopt;
  }
  const Finding out = news_.front();
  news_.pop_front();
  return out;
}

std::optional<std::uint8_t> Assigner::node_to_check() const {
  return step_ == Step::check ? std::optional(node_) : std::nullopt;
}

void Assigner::checked(bool free) {
  if (step_ != Step::check) {
    return;
  }
  if (free) {
    step_ = Step::give;
  } else {
    not_given(Verdict::node_id_not_free);
  }
}

void Assigner::cannot_check() {
  if (step_ == Step::check) {
    not_given(Verdict::node_id_unchecked);
  }
}

void Assigner::not_given(Verdict why) {
  conclude(why);
  step_ = Step::leave;
}

Request Assigner::request() const {
  LINEGATE_ASSERT(active() && step_ != Step::check, "a service is due");
  switch (step_) {
    case Step::ask:
      return {.service = Service::anybody};
    case Step::select:
      return {.service = Service::switch_selective, .address = address_};
    case Step::inquire:
      return {.service = Service::inquire_node_id};
    case Step::scan:
      return {.service = Service::question, .message = scan_.question()};
    case Step::give:
      return {.service = Service::configure_node_id, .node_id = node_};
    case Step::timing:
      return {.service = Service::configure_bit_timing, .index = options_.bit_timing.value_or(0)};
    case Step::store:
      return {.service = Service::store, .timeout = kStoreTime};
    case Step::idle:
    case Step::clear:
    case Step::check:
    case Step::leave:
    case Step::last:
      break;
  }
  return {.service = Service::switch_global, .configuration = false};
}

void Assigner::answered(const Answer& answer) {
  if (asks_again(answer)) {
    return;
  }
  const bool yes = answer.outcome == Outcome::done;
  switch (step_) {
    case Step::idle:
    case Step::check:
      return;
    case Step::clear:
      any_parked_ = false;
      parked_.clear();
      step_ = selecting_ ? Step::select : Step::ask;
      return;
    case Step::ask:
      if (yes) {
        begun_ ? resume() : try_target();
        begun_ = true;
      } else {
        reported_none_ = false;
        cancel();
      }
      return;
    case Step::select:
      if (!yes && !is_complete()) {
        conclude(Verdict::no_answer);
      }
      step_ = yes ? Step::inquire : Step::leave;
      return;
    case Step::inquire:
      // A device that already has a node-ID keeps it.
      step_ = yes && answer.value == kNoNodeId ? Step::check : Step::leave;
      return;
    case Step::scan:
      scanned(yes);
      return;
    case Step::give:
      gave(answer);
      return;
    case Step::timing:
      if (!yes) {
        conclude(Verdict::bit_timing_refused, answer);
      }
      step_ = options_.store ? Step::store : Step::leave;
      return;
    case Step::store:
      if (!yes) {
        conclude(Verdict::not_stored, answer);
      }
      step_ = Step::leave;
      return;
    case Step::leave:
      left();
      return;
    case Step::last:
      cancel();
      return;
  }
}

// Repeats an unanswered service to a single device, which should answer; other services are
// questions that no device may answer. The command that takes devices out of configuration is
// always sent twice: a device that missed it would take the node-ID of the next one.
bool Assigner::asks_again(const Answer& answer) {
  const bool leaves = step_ == Step::clear || step_ == Step::leave || step_ == Step::last;
  const bool of_one = step_ == Step::inquire || step_ == Step::give || step_ == Step::timing ||
                      step_ == Step::store || (step_ == Step::select && !is_complete());
  const bool silent = of_one && answer.outcome == Outcome::no_answer;
  if ((leaves || silent) && repeats_ < kRepeats) {
    ++repeats_;
    return true;
  }
  repeats_ = 0;
  return false;
}

// --- targets ------------------------------------------------------------------------------------

void Assigner::try_target() {
  while (is_complete()) {
    const Candidate& candidate = candidates_[complete_[target_]];
    LINEGATE_ASSERT(candidate.complete(), "every part of the address is known");
    if (!host_.is_watched(candidate.node)) {
      Address address{};
      std::ranges::transform(candidate.address, address.begin(),
                             [](const auto& part) { return *part; });
      select(address, candidate.node);
      return;
    }
    ++target_;
  }
  if (!is_rest()) {
    scan_for(partial_[target_ - complete_.size()]);
    return;
  }
  nodes_done_ = true;
  parking_ = 0;
  scan_rest();
}

void Assigner::next_target() {
  ++target_;
  try_target();
}

// A complete address belongs to one device; other targets may match several, so they are tried
// again.
void Assigner::resume() {
  if (is_complete()) {
    next_target();
  } else {
    try_target();
  }
}

void Assigner::scan_for(const Known& known) {
  scan_ = Fastscan(known);
  step_ = Step::scan;
}

// First moves known foreign devices into configuration, where they do not answer to fastscan, so
// that it finds the others.
void Assigner::scan_rest() {
  if (parking_ < strangers_.size()) {
    const Address& stranger = strangers_[parking_];
    scan_for({stranger[kVendor], stranger[kProduct], stranger[kRevision], stranger[kSerial]});
  } else {
    scan_for({});
  }
}

// --- fastscan -----------------------------------------------------------------------------------

void Assigner::scanned(bool yes) {
  scan_.answered(yes);
  switch (scan_.state()) {
    case Fastscan::State::running:
      return;
    case Fastscan::State::found:
    case Fastscan::State::unsure:
      if (++finds_ > kMostFinds) {
        step_ = Step::last;
        return;
      }
      identified(scan_.address(), scan_.state() == Fastscan::State::found);
      return;
    case Fastscan::State::nobody:
    case Fastscan::State::failed:
      nobody_there();
      return;
  }
}

void Assigner::nobody_there() {
  if (std::exchange(checked_, std::nullopt)) {
    scan_on();
    return;
  }
  if (!is_rest()) {
    next_target();
  } else if (parking_ < strangers_.size()) {
    strangers_.erase(strangers_.begin() + static_cast<std::ptrdiff_t>(parking_));
    scan_rest();
  } else {
    if (found_.empty() && !any_parked_) {
      report({.verdict = Verdict::nobody_found, .address = {}});
    }
    step_ = Step::last;
  }
}

bool Assigner::is_parked(const Address& address) const {
  return std::ranges::find(parked_, address) != parked_.end();
}

// Searches on; the device that was found stays in configuration.
void Assigner::scan_on() {
  is_rest() ? scan_rest() : try_target();
}

// A slave still answers to fastscan in configuration state, so results of fastscan beside it are
// invalid. Devices with complete addresses were already served; those with another identity come
// next.
void Assigner::disturbed(const Address& address) {
  checked_.reset();
  if (!std::exchange(disturbed_, true)) {
    report({.verdict = Verdict::answers_in_configuration, .node = 0, .address = address});
  }
  if (is_rest()) {
    step_ = Step::last;
  } else {
    next_target();
  }
}

// Many serial numbers of one device type may all come from one slave that answers to any. Returns
// true if a fastscan for the first of them begins: a correct slave does not answer in configuration
// state.
bool Assigner::check_parked(const Address& newest) {
  const auto alike = std::ranges::find_if(parked_, [&newest](const Address& address) {
    return address != newest &&
           std::equal(address.begin(), address.begin() + kSerial, newest.begin());
  });
  if (alike == parked_.end()) {
    return false;
  }
  checked_ = *alike;
  scan_for({(*alike)[kVendor], (*alike)[kProduct], (*alike)[kRevision], (*alike)[kSerial]});
  return true;
}

// address is a copy, because another scan may begin within.
void Assigner::identified(Address address, bool sure) {
  if (is_parked(address) || address == Address{}) {
    disturbed(address);
    return;
  }
  if (is_rest() && parking_ < strangers_.size()) {
    any_parked_ = true;
    parked_.push_back(address);
    ++parking_;
    scan_rest();
    return;
  }
  if (std::ranges::find(failed_, address) != failed_.end()) {
    any_parked_ = true;
    parked_.push_back(address);
    scan_on();
    return;
  }
  Finding why;
  if (const Candidate* candidate = candidate_of(address, why)) {
    select(address, candidate->node);
  } else if (sure) {
    park(why.verdict, why.node, address);
  } else {
    resume();
  }
}

// Leaves the device in configuration, where it does not answer to fastscan.
void Assigner::park(Verdict why, std::uint8_t node, const Address& address) {
  any_parked_ = true;
  report({.verdict = why, .node = node, .address = address});
  if (is_rest()) {
    if (strangers_.size() < kMostKept) {
      strangers_.push_back(address);
    }
    parking_ = strangers_.size();
  }
  const bool checks = check_parked(address);
  parked_.push_back(address);
  if (!checks) {
    scan_on();
  }
}

// A device that was given the node-ID in this round may not have sent its boot-up message yet.
bool Assigner::is_taken(std::uint8_t node) const {
  return host_.is_present(node) || std::ranges::any_of(found_, [node](const Finding& finding) {
           return finding.node == node && has_node_id(finding.verdict);
         });
}

const Candidate* Assigner::candidate_of(const Address& address, Finding& why) const {
  const Candidate* found = nullptr;
  std::size_t alike = 0;
  std::size_t absent = 0;
  for (const Candidate& candidate : candidates_) {
    if (!candidate.fits(address)) {
      continue;
    }
    if (candidate.complete()) {
      return &candidate;
    }
    ++alike;
    why.node = candidate.node;
    if (!is_taken(candidate.node)) {
      ++absent;
      found = &candidate;
    }
  }
  if (absent == 1) {
    return found;
  }
  why.verdict = alike == 0   ? Verdict::unknown_device
                : alike == 1 ? Verdict::node_id_in_use
                             : Verdict::ambiguous;
  why.node = alike == 1 ? why.node : std::uint8_t{0};
  return nullptr;
}

// --- one device ---------------------------------------------------------------------------------

void Assigner::select(const Address& address, std::uint8_t node) {
  selecting_ = true;
  address_ = address;
  node_ = node;
  result_.reset();
  // Every slave in configuration state receives the node-ID, so first clear that state.
  step_ = is_complete() && !any_parked_ ? Step::select : Step::clear;
}

void Assigner::gave(const Answer& answer) {
  LINEGATE_ASSERT(selecting_ && step_ == Step::give, "a selected device was given its node-ID");
  if (answer.outcome != Outcome::done) {
    conclude(answer.outcome == Outcome::refused ? Verdict::node_id_refused : Verdict::no_answer,
             answer);
    step_ = Step::leave;
    return;
  }
  conclude(Verdict::given);
  step_ = options_.bit_timing ? Step::timing : options_.store ? Step::store : Step::leave;
}

void Assigner::conclude(Verdict verdict, const Answer& answer) {
  result_ = Finding{.verdict = verdict,
                    .node = node_,
                    .address = address_,
                    .error = answer.error,
                    .specific = answer.specific};
}

void Assigner::left() {
  any_parked_ = selecting_ = false;
  parked_.clear();
  const bool given = result_ && has_node_id(result_->verdict);
  if (result_) {
    report(*result_);
  }
  if (given) {
    step_ = Step::ask;
    return;
  }
  if (result_) {
    failed_.push_back(result_->address.value_or(Address{}));
  }
  resume();
}

void Assigner::report(const Finding& finding) {
  found_.push_back(finding);
  if (is_news(finding)) {
    news_.push_back(finding);
  }
}

bool Assigner::is_news(const Finding& finding) {
  if (!finding.address) {
    return !std::exchange(reported_none_, true);
  }
  const auto known = std::ranges::find(reported_, *finding.address, &Reported::address);
  if (known != reported_.end() && known->verdict == finding.verdict) {
    return has_node_id(finding.verdict);
  }
  if (known != reported_.end()) {
    known->verdict = finding.verdict;
  } else {
    if (reported_.size() == kMostKept) {
      reported_.erase(reported_.begin());
    }
    reported_.push_back({*finding.address, finding.verdict});
  }
  return true;
}

}  // namespace linegate::lss

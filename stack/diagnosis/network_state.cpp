// SPDX-License-Identifier: Apache-2.0
#include "stack/diagnosis/network_state.h"

namespace linegate::diagnosis {
namespace {

using manager::ManagerState;

std::uint8_t of_slave(nmt::State own) {
  switch (own) {
    case nmt::State::stopped:
      return kSlaveStopped;
    case nmt::State::operational:
      return kSlaveOperational;
    default:
      return kSlavePreOperational;
  }
}

bool has_bits(std::uint8_t value) {
  return value >= kClear && (value & 0xF0U) != kFatal;
}

}  // namespace

std::string_view name_of_network_state(std::uint8_t value) {
  switch (has_bits(value) ? value & 0xF0U : value) {
    case kInit:
      return "init";
    case kReset:
      return "reset";
    case kSlaveStopped:
      return "slave-stopped";
    case kSlavePreOperational:
      return "slave-pre-operational";
    case kSlaveOperational:
      return "slave-operational";
    case kNetworkReset:
      return "network-reset";
    case kNetworkWait:
      return "network-wait";
    case kBootConfiguration:
      return "boot-conf";
    case kBootAuto:
      return "boot-auto";
    case kMissingMandatory:
      return "missing-mandatory";
    case kClear:
      return "clear";
    case kFatal:
      return "fatal-error";
    case kRun:
      return "run";
    case kStop:
      return "stop";
    case kPreOperational:
      return "pre-operational";
    default:
      return "unknown";
  }
}

void NetworkState::begin() {
  phase_ = Phase::reset;
  main_ = kClear;
  fatal_ = false;
}

void NetworkState::commanded(nmt::Command command, const NetworkFacts& facts) {
  switch (command) {
    case nmt::Command::reset_node:
    case nmt::Command::reset_communication:
      begin();
      return;
    case nmt::Command::start:
      if (phase_ == Phase::done && !facts.mandatory_wrong) {
        main_ = kRun;
      }
      return;
    case nmt::Command::stop:
      main_ = phase_ == Phase::done ? kStop : main_;
      return;
    case nmt::Command::enter_pre_operational:
      main_ = phase_ == Phase::done ? kPreOperational : main_;
      return;
  }
}

void NetworkState::update(const NetworkFacts& facts) {
  if (!facts.running || !facts.manages) {
    phase_ = Phase::reset;
    main_ = kClear;
    return;
  }
  if (facts.manager == ManagerState::resetting) {
    phase_ = phase_ == Phase::reset ? Phase::wait : phase_;
    return;
  }
  const bool trying = facts.booting || facts.manager == ManagerState::booting;
  if (phase_ < Phase::missing) {
    phase_ = trying ? Phase::boot : Phase::missing;
  }
  const bool waits = trying || facts.manager == ManagerState::missing_mandatory;
  if (phase_ == Phase::missing && (facts.boot_time_over || !waits)) {
    phase_ = Phase::done;
  }
  // Start Network, the last step of the boot-up procedure.
  if (phase_ == Phase::done && main_ == kClear && facts.starts_nodes && !facts.mandatory_wrong &&
      facts.own == nmt::State::operational) {
    main_ = kRun;
  }
}

std::uint8_t NetworkState::value(const NetworkFacts& facts) const {
  if (!facts.running) {
    return facts.manages && facts.manager == ManagerState::stopped ? kReset : kInit;
  }
  if (facts.own == nmt::State::initialising) {
    return kInit;
  }
  return facts.manages ? of_master(facts) : of_slave(facts.own);
}

std::uint8_t NetworkState::of_master(const NetworkFacts& facts) const {
  if (fatal_) {
    return kFatal;
  }
  if (facts.scanning) {
    return kBootAuto;
  }
  if (facts.manager == ManagerState::inactive || facts.manager == ManagerState::stopped) {
    return kReset;
  }
  switch (phase_) {
    case Phase::reset:
      return facts.manager == ManagerState::resetting ? kNetworkReset : kBootConfiguration;
    case Phase::wait:
      return kNetworkWait;
    case Phase::boot:
      return kBootConfiguration;
    case Phase::missing:
      return kMissingMandatory;
    case Phase::done:
      break;
  }
  unsigned out = main_;
  out |= facts.optional_wrong ? kOptionalWrong : 0U;
  out |= facts.mandatory_wrong ? kMandatoryWrong : 0U;
  out |= facts.some_operational ? kSomeOperational : 0U;
  out |= facts.own == nmt::State::operational ? kOwnOperational : 0U;
  return static_cast<std::uint8_t>(out);
}

}  // namespace linegate::diagnosis

// SPDX-License-Identifier: Apache-2.0
// Asserts that the enumerations of the stack have the values of the contract, and the same last
// member.
#include <cstddef>

#include <linegate.h>

#include "bridges/dds/values.h"
#include "stack/base/event.h"
#include "stack/can/bus_state.h"
#include "stack/image/layout.h"
#include "stack/line/command.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"
#include "stack/nmt/state.h"

namespace linegate::dds {
namespace {

template <class Wire, class Stack>
constexpr bool same(Wire wire, Stack stack) {
  return static_cast<std::uint32_t>(wire) == static_cast<std::uint32_t>(stack);
}

static_assert(same(v1::CLOCK_UNKNOWN, ClockQuality::unknown));
static_assert(same(v1::CLOCK_FREE_RUNNING, ClockQuality::free_running));
static_assert(same(v1::CLOCK_SYNCHRONISED, ClockQuality::synchronised));

static_assert(same(v1::DIRECTION_INPUTS, image::Direction::inputs));
static_assert(same(v1::DIRECTION_OUTPUTS, image::Direction::outputs));

static_assert(same(v1::ROLE_MANAGER, line::Role::manager));
static_assert(same(v1::ROLE_OBSERVER, line::Role::observer));
static_assert(same(v1::ROLE_DEVICE, line::Role::device));

static_assert(same(v1::ACCESS_OFF, Access::off));
static_assert(same(v1::ACCESS_READ, Access::read));
static_assert(same(v1::ACCESS_ALL, Access::all));

static_assert(same(v1::MANAGER_INACTIVE, line::ManagerState::inactive));
static_assert(same(v1::MANAGER_RESETTING, line::ManagerState::resetting));
static_assert(same(v1::MANAGER_BOOTING, line::ManagerState::booting));
static_assert(same(v1::MANAGER_MISSING_MANDATORY, line::ManagerState::missing_mandatory));
static_assert(same(v1::MANAGER_RUNNING, line::ManagerState::running));
static_assert(same(v1::MANAGER_STOPPED, line::ManagerState::stopped));
static_assert(same(v1::MANAGER_HALTED, line::ManagerState::halted));

static_assert(same(v1::BUS_UNKNOWN, can::BusState::unknown));
static_assert(same(v1::BUS_ERROR_ACTIVE, can::BusState::error_active));
static_assert(same(v1::BUS_ERROR_WARNING, can::BusState::error_warning));
static_assert(same(v1::BUS_ERROR_PASSIVE, can::BusState::error_passive));
static_assert(same(v1::BUS_OFF, can::BusState::bus_off));
static_assert(same(v1::BUS_STOPPED, can::BusState::stopped));
static_assert(same(v1::BUS_ABSENT, can::BusState::absent));

static_assert(same(v1::STATE_CAUSE_UNKNOWN, line::StateCause::unknown));
static_assert(same(v1::STATE_CAUSE_COMMAND, line::StateCause::command));
static_assert(same(v1::STATE_CAUSE_ITSELF, line::StateCause::itself));
static_assert(same(v1::PRESENCE_UNKNOWN, line::Presence::unknown));
static_assert(same(v1::PRESENCE_PRESENT, line::Presence::present));
static_assert(same(v1::PRESENCE_MISSING, line::Presence::missing));

static_assert(same(v1::SEVERITY_INFO, EventSeverity::info));
static_assert(same(v1::SEVERITY_WARNING, EventSeverity::warning));
static_assert(same(v1::SEVERITY_ERROR, EventSeverity::error));

static_assert(same(v1::EVENT_LINE_STARTED, EventKind::line_started));
static_assert(same(v1::EVENT_LINE_STOPPED, EventKind::line_stopped));
static_assert(same(v1::EVENT_BUS_STATE, EventKind::bus_state));
static_assert(same(v1::EVENT_BUS_ERROR, EventKind::bus_error));
static_assert(same(v1::EVENT_FRAMES_LOST, EventKind::frames_lost));
static_assert(same(v1::EVENT_INTERFACE_FAILED, EventKind::interface_failed));
static_assert(same(v1::EVENT_INTERFACE_READY, EventKind::interface_ready));
static_assert(same(v1::EVENT_MANAGER_STATE, EventKind::manager_state));
static_assert(same(v1::EVENT_OWN_STATE, EventKind::own_state));
static_assert(same(v1::EVENT_BOOT_UP, EventKind::boot_up));
static_assert(same(v1::EVENT_NODE_STATE, EventKind::node_state));
static_assert(same(v1::EVENT_HEARTBEAT_LOST, EventKind::heartbeat_lost));
static_assert(same(v1::EVENT_HEARTBEAT_RECOVERED, EventKind::heartbeat_recovered));
static_assert(same(v1::EVENT_BOOT_RESULT, EventKind::boot_result));
static_assert(same(v1::EVENT_EMCY, EventKind::emcy));
static_assert(same(v1::EVENT_EMCY_SENT, EventKind::emcy_sent));
static_assert(same(v1::EVENT_CONFIGURATION_ERROR, EventKind::configuration_error));
static_assert(same(v1::EVENT_PDO_LENGTH, EventKind::pdo_length));
static_assert(same(v1::EVENT_PDO_TIMEOUT, EventKind::pdo_timeout));
static_assert(same(v1::EVENT_PDO_RECOVERED, EventKind::pdo_recovered));
static_assert(same(v1::EVENT_SYNC_LOST, EventKind::sync_lost));
static_assert(same(v1::EVENT_MALFORMED_FRAME, EventKind::malformed_frame));
static_assert(same(v1::EVENT_UNEXPECTED_NODE, EventKind::unexpected_node));
static_assert(same(v1::EVENT_FOREIGN_SDO, EventKind::foreign_sdo));
static_assert(same(v1::EVENT_SDO_ABORT, EventKind::sdo_abort));
static_assert(same(v1::EVENT_OUTPUT_REFUSED, EventKind::output_refused));
static_assert(same(v1::EVENT_OUTPUT_ARMED, EventKind::output_armed));
static_assert(same(v1::EVENT_OUTPUT_WATCHDOG, EventKind::output_watchdog));
static_assert(same(v1::EVENT_COMMAND_REFUSED, EventKind::command_refused));
static_assert(same(v1::EVENT_EVENTS_LOST, EventKind::events_lost));
static_assert(same(v1::EVENT_CLOCK_STEP, EventKind::clock_step));
static_assert(same(v1::EVENT_QUEUE_FULL, EventKind::queue_full));
static_assert(same(v1::EVENT_DUPLICATE_NODE_ID, EventKind::duplicate_node_id));
static_assert(same(v1::EVENT_NMT_COMMAND, EventKind::nmt_command));
static_assert(same(v1::EVENT_SDO_TRANSFER, EventKind::sdo_transfer));
static_assert(same(v1::EVENT_PDO_MAPPING, EventKind::pdo_mapping));
static_assert(same(v1::EVENT_LAYOUT_CHANGED, EventKind::layout_changed));
static_assert(same(v1::EVENT_ROUTING_REFUSED, EventKind::routing_refused));
static_assert(same(v1::EVENT_EMCY_ROUTED, EventKind::emcy_routed));
static_assert(same(v1::EVENT_ROUTING_OPENED, EventKind::routing_opened));
static_assert(same(v1::EVENT_ROUTING_ENDED, EventKind::routing_ended));
static_assert(same(v1::EVENT_NODE_SCANNED, EventKind::node_scanned));
static_assert(same(v1::EVENT_COMMAND_PROGRESS, EventKind::command_progress));
static_assert(same(v1::EVENT_LSS_RESULT, EventKind::lss_result));
static_assert(same(v1::EVENT_FOREIGN_MANAGER, EventKind::foreign_manager));
static_assert(same(v1::EVENT_CAN_FRAME, EventKind::can_frame));
static_assert(same(v1::EVENT_GATEWAY_STARTED, EventKind::gateway_started));
static_assert(same(v1::EVENT_GATEWAY_RELOADED, EventKind::gateway_reloaded));
static_assert(same(v1::EVENT_GATEWAY_RELOAD_REFUSED, EventKind::gateway_reload_refused));
static_assert(same(v1::EVENT_SPONTANEOUS_CHANGE, EventKind::spontaneous_change));
static_assert(same(v1::EVENT_SHARED_NODE_ID, EventKind::shared_node_id));
static_assert(same(v1::EVENT_OBJECT_WRITTEN, EventKind::object_written));
static_assert(same(v1::EVENT_OWN_RESET, EventKind::own_reset));
static_assert(same(v1::EVENT_TIME_RECEIVED, EventKind::time_received));
static_assert(v1::EVENT_TIME_RECEIVED + 1U == kEventKinds);

static_assert(v1::COMMAND_MPDO_WRITE + 1U == line::kCommandKinds);

static_assert(same(v1::RESULT_DONE, Domain::none));
static_assert(same(v1::RESULT_SDO, Domain::sdo));
static_assert(same(v1::RESULT_CAN, Domain::can));
static_assert(same(v1::RESULT_REFUSED, Domain::command));

static_assert(same(v1::REFUSAL_NONE, line::Refusal::none));
static_assert(same(v1::REFUSAL_BUSY, line::Refusal::busy));
static_assert(same(v1::REFUSAL_NOT_PERMITTED, line::Refusal::not_permitted));
static_assert(same(v1::REFUSAL_BAD_REQUEST, line::Refusal::bad_request));
static_assert(same(v1::REFUSAL_UNKNOWN_LINE, line::Refusal::unknown_line));
static_assert(same(v1::REFUSAL_UNKNOWN_ENTRY, line::Refusal::unknown_entry));
static_assert(same(v1::REFUSAL_WRONG_INCARNATION, line::Refusal::wrong_incarnation));
static_assert(same(v1::REFUSAL_WRONG_ROLE, line::Refusal::wrong_role));
static_assert(same(v1::REFUSAL_WRONG_STATE, line::Refusal::wrong_state));
static_assert(same(v1::REFUSAL_INHIBITED, line::Refusal::inhibited));
static_assert(same(v1::REFUSAL_TIMED_OUT, line::Refusal::timed_out));
static_assert(same(v1::REFUSAL_LINE_DOWN, line::Refusal::line_down));
static_assert(same(v1::REFUSAL_STALE_LAYOUT, line::Refusal::stale_layout));
static_assert(same(v1::REFUSAL_CANCELLED, line::Refusal::cancelled));
static_assert(same(v1::REFUSAL_WRONG_INTERFACE, line::Refusal::wrong_interface));
static_assert(same(v1::REFUSAL_IDENTIFIER_IN_USE, line::Refusal::identifier_in_use));
static_assert(same(v1::REFUSAL_BOUND_ENTRY, line::Refusal::bound_entry));
static_assert(same(v1::REFUSAL_NO_ACKNOWLEDGE, line::Refusal::no_acknowledge));
static_assert(same(v1::REFUSAL_AWAITS_TURN, line::Refusal::awaits_turn));

static_assert(same(v1::OUTPUT_REFUSAL_NONE, line::OutputRefusal::none));
static_assert(same(v1::OUTPUT_REFUSAL_NOT_PERMITTED, line::OutputRefusal::not_permitted));
static_assert(same(v1::OUTPUT_REFUSAL_STALE_LAYOUT, line::OutputRefusal::stale_layout));
static_assert(same(v1::OUTPUT_REFUSAL_UNKNOWN_GROUP, line::OutputRefusal::unknown_group));
static_assert(same(v1::OUTPUT_REFUSAL_UNKNOWN_ENTRY, line::OutputRefusal::unknown_entry));
static_assert(same(v1::OUTPUT_REFUSAL_BAD_LENGTH, line::OutputRefusal::bad_length));
static_assert(same(v1::OUTPUT_REFUSAL_NOT_ARMED, line::OutputRefusal::not_armed));
static_assert(same(v1::OUTPUT_REFUSAL_BAD_REACTION, line::OutputRefusal::bad_reaction));
static_assert(same(v1::OUTPUT_REFUSAL_WRONG_ROLE, line::OutputRefusal::wrong_role));
static_assert(same(v1::OUTPUT_REFUSAL_BOUND_ENTRY, line::OutputRefusal::bound_entry));

static_assert(same(v1::OUTPUT_WAIT_VALUE, line::OutputWait::value));
static_assert(same(v1::OUTPUT_WAIT_VALUES, line::OutputWait::values));
static_assert(same(v1::OUTPUT_WAIT_OWN_NODE, line::OutputWait::own_node));
static_assert(same(v1::OUTPUT_WAIT_NODE, line::OutputWait::node));
static_assert(same(v1::OUTPUT_WAIT_TURN, line::OutputWait::turn));
static_assert(same(v1::OUTPUT_WAIT_BUS, line::OutputWait::bus));
static_assert(same(v1::OUTPUT_WAIT_TRIGGER, line::OutputWait::trigger));
static_assert(same(v1::OUTPUT_WAIT_UPDATE_TIME, line::OutputWait::update_time));

static_assert(same(v1::NMT_INITIALISING, nmt::State::initialising));
static_assert(same(v1::NMT_STOPPED, nmt::State::stopped));
static_assert(same(v1::NMT_OPERATIONAL, nmt::State::operational));
static_assert(same(v1::NMT_PRE_OPERATIONAL, nmt::State::pre_operational));
static_assert(same(v1::NMT_UNKNOWN, nmt::State::unknown));
static_assert(same(v1::NMT_START, nmt::Command::start));
static_assert(same(v1::NMT_STOP, nmt::Command::stop));
static_assert(same(v1::NMT_ENTER_PRE_OPERATIONAL, nmt::Command::enter_pre_operational));
static_assert(same(v1::NMT_RESET_NODE, nmt::Command::reset_node));
static_assert(same(v1::NMT_RESET_COMMUNICATION, nmt::Command::reset_communication));

static_assert(same(v1::WATCHDOG_HOLD_OUTPUTS, line::kHoldOutputs));
static_assert(same(v1::WATCHDOG_ZERO_OUTPUTS, line::kZeroOutputs));
static_assert(same(v1::WATCHDOG_NMT_PRE_OPERATIONAL, line::kNmtPreOperational));
static_assert(same(v1::WATCHDOG_NMT_STOP, line::kNmtStop));
static_assert(same(v1::WATCHDOG_NMT_RESET_COMMUNICATION, line::kNmtResetCommunication));
static_assert(same(v1::WATCHDOG_NMT_RESET_NODE, line::kNmtResetNode));
static_assert(same(v1::WATCHDOG_SEND_EMCY, line::kSendEmcy));
static_assert(same(v1::WATCHDOG_HEARTBEAT_OFF, line::kHeartbeatOff));

}  // namespace
}  // namespace linegate::dds

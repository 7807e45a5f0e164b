// SPDX-License-Identifier: Apache-2.0
// Asserts that the enumerations of the stack have the values of the contract, and the same last
// member.
#include <cstddef>

#include <linegate.h>

#include "bridges/dds/values.h"
#include "bridges/request/request.h"
#include "stack/base/event.h"
#include "stack/can/bus_state.h"
#include "stack/image/layout.h"
#include "stack/image/limits.h"
#include "stack/line/command.h"
#include "stack/line/output_state.h"
#include "stack/line/output_write.h"
#include "stack/line/state.h"
#include "stack/nmt/state.h"
#include "stack/od/data_type.h"
#include "stack/od/description.h"

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

static_assert(v1::EVENT_SLEEP_STATE + 1U == kEventKinds);

static_assert(same(v1::FLYING_MASTER_NONE, nmt::FlyingMasterState::none));
static_assert(same(v1::FLYING_MASTER_DETECT, nmt::FlyingMasterState::detect));
static_assert(same(v1::FLYING_MASTER_RESET, nmt::FlyingMasterState::reset));
static_assert(same(v1::FLYING_MASTER_NEGOTIATE, nmt::FlyingMasterState::negotiate));
static_assert(same(v1::FLYING_MASTER_MASTER, nmt::FlyingMasterState::master));
static_assert(same(v1::FLYING_MASTER_SLAVE, nmt::FlyingMasterState::slave));
static_assert(same(v1::FLYING_MASTER_FORCE, nmt::FlyingMasterState::force));

static_assert(v1::COMMAND_SLEEP + 1U == request::kCommandKinds);

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
static_assert(same(v1::REFUSAL_NO_RIGHT, line::Refusal::no_right));
static_assert(same(v1::REFUSAL_IMAGE_PDO, line::Refusal::image_pdo));

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
static_assert(same(v1::OUTPUT_REFUSAL_BUSY, line::OutputRefusal::busy));
static_assert(same(v1::OUTPUT_REFUSAL_NO_RIGHT, line::OutputRefusal::no_right));
static_assert(same(v1::OUTPUT_REFUSAL_WRITTEN_BY_NAME, line::OutputRefusal::written_by_name));
static_assert(same(v1::OUTPUT_REFUSAL_BAD_VALUE, line::OutputRefusal::bad_value));
static_assert(same(v1::OUTPUT_REFUSAL_SOURCE_MISSING, line::OutputRefusal::source_missing));
static_assert(same(v1::OUTPUT_REFUSAL_SOURCE_TYPE, line::OutputRefusal::source_type));
static_assert(same(v1::OUTPUT_REFUSAL_SOURCE_DISPUTED, line::OutputRefusal::source_disputed));
static_assert(same(v1::OUTPUT_REFUSAL_SOURCE_SILENT, line::OutputRefusal::source_silent));
static_assert(same(v1::OUTPUT_REFUSAL_SOURCE_INVALID, line::OutputRefusal::source_invalid));

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

static_assert(same(v1::DATA_TYPE_NONE, od::DataType::none));
static_assert(same(v1::DATA_TYPE_BOOLEAN, od::DataType::boolean));
static_assert(same(v1::DATA_TYPE_INTEGER8, od::DataType::integer8));
static_assert(same(v1::DATA_TYPE_INTEGER16, od::DataType::integer16));
static_assert(same(v1::DATA_TYPE_INTEGER32, od::DataType::integer32));
static_assert(same(v1::DATA_TYPE_UNSIGNED8, od::DataType::unsigned8));
static_assert(same(v1::DATA_TYPE_UNSIGNED16, od::DataType::unsigned16));
static_assert(same(v1::DATA_TYPE_UNSIGNED32, od::DataType::unsigned32));
static_assert(same(v1::DATA_TYPE_REAL32, od::DataType::real32));
static_assert(same(v1::DATA_TYPE_VISIBLE_STRING, od::DataType::visible_string));
static_assert(same(v1::DATA_TYPE_OCTET_STRING, od::DataType::octet_string));
static_assert(same(v1::DATA_TYPE_UNICODE_STRING, od::DataType::unicode_string));
static_assert(same(v1::DATA_TYPE_TIME_OF_DAY, od::DataType::time_of_day));
static_assert(same(v1::DATA_TYPE_TIME_DIFFERENCE, od::DataType::time_difference));
static_assert(same(v1::DATA_TYPE_DOMAIN, od::DataType::domain));
static_assert(same(v1::DATA_TYPE_INTEGER24, od::DataType::integer24));
static_assert(same(v1::DATA_TYPE_REAL64, od::DataType::real64));
static_assert(same(v1::DATA_TYPE_INTEGER40, od::DataType::integer40));
static_assert(same(v1::DATA_TYPE_INTEGER48, od::DataType::integer48));
static_assert(same(v1::DATA_TYPE_INTEGER56, od::DataType::integer56));
static_assert(same(v1::DATA_TYPE_INTEGER64, od::DataType::integer64));
static_assert(same(v1::DATA_TYPE_UNSIGNED24, od::DataType::unsigned24));
static_assert(same(v1::DATA_TYPE_UNSIGNED40, od::DataType::unsigned40));
static_assert(same(v1::DATA_TYPE_UNSIGNED48, od::DataType::unsigned48));
static_assert(same(v1::DATA_TYPE_UNSIGNED56, od::DataType::unsigned56));
static_assert(same(v1::DATA_TYPE_UNSIGNED64, od::DataType::unsigned64));

static_assert(same(v1::OBJECT_RO, od::Access::ro));
static_assert(same(v1::OBJECT_WO, od::Access::wo));
static_assert(same(v1::OBJECT_RW, od::Access::rw));
static_assert(same(v1::OBJECT_RWR, od::Access::rwr));
static_assert(same(v1::OBJECT_RWW, od::Access::rww));
static_assert(same(v1::OBJECT_CONST, od::Access::constant));

static_assert(same(v1::WATCHDOG_HOLD_OUTPUTS, line::kHoldOutputs));
static_assert(same(v1::WATCHDOG_ZERO_OUTPUTS, line::kZeroOutputs));
static_assert(same(v1::WATCHDOG_NMT_PRE_OPERATIONAL, line::kNmtPreOperational));
static_assert(same(v1::WATCHDOG_NMT_STOP, line::kNmtStop));
static_assert(same(v1::WATCHDOG_NMT_RESET_COMMUNICATION, line::kNmtResetCommunication));
static_assert(same(v1::WATCHDOG_NMT_RESET_NODE, line::kNmtResetNode));
static_assert(same(v1::WATCHDOG_SEND_EMCY, line::kSendEmcy));
static_assert(same(v1::WATCHDOG_HEARTBEAT_OFF, line::kHeartbeatOff));

// What a line may have fits the sequences of the contract.
static_assert(image::kMaxEntries == kMaxEntries);
static_assert(image::kMaxPdos == kMaxStamps);
static_assert(image::kMaxEntries % kMaxLayoutPart == 0);

}  // namespace
}  // namespace linegate::dds

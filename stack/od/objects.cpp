// SPDX-License-Identifier: Apache-2.0
#include "stack/od/objects.h"

#include <algorithm>

#include "stack/base/assert.h"

namespace linegate::od::objects {
namespace {

using enum DataType;

constexpr Entry var(std::uint16_t index, std::string_view name, DataType type,
                    std::string_view source) {
  const ObjectType object = type == domain ? ObjectType::domain : ObjectType::variable;
  return {index, index, name, object, type, 0, source};
}

constexpr Entry arrays(std::uint16_t first, std::uint16_t last, std::string_view name,
                       DataType type, std::string_view source) {
  return {first, last, name, ObjectType::array, type, 0, source};
}

constexpr Entry array(std::uint16_t index, std::string_view name, DataType type,
                      std::string_view source) {
  return arrays(index, index, name, type, source);
}

constexpr Entry records(std::uint16_t first, std::uint16_t last, std::string_view name,
                        std::uint16_t structure, std::string_view source) {
  return {first, last, name, ObjectType::record, none, structure, source};
}

constexpr Entry record(std::uint16_t index, std::string_view name, std::uint16_t structure,
                       std::string_view source) {
  return records(index, index, name, structure, source);
}

// DEFSTRUCTs of CiA 301 7.4.1.
constexpr std::uint16_t kPdoCommunicationRecord = 0x20;
constexpr std::uint16_t kPdoMappingRecord = 0x21;
constexpr std::uint16_t kSdoParameterRecord = 0x22;
constexpr std::uint16_t kIdentityRecord = 0x23;
constexpr std::uint16_t kOsDebugRecord = 0x24;
constexpr std::uint16_t kOsCommandRecord = 0x25;

// The network variables have one array for each type; image/network_variables.h defines their names
// and types.
constexpr Entry kEntries[] = {
    var(kDeviceType, "Device type", unsigned32, "CiA 301 7.5.2.1"),
    var(kErrorRegister, "Error register", unsigned8, "CiA 301 7.5.2.2"),
    var(kManufacturerStatus, "Manufacturer status register", unsigned32, "CiA 301 7.5.2.3"),
    array(kErrorHistory, "Pre-defined error field", unsigned32, "CiA 301 7.5.2.4"),
    var(kSyncCobId, "COB-ID SYNC message", unsigned32, "CiA 301 7.5.2.5"),
    var(kSyncPeriod, "Communication cycle period", unsigned32, "CiA 301 7.5.2.6"),
    var(kSyncWindow, "Synchronous window length", unsigned32, "CiA 301 7.5.2.7"),
    var(kDeviceName, "Manufacturer device name", visible_string, "CiA 301 7.5.2.8"),
    var(kHardwareVersion, "Manufacturer hardware version", visible_string, "CiA 301 7.5.2.9"),
    var(kSoftwareVersion, "Manufacturer software version", visible_string, "CiA 301 7.5.2.10"),
    var(kGuardTime, "Guard time", unsigned16, "CiA 301 7.5.2.11"),
    var(kLifeTimeFactor, "Life time factor", unsigned8, "CiA 301 7.5.2.12"),
    array(kStoreParameters, "Store parameters", unsigned32, "CiA 301 7.5.2.13"),
    array(kRestoreDefaults, "Restore default parameters", unsigned32, "CiA 301 7.5.2.14"),
    var(kTimeCobId, "COB-ID time stamp object", unsigned32, "CiA 301 7.5.2.15"),
    var(kHighResolutionTime, "High resolution time stamp", unsigned32, "CiA 301 7.5.2.16"),
    var(kEmcyCobId, "COB-ID EMCY", unsigned32, "CiA 301 7.5.2.17"),
    var(kEmcyInhibitTime, "Inhibit time EMCY", unsigned16, "CiA 301 7.5.2.18"),
    array(kConsumerHeartbeatTime, "Consumer heartbeat time", unsigned32, "CiA 301 7.5.2.19"),
    var(kProducerHeartbeatTime, "Producer heartbeat time", unsigned16, "CiA 301 7.5.2.20"),
    record(kIdentity, "Identity object", kIdentityRecord, "CiA 301 7.5.2.21"),
    var(kSyncCounterOverflow, "Synchronous counter overflow value", unsigned8, "CiA 301 7.5.2.22"),
    array(kVerifyConfiguration, "Verify configuration", unsigned32, "CiA 301 7.5.2.23"),
    var(kStoredEds, "Store EDS", domain, "CiA 301 7.5.2.24"),
    var(kStoredEdsFormat, "Store format", unsigned16, "CiA 301 7.5.2.25"),
    record(kOsCommand, "OS command", kOsCommandRecord, "CiA 301 7.5.2.26"),
    var(kOsCommandMode, "OS command mode", unsigned8, "CiA 301 7.5.2.27"),
    record(kOsDebugger, "OS debugger interface", kOsDebugRecord, "CiA 301 7.5.2.28"),
    array(kOsPrompt, "OS prompt", unsigned8, "CiA 301 7.5.2.29"),
    array(kModuleList, "Module list", unsigned16, "CiA 301 7.5.2.30"),
    array(kEmcyConsumer, "Emergency consumer object", unsigned32, "CiA 301 7.5.2.31"),
    array(kErrorBehaviour, "Error behaviour", unsigned8, "CiA 301 7.5.2.32"),
    var(kNmtInhibitTime, "NMT inhibit time", unsigned16, "CiA 302-2"),
    records(kSdoServer, kLastSdoServer, "SDO server parameter", kSdoParameterRecord,
            "CiA 301 7.5.2.33"),
    records(kSdoClient, kLastSdoClient, "SDO client parameter", kSdoParameterRecord,
            "CiA 301 7.5.2.34"),
    records(kRpdoCommunication, kLastRpdoCommunication, "RPDO communication parameter",
            kPdoCommunicationRecord, "CiA 301 7.5.2.35"),
    records(kRpdoMapping, kLastRpdoMapping, "RPDO mapping parameter", kPdoMappingRecord,
            "CiA 301 7.5.2.36"),
    records(kTpdoCommunication, kLastTpdoCommunication, "TPDO communication parameter",
            kPdoCommunicationRecord, "CiA 301 7.5.2.37"),
    records(kTpdoMapping, kLastTpdoMapping, "TPDO mapping parameter", kPdoMappingRecord,
            "CiA 301 7.5.2.38"),
    array(kStoredDcf, "Store DCF", domain, "CiA 302-3"),
    array(kStoredDcfFormat, "Storage format", unsigned8, "CiA 302-3"),
    array(kConciseDcf, "Concise DCF", domain, "CiA 302-3"),
    array(kConfigureSlave, "Configure NMT slave", unsigned32, "CiA 302-3"),
    array(kExpectedDate, "Expected configuration date", unsigned32, "CiA 302-3"),
    array(kExpectedTime, "Expected configuration time", unsigned32, "CiA 302-3"),
    array(kRoutingTable, "Routing table", unsigned64, "CiA 302-7; layout: routing/table.h"),
    array(kEmcyRouting, "EMCY routing", unsigned32, "CiA 302-7"),
    array(kProgramData, "Program data", domain, "CiA 302-3"),
    array(kProgramControl, "Program control", unsigned8, "CiA 302-3"),
    array(kExpectedSoftware, "Expected software identification", unsigned32, "CiA 302-3"),
    array(kSoftwareIdentification, "Program software identification", unsigned32, "CiA 302-3"),
    array(kFlashStatus, "Flash status identification", unsigned32, "CiA 302-3"),
    array(kNodeProgram, "Program data", domain, "CiA 302-3"),
    var(kNmtStartup, "NMT startup", unsigned32, "CiA 302-2"),
    array(kSlaveAssignment, "Slave assignment", unsigned32, "CiA 302-2"),
    array(kRequestNmt, "Request NMT", unsigned8, "CiA 302-2"),
    array(kRequestGuarding, "Request guarding", unsigned8, "CiA 302-2"),
    array(kExpectedDeviceType, "Device type identification", unsigned32, "CiA 302-2"),
    array(kExpectedVendor, "Vendor identification", unsigned32, "CiA 302-2"),
    array(kExpectedProduct, "Product code", unsigned32, "CiA 302-2"),
    array(kExpectedRevision, "Revision number", unsigned32, "CiA 302-2"),
    array(kExpectedSerial, "Serial number", unsigned32, "CiA 302-2"),
    var(kBootTime, "Boot time", unsigned32, "CiA 302-2"),
    array(kRestoreConfiguration, "Restore configuration", unsigned8, "CiA 302-2"),
    array(kFlyingMasterTiming, "NMT flying master timing parameters", unsigned16, "CiA 302-2"),
    arrays(kScannerList, kLastScannerList, "MPDO scanner list", unsigned32, "CiA 301 7.5.2.39"),
    arrays(kDispatcherList, kLastDispatcherList, "MPDO dispatcher list", unsigned64,
           "CiA 301 7.5.2.40"),
    record(kManagerStatus, "Status of the CANopen manager", 0, "IXXAT manual 7.1"),
    arrays(kNodeLists, kNodeLists + 6, "List of slaves", unsigned32, "IXXAT manual 7.2"),
    array(kEmcysOfNodes, "Node error count", unsigned8, "IXXAT manual 7.3.1"),
    {kEmcysOfClasses, kEmcysOfClasses + 6, "Error count", ObjectType::variable, unsigned8, 0,
     "IXXAT manual 7.3.2"},
    array(kEmcyHistory, "Emergency history", domain, "IXXAT manual 7.3.3"),
    array(kNetworkIds, "Network-IDs of the lines", unsigned16, "Linegate"),
    records(kCanopenIa, kCanopenIa + 0x0C, "CANopenIA record", 0, "CANopenIA manual 6"),
    record(kTaskTimes, "Task time configuration", 0, "IXXAT manual 5.13"),
    arrays(kInputVariables, kOutputVariables - 1, "Input network variables", none, "CiA 302-4"),
    arrays(kOutputVariables, kLastNetworkVariable, "Output network variables", none, "CiA 302-4"),
    arrays(kSharedVariables, kLastSharedVariable, "Shared process data", none, "CiA 302-7"),
};

constexpr Entry kIoEntries[] = {
    array(cia401::kDigitalInputs, "Read input 8-bit", unsigned8, "CiA 401"),
    array(cia401::kDigitalInputPolarity, "Polarity input 8-bit", unsigned8, "CiA 401"),
    var(cia401::kDigitalInterrupts, "Global interrupt enable digital", boolean, "CiA 401"),
    array(cia401::kInterruptAnyChange, "Interrupt mask any change 8-bit", unsigned8, "CiA 401"),
    array(cia401::kInterruptLowToHigh, "Interrupt mask low-to-high 8-bit", unsigned8, "CiA 401"),
    array(cia401::kInterruptHighToLow, "Interrupt mask high-to-low 8-bit", unsigned8, "CiA 401"),
    array(cia401::kDigitalInputBits, "Read input bit 1 to 128", boolean, "CiA 401"),
    array(cia401::kDigitalOutputs, "Write output 8-bit", unsigned8, "CiA 401"),
    array(cia401::kDigitalOutputPolarity, "Change polarity output 8-bit", unsigned8, "CiA 401"),
    array(cia401::kDigitalErrorMode, "Error mode output 8-bit", unsigned8, "CiA 401"),
    array(cia401::kDigitalErrorValue, "Error value output 8-bit", unsigned8, "CiA 401"),
    array(cia401::kDigitalOutputFilter, "Filter mask output 8-bit", unsigned8, "CiA 401"),
    array(cia401::kAnalogueInputs, "Read analogue input 16-bit", integer16, "CiA 401"),
    array(cia401::kAnalogueInputFloats, "Read analogue input float", real32, "CiA 401"),
    array(cia401::kAnalogueOutputs, "Write analogue output 16-bit", integer16, "CiA 401"),
    array(cia401::kAnalogueTrigger, "Analogue input interrupt trigger selection", unsigned8,
          "CiA 401"),
    var(cia401::kAnalogueInterrupts, "Analogue input global interrupt enable", boolean, "CiA 401"),
    array(cia401::kAnalogueUpperLimit, "Analogue input interrupt upper limit integer", integer32,
          "CiA 401"),
    array(cia401::kAnalogueLowerLimit, "Analogue input interrupt lower limit integer", integer32,
          "CiA 401"),
    array(cia401::kAnalogueDelta, "Analogue input interrupt delta unsigned", unsigned32, "CiA 401"),
    array(cia401::kAnalogueNegativeDelta, "Analogue input interrupt negative delta unsigned",
          unsigned32, "CiA 401"),
    array(cia401::kAnaloguePositiveDelta, "Analogue input interrupt positive delta unsigned",
          unsigned32, "CiA 401"),
    array(cia401::kAnalogueInputOffset, "Analogue input offset integer", integer32, "CiA 401"),
    array(cia401::kAnalogueInputScaling, "Analogue input scaling integer", integer32, "CiA 401"),
    array(cia401::kAnalogueErrorMode, "Analogue output error mode", unsigned8, "CiA 401"),
    array(cia401::kAnalogueErrorValue, "Analogue output error value integer", integer32, "CiA 401"),
    array(cia401::kAnalogueOutputOffset, "Analogue output offset integer", integer32, "CiA 401"),
    array(cia401::kAnalogueOutputScaling, "Analogue output scaling integer", integer32, "CiA 401"),
};

constexpr Entry kDriveEntries[] = {
    var(cia402::kAbortConnectionOption, "Abort connection option code", integer16, "CiA 402"),
    var(cia402::kErrorCode, "Error code", unsigned16, "CiA 402"),
    var(cia402::kControlword, "Controlword", unsigned16, "CiA 402"),
    var(cia402::kStatusword, "Statusword", unsigned16, "CiA 402"),
    var(cia402::kQuickStopOption, "Quick stop option code", integer16, "CiA 402"),
    var(cia402::kMode, "Modes of operation", integer8, "CiA 402"),
    var(cia402::kModeDisplay, "Modes of operation display", integer8, "CiA 402"),
    var(cia402::kPosition, "Position actual value", integer32, "CiA 402"),
    var(cia402::kVelocity, "Velocity actual value", integer32, "CiA 402"),
    var(cia402::kTargetPosition, "Target position", integer32, "CiA 402"),
    var(cia402::kProfileVelocity, "Profile velocity", unsigned32, "CiA 402"),
    var(cia402::kProfileAcceleration, "Profile acceleration", unsigned32, "CiA 402"),
    var(cia402::kTargetVelocity, "Target velocity", integer32, "CiA 402"),
};

constexpr Entry kEncoderEntries[] = {
    var(cia406::kRange, "Total measuring range in measuring units", unsigned32, "CiA 406"),
    var(cia406::kPreset, "Preset value", unsigned32, "CiA 406"),
    var(cia406::kPositionValue, "Position value", unsigned32, "CiA 406"),
    array(cia406::kSpeed, "Speed value", integer16, "CiA 406"),
};

}  // namespace

std::span<const Entry> all(std::uint16_t profile) {
  switch (profile) {
    case 0:
      return kEntries;
    case cia401::kProfile:
      return kIoEntries;
    case cia402::kProfile:
      return kDriveEntries;
    case cia406::kProfile:
      return kEncoderEntries;
    default:
      return {};
  }
}

const Entry* find(std::uint16_t index, std::uint16_t profile) {
  const std::span<const Entry> entries = all(profile);
  const auto it = std::ranges::lower_bound(entries, index, {}, &Entry::last);
  return it != entries.end() && it->first <= index ? &*it : nullptr;
}

const Entry& at(std::uint16_t index, std::uint16_t profile) {
  const Entry* const entry = find(index, profile);
  LINEGATE_ASSERT(entry != nullptr, "the catalogue has the object");
  return *entry;
}

}  // namespace linegate::od::objects

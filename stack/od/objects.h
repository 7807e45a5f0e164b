// SPDX-License-Identifier: Apache-2.0
// The catalogue of the objects that Linegate reads, writes or serves: their indices, and their
// definitions in CiA and other documents. No other file defines an index of the communication
// profile (1000h to 1FFFh), of the network variables (A000h to BFFFh) or of the objects for
// diagnosis (5F00h to 5FFFh), or an index of a device profile as a number in an address:
// tests/checks/catalogue.py.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

#include "stack/od/description.h"

namespace linegate::od::objects {

// CiA 301
inline constexpr std::uint16_t kDeviceType = 0x1000;
inline constexpr std::uint16_t kErrorRegister = 0x1001;
inline constexpr std::uint16_t kManufacturerStatus = 0x1002;
inline constexpr std::uint16_t kErrorHistory = 0x1003;
inline constexpr std::uint16_t kSyncCobId = 0x1005;
inline constexpr std::uint16_t kSyncPeriod = 0x1006;
inline constexpr std::uint16_t kSyncWindow = 0x1007;
inline constexpr std::uint16_t kDeviceName = 0x1008;
inline constexpr std::uint16_t kHardwareVersion = 0x1009;
inline constexpr std::uint16_t kSoftwareVersion = 0x100A;
inline constexpr std::uint16_t kGuardTime = 0x100C;
inline constexpr std::uint16_t kLifeTimeFactor = 0x100D;
inline constexpr std::uint16_t kStoreParameters = 0x1010;
inline constexpr std::uint16_t kRestoreDefaults = 0x1011;
inline constexpr std::uint16_t kTimeCobId = 0x1012;
inline constexpr std::uint16_t kHighResolutionTime = 0x1013;
inline constexpr std::uint16_t kEmcyCobId = 0x1014;
inline constexpr std::uint16_t kEmcyInhibitTime = 0x1015;
inline constexpr std::uint16_t kConsumerHeartbeatTime = 0x1016;
inline constexpr std::uint16_t kProducerHeartbeatTime = 0x1017;
inline constexpr std::uint16_t kIdentity = 0x1018;
inline constexpr std::uint16_t kSyncCounterOverflow = 0x1019;
inline constexpr std::uint16_t kVerifyConfiguration = 0x1020;
inline constexpr std::uint16_t kStoredEds = 0x1021;
inline constexpr std::uint16_t kStoredEdsFormat = 0x1022;
inline constexpr std::uint16_t kOsCommand = 0x1023;
inline constexpr std::uint16_t kOsCommandMode = 0x1024;
inline constexpr std::uint16_t kOsDebugger = 0x1025;
inline constexpr std::uint16_t kOsPrompt = 0x1026;
inline constexpr std::uint16_t kModuleList = 0x1027;
inline constexpr std::uint16_t kEmcyConsumer = 0x1028;
inline constexpr std::uint16_t kErrorBehaviour = 0x1029;
inline constexpr std::uint16_t kSdoServer = 0x1200;  // the default server; others follow
inline constexpr std::uint16_t kLastSdoServer = 0x127F;
inline constexpr std::uint16_t kSdoClient = 0x1280;
inline constexpr std::uint16_t kLastSdoClient = 0x12FF;
// EN 50325-5: SRDOs 1 to 64, their configuration is valid, their signatures by number
inline constexpr std::uint16_t kFailSafeCommand = 0x1300;
inline constexpr std::uint16_t kSrdoCommunication = 0x1301;
inline constexpr std::uint16_t kSrdoMapping = 0x1381;
inline constexpr std::uint16_t kSrdoConfigurationValid = 0x13FE;
inline constexpr std::uint16_t kSrdoSignature = 0x13FF;
inline constexpr std::uint16_t kRpdoCommunication = 0x1400;
inline constexpr std::uint16_t kLastRpdoCommunication = 0x15FF;
inline constexpr std::uint16_t kRpdoMapping = 0x1600;
inline constexpr std::uint16_t kLastRpdoMapping = 0x17FF;
inline constexpr std::uint16_t kTpdoCommunication = 0x1800;
inline constexpr std::uint16_t kLastTpdoCommunication = 0x19FF;
inline constexpr std::uint16_t kTpdoMapping = 0x1A00;
inline constexpr std::uint16_t kLastTpdoMapping = 0x1BFF;
inline constexpr std::uint16_t kScannerList = 0x1FA0;
inline constexpr std::uint16_t kLastScannerList = 0x1FCF;
inline constexpr std::uint16_t kDispatcherList = 0x1FD0;
inline constexpr std::uint16_t kLastDispatcherList = 0x1FFF;

// CiA 302-2, 302-3: manager, configuration, programs
inline constexpr std::uint16_t kNmtInhibitTime = 0x102A;
inline constexpr std::uint16_t kStoredDcf = 0x1F20;
inline constexpr std::uint16_t kStoredDcfFormat = 0x1F21;
inline constexpr std::uint16_t kConciseDcf = 0x1F22;
inline constexpr std::uint16_t kConfigureSlave = 0x1F25;
inline constexpr std::uint16_t kExpectedDate = 0x1F26;
inline constexpr std::uint16_t kExpectedTime = 0x1F27;
inline constexpr std::uint16_t kProgramData = 0x1F50;
inline constexpr std::uint16_t kProgramControl = 0x1F51;
inline constexpr std::uint16_t kExpectedSoftware = 0x1F55;
inline constexpr std::uint16_t kSoftwareIdentification = 0x1F56;
inline constexpr std::uint16_t kFlashStatus = 0x1F57;
inline constexpr std::uint16_t kNodeProgram = 0x1F58;
inline constexpr std::uint16_t kNmtStartup = 0x1F80;
inline constexpr std::uint16_t kSlaveAssignment = 0x1F81;
inline constexpr std::uint16_t kRequestNmt = 0x1F82;
inline constexpr std::uint16_t kRequestGuarding = 0x1F83;
inline constexpr std::uint16_t kExpectedDeviceType = 0x1F84;
inline constexpr std::uint16_t kExpectedVendor = 0x1F85;
inline constexpr std::uint16_t kExpectedProduct = 0x1F86;
inline constexpr std::uint16_t kExpectedRevision = 0x1F87;
inline constexpr std::uint16_t kExpectedSerial = 0x1F88;
inline constexpr std::uint16_t kBootTime = 0x1F89;
inline constexpr std::uint16_t kRestoreConfiguration = 0x1F8A;
inline constexpr std::uint16_t kFlyingMasterTiming = 0x1F90;

// CiA 302-7: several networks
inline constexpr std::uint16_t kRoutingTable = 0x1F2C;
inline constexpr std::uint16_t kEmcyRouting = 0x1F2F;
inline constexpr std::uint16_t kSharedVariables =
    0xB000;  // process data forwarded from line to line
inline constexpr std::uint16_t kLastSharedVariable = 0xBFFF;

// CiA 302-4: network variables. A device sends "input" variables and receives "output" variables:
// the directions of an image are the opposite.
inline constexpr std::uint16_t kInputVariables = 0xA000;
inline constexpr std::uint16_t kOutputVariables = 0xA480;
inline constexpr std::uint16_t kLastNetworkVariable =
    0xAFFF;  // end of the area; the last index in use is A8FFh

// IXXAT manual 5.13 and 7: diagnosis of a manager
inline constexpr std::uint16_t kManagerStatus = 0x5F00;
inline constexpr std::uint16_t kNodeLists = 0x5F01;  // seven of them
inline constexpr std::uint16_t kEmcysOfNodes = 0x5F10;
inline constexpr std::uint16_t kEmcysOfClasses = 0x5F11;  // seven of them
inline constexpr std::uint16_t kEmcyHistory = 0x5F18;
inline constexpr std::uint16_t kTaskTimes = 0x5F80;

// Linegate
inline constexpr std::uint16_t kNetworkIds = 0x5F20;
// CANopenIA manual: from here on unless configured elsewhere between these two limits; 5F00h to
// 5FFFh also has the objects above.
inline constexpr std::uint16_t kCanopenIa = 0x5F40;
inline constexpr std::uint16_t kLowestCanopenIa = 0x5F21;
inline constexpr std::uint16_t kHighestCanopenIa = 0x5FF3;

// CiA 401: generic I/O modules. Other profiles define these indices differently.
namespace cia401 {
inline constexpr std::uint16_t kProfile = 401;  // low word of 1000h
inline constexpr std::uint16_t kDigitalInputs = 0x6000;
inline constexpr std::uint16_t kDigitalInputPolarity = 0x6002;
inline constexpr std::uint16_t kDigitalInterrupts = 0x6005;
inline constexpr std::uint16_t kInterruptAnyChange = 0x6006;
inline constexpr std::uint16_t kInterruptLowToHigh = 0x6007;
inline constexpr std::uint16_t kInterruptHighToLow = 0x6008;
inline constexpr std::uint16_t kDigitalInputBits = 0x6020;
inline constexpr std::uint16_t kDigitalOutputs = 0x6200;
inline constexpr std::uint16_t kDigitalOutputPolarity = 0x6202;
inline constexpr std::uint16_t kDigitalErrorMode = 0x6206;
inline constexpr std::uint16_t kDigitalErrorValue = 0x6207;
inline constexpr std::uint16_t kDigitalOutputFilter = 0x6208;
inline constexpr std::uint16_t kAnalogueInputs = 0x6401;
inline constexpr std::uint16_t kAnalogueInputFloats = 0x6403;
inline constexpr std::uint16_t kAnalogueOutputs = 0x6411;
inline constexpr std::uint16_t kAnalogueTrigger = 0x6421;
inline constexpr std::uint16_t kAnalogueInterrupts = 0x6423;
inline constexpr std::uint16_t kAnalogueUpperLimit = 0x6424;
inline constexpr std::uint16_t kAnalogueLowerLimit = 0x6425;
inline constexpr std::uint16_t kAnalogueDelta = 0x6426;
inline constexpr std::uint16_t kAnalogueNegativeDelta = 0x6427;
inline constexpr std::uint16_t kAnaloguePositiveDelta = 0x6428;
inline constexpr std::uint16_t kAnalogueInputOffset = 0x6431;
inline constexpr std::uint16_t kAnalogueInputScaling = 0x6432;
inline constexpr std::uint16_t kAnalogueErrorMode = 0x6443;
inline constexpr std::uint16_t kAnalogueErrorValue = 0x6444;
inline constexpr std::uint16_t kAnalogueOutputOffset = 0x6446;
inline constexpr std::uint16_t kAnalogueOutputScaling = 0x6447;
}  // namespace cia401

// CiA 402: drives.
namespace cia402 {
inline constexpr std::uint16_t kProfile = 402;
inline constexpr std::uint16_t kAbortConnectionOption = 0x6007;
inline constexpr std::uint16_t kErrorCode = 0x603F;
inline constexpr std::uint16_t kControlword = 0x6040;
inline constexpr std::uint16_t kStatusword = 0x6041;
inline constexpr std::uint16_t kQuickStopOption = 0x605A;
inline constexpr std::uint16_t kMode = 0x6060;
inline constexpr std::uint16_t kModeDisplay = 0x6061;
inline constexpr std::uint16_t kPosition = 0x6064;
inline constexpr std::uint16_t kVelocity = 0x606C;
inline constexpr std::uint16_t kTargetPosition = 0x607A;
inline constexpr std::uint16_t kProfileVelocity = 0x6081;
inline constexpr std::uint16_t kProfileAcceleration = 0x6083;
inline constexpr std::uint16_t kTargetVelocity = 0x60FF;
}  // namespace cia402

// CiA 406: encoders.
namespace cia406 {
inline constexpr std::uint16_t kProfile = 406;
inline constexpr std::uint16_t kRange = 0x6002;
inline constexpr std::uint16_t kPreset = 0x6003;
inline constexpr std::uint16_t kPositionValue = 0x6004;
inline constexpr std::uint16_t kSpeed = 0x6030;
}  // namespace cia406

// Areas of an object dictionary (CiA 301, 7.4.1). Data types have lower indices.
inline constexpr std::uint16_t kFirstCommunication = 0x1000;
inline constexpr std::uint16_t kLastCommunication = 0x1FFF;

// Sub-indices of 1018h (CiA 301, 7.5.2.21).
inline constexpr Address kVendorId{kIdentity, 1};
inline constexpr Address kProductCode{kIdentity, 2};
inline constexpr Address kRevisionNumber{kIdentity, 3};
inline constexpr Address kSerialNumber{kIdentity, 4};

constexpr bool is_rpdo_communication(std::uint16_t index) {
  return index >= kRpdoCommunication && index <= kLastRpdoCommunication;
}
constexpr bool is_tpdo_communication(std::uint16_t index) {
  return index >= kTpdoCommunication && index <= kLastTpdoCommunication;
}
constexpr bool is_pdo_communication(std::uint16_t index) {
  return is_rpdo_communication(index) || is_tpdo_communication(index);
}
constexpr bool is_pdo_mapping(std::uint16_t index) {
  return (index >= kRpdoMapping && index <= kLastRpdoMapping) ||
         (index >= kTpdoMapping && index <= kLastTpdoMapping);
}
// Whether the index is that of communication or mapping parameters of a PDO.
constexpr bool is_pdo_record(std::uint16_t index) {
  return index >= kRpdoCommunication && index <= kLastTpdoMapping;
}

// Objects with the same name and structure: first to last.
struct Entry {
  std::uint16_t first = 0;
  std::uint16_t last = 0;
  std::string_view name;
  ObjectType object = ObjectType::variable;
  DataType type = DataType::none;  // of the VAR, or of each element of the ARRAY; none: a RECORD
  std::uint16_t structure = 0;     // of a RECORD: its DEFSTRUCT (CiA 301, 7.4.1); 0: none
  std::string_view source;  // document, and the clause that defines the object, if there is one
};

// Ordered by index, without overlap. profile: 0 for the objects that are the same in all devices;
// kProfile of a device profile for the objects of that profile alone. Empty for other values.
std::span<const Entry> all(std::uint16_t profile = 0);

// The entry that contains the index; nullptr if there is none.
const Entry* find(std::uint16_t index, std::uint16_t profile = 0);
// Precondition: find(index, profile).
const Entry& at(std::uint16_t index, std::uint16_t profile = 0);

}  // namespace linegate::od::objects

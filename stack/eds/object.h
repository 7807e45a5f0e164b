// SPDX-License-Identifier: Apache-2.0
// The objects of an EDS: those with a section of their own, and those that CompactPDO and modules
// add; private to stack/eds.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>

#include "stack/eds/data_sheet.h"
#include "stack/eds/fields.h"
#include "stack/eds/sections.h"
#include "stack/od/description.h"

namespace linegate::eds {

// State shared by the parts of the reader.
struct Context {
  Report& report;
  std::uint8_t node_id = 0;               // 0: unknown
  bool is_dcf = false;                    // the file configures one device
  bool missing_node_id_reported = false;  // reported only once
  std::size_t expanded = 0;               // bytes that CompactSubObj has added so far
};

// AccessType; an invalid one is reported as a warning and read as ro.
od::Access read_access(const Entry& entry, Report& report);

// ParameterName; the name of the section, with a warning, if it is missing.
std::string read_name(const Fields& fields, Context& context);

// Reads a section that describes a value: a VAR, a sub-index, or the elements of a CompactSubObj.
// Returns nothing if the data type cannot be parsed; that is an error if the section configures a
// value.
std::optional<od::VariableDescription> read_variable(const Section& section, std::uint8_t sub,
                                                     Context& context);

// Sets the variable's value from the entry. A wrong DefaultValue is a warning, because the device
// has its own default; a wrong configured value is an error, because it would be written to the
// device.
void read_value(const Entry& entry, bool configured, od::VariableDescription& variable,
                Context& context);

inline constexpr std::uint8_t kMostElements = 254;  // sub-indices of an object, without 0

// Whether the object has sub-indices of its own: an array, a record or a DEFSTRUCT.
bool has_subs(od::ObjectType type);

// Returns nothing if the object has no value of its own (NULL, data types below 1000h) or its
// description cannot be used; the latter is reported. Precondition: sections.object is not nullptr.
std::optional<od::ObjectDescription> read_object(std::uint16_t index,
                                                 const ObjectSections& sections, Context& context);

// Sub-index 0 of an object whose highest sub-index is value.
od::VariableDescription count_variable(std::uint8_t value, std::uint32_t line);

// Accounts for `count` more elements like pattern. Returns false, after one error for the file, if
// a small text would expand to too much memory.
bool charge(Context& context, const od::VariableDescription& pattern, unsigned count, Place place);

// CompactPDO of CiA 306: PDOs that exist although no section describes them. Completes the PDO
// records of sheet.device if DeviceInfo has a CompactPDO mask. A PDO with only one of its two
// records gets the other one; further PDOs are added, lowest numbers first, up to NrOfRXPDO and
// NrOfTXPDO. Their COB-IDs are those of the predefined connection set; their mappings are empty
// with room for 64 entries.
void add_compact_pdos(const Ini& ini, DataSheet& sheet, Context& context);

// --- modular devices (CiA 306-1, chapter 8) ---------------------------------------------------

// [SupportedModules] and all sections whose names begin with M and a number.
std::vector<Module> read_modules(const Ini& ini,
                                 const std::map<std::uint16_t, ModuleSections>& sections,
                                 Context& context);

// [ConnectedModules]: numbers of modules in the order of their places.
std::vector<std::uint16_t> read_connected_modules(const Ini& ini, Report& report);

// Adds the objects of the connected modules to sheet.device. An object or sub-index that the file
// itself describes takes precedence. Modules without a description are reported.
void connect_modules(const Ini& ini, DataSheet& sheet, Context& context);

}  // namespace linegate::eds

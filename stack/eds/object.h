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

// What the parts of the reader share.
struct Context {
  Report& report;
  std::uint8_t node_id = 0;           // 0: none is known
  bool is_dcf = false;                // the file configures one device
  bool missing_node_id_told = false;  // once is enough
  std::size_t expanded = 0;           // bytes that CompactSubObj made of few lines so far
};

// AccessType; ro, with a warning, if it is none.
od::Access read_access(const Entry& entry, Report& report);

// ParameterName; that of the section, with a warning, if it is missing.
std::string read_name(const Fields& fields, Context& context);

// A section that describes a value: a VAR, a sub-index, or the elements of a CompactSubObj. Nothing
// if the data type cannot be read; that is an error if the section configures a value.
std::optional<od::VariableDescription> read_variable(const Section& section, std::uint8_t sub,
                                                     Context& context);

// Gives variable the value of the entry. A DefaultValue that is wrong is a warning, for the device
// knows its own; a configured value that is wrong is an error, for it would be written.
void read_value(const Entry& entry, bool configured, od::VariableDescription& variable,
                Context& context);

inline constexpr std::uint8_t kMostElements = 254;  // sub-indices of an object, without 0

// Whether the object has sub-indices of its own: an array, a record or a DEFSTRUCT.
bool has_subs(od::ObjectType type);

// Nothing if the object has no value of its own (NULL, data types below 1000h) or its description
// cannot be used; the latter is reported. sections.object must not be nullptr.
std::optional<od::ObjectDescription> read_object(std::uint16_t index,
                                                 const ObjectSections& sections, Context& context);

// Sub-index 0 of an object whose highest sub-index is value.
od::VariableDescription count_variable(std::uint8_t value, std::uint32_t line);

// False, and one error for the file, if count elements more like pattern make too much of too
// little text.
bool charge(Context& context, const od::VariableDescription& pattern, unsigned count, Place place);

// CompactPDO of CiA 306: PDOs that exist although no section describes them. Completes the PDO
// records of sheet.device if DeviceInfo has a CompactPDO mask. A PDO that is described in part gets
// the missing of its two records; beyond that as many are added, lowest numbers first, that there
// are NrOfRXPDO and NrOfTXPDO. COB-IDs are those of the predefined connection set, the mappings are
// empty and have room for 64 entries.
void add_compact_pdos(const Ini& ini, DataSheet& sheet, Context& context);

// --- modular devices (CiA 306-1, chapter 8) ---------------------------------------------------

// [SupportedModules] and all sections that begin with M and a number.
std::vector<Module> read_modules(const Ini& ini,
                                 const std::map<std::uint16_t, ModuleSections>& sections,
                                 Context& context);

// [ConnectedModules]: numbers of modules in the order of their places.
std::vector<std::uint16_t> read_connected_modules(const Ini& ini, Report& report);

// Adds the objects of the connected modules to sheet.device. An object or sub-index that the file
// describes itself counts more. Modules nobody describes are reported.
void connect_modules(const Ini& ini, DataSheet& sheet, Context& context);

}  // namespace linegate::eds

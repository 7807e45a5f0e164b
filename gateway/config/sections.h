// SPDX-License-Identifier: Apache-2.0
// The parts of plant.yaml, each read into its value. Internal to this folder.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "gateway/config/plant.h"
#include "gateway/config/reader.h"
#include "stack/line/line.h"
#include "stack/pdo/parameters.h"

namespace linegate::config {

// Something that can be resolved only when the line's image layout is known.
struct OutputReference {
  std::string text;  // "drive1.Controlword", "drive1.6040:0", "io1.*"
  Place place;
};
struct GroupSection {
  line::OutputGroup group;  // without entries
  std::vector<OutputReference> entries;
  Place place;
};
struct DefaultSection {
  OutputReference entry;
  std::string value;
  Place value_place;
};
struct OutputsSection {
  std::vector<GroupSection> groups;
  std::vector<DefaultSection> defaults;
};

// One element of a device's `bind:`, which can be resolved only when all lines are known.
struct BindingSection {
  std::uint8_t device = 0;
  od::Address object;
  Place object_place;
  std::string line;   // empty = the device's own
  std::string entry;  // as in OutputReference
  Place entry_place;
  bool zero_when_lost = false;
};

// Networks as they are written: "3", "10..19"; in `enter:` also the name of a line, or "all".
struct WrittenNetworks {
  std::string text;
  Place place;
};
// One element of a line's `enter:`.
struct EnterSection {
  std::vector<WrittenNetworks> from;
  bool sdo = false;
  bool write = false;  // sdo: not only reading
  bool emcy = false;
  bool pdo = false;
};
// One element of `routes:`.
struct RouteSection {
  WrittenNetworks to;
  std::string line;
  std::uint8_t gateway = 0;  // node-ID; 0 = the network is the line's own
  std::uint16_t cost = 0;
  Place place;
  Place via_place;
};
// `routing:` and `routes:`.
struct RoutingSection {
  routing::Config common;  // of all lines
  std::vector<RouteSection> routes;
  std::string source;  // what common was read from
};

// One element of `forward:`, as "press.axis.Position -> hall.display.Value".
struct ForwardSection {
  struct End {
    std::string line;
    std::string entry;  // as in OutputReference
    Place place;
  };
  End from;
  End to;
  WhenLost when_lost = WhenLost::hold;
};

// One element of `shared_objects:`: B000h.., which PDOs of the own nodes of all lines may map.
struct SharedObjectSection {
  od::Address object;
  std::string name;
  Place place;
};
// One element of a line's `own_pdos:`.
struct OwnPdoSection {
  bool transmit = false;
  pdo::Parameters parameters;  // without lengths in the mapping
  std::vector<Place> mapped;   // of each object of the mapping
  Place place;
};

// One element of a line's `own_values:`, or of the concise DCF that `own_concise_dcf:` names.
struct OwnValueSection {
  od::Address object;
  std::optional<std::string> text{};  // of the file: data
  std::vector<std::byte> data{};
  Place place;
  Place value_place;
};

// Where a node is configured: its element of `nodes:`, or `node_list:`.
struct NodePlace {
  std::uint8_t node = 0;
  Place place;
};

class JoinedLines;

// One element of `lines:`. places of what other lines may collide with.
struct LineSection {
  LinePlan plan;
  OutputsSection outputs;
  std::vector<BindingSection> bindings;
  std::vector<EnterSection> enter;
  std::vector<OwnPdoSection> own_pdos;
  std::vector<OwnValueSection> own_values;
  std::vector<NodePlace> node_places;
  std::vector<WrittenNetworks> emcy_to;
  std::vector<std::uint8_t> gateways;  // node-IDs
  Place place;
  Place interface_place;
  Place network_place;
  Place executor_place;
  Place record_place;
  Place enter_place;
  Place emcy_place;
  Place gateways_place;
};

// Whether the line has one node of its own, with the dictionary of a manager: a manager, and a line
// in the role device without `devices:`, whose node obeys another master. Once devices were read.
inline bool has_own_node(const line::LineConfig& config) {
  return config.role != line::Role::observer && config.devices.empty();
}
// `lss:`. The role is known.
void read_lss(Section& line, line::LineConfig& config);
LineSection read_line(Findings& findings, const YAML::Node& node);
// `interface:`, with the log of a replay looked through.
Interface read_interface(Section& line, const YAML::Node& node);
// `record:`; place: of the file's name.
// strict_ixxat, keep_operational and canopenia_base of a line.
void read_diagnosis(Section& section, line::LineConfig& config);
std::optional<Record> read_record(Section& line, Place& place);
// One element of `nodes:`, with its device file and everything written to the node.
line::NodeConfig read_node(Findings& findings, const YAML::Node& node);
// What of a node concerns its boot process.
void read_boot(Section& section, line::NodeConfig& config);
// `startup:`, after the nodes and the role.
void read_startup(Section& section, line::LineConfig& config);
// Its device file, from `eds` or `dcf`; true if it could be read. what: "a node".
bool read_device_file(Section& section, line::NodeConfig& config, std::string_view what);
// `devices:`, for the role device; and what a line with them does not have.
void read_devices(Section& section, LineSection& line);
// `bind:` of a device.
void read_bindings(Findings& findings, const YAML::Node& node, std::uint8_t device,
                   std::vector<BindingSection>& bindings);
// `forward:`, the rules of PDO forwarding between lines.
std::vector<ForwardSection> read_forwards(Findings& findings, const YAML::Node& node);
// Once all lines are complete: what is bound, what is forwarded.
void resolve_bindings(Findings& findings, JoinedLines& lines);
void resolve_forwards(Findings& findings, const std::vector<ForwardSection>& rules,
                      JoinedLines& lines);
std::vector<EnterSection> read_enter(Findings& findings, const YAML::Node& node);
// `emcy_to:` and `gateways:` of a line.
void read_emcy_routing(Section& section, LineSection& line);
RoutingSection read_routing(Findings& findings, const YAML::Node& routing,
                            const YAML::Node& routes);
// Once all lines are known: LineConfig::routing of those that take part, which are all managers'
// lines if there is a route or a line may be entered.
void resolve_routing(Findings& findings, const RoutingSection& routing,
                     std::vector<LineSection>& lines);
// The nodes of a network of a nodelist.cpj (CiA 306-3), from `node_list:`; none if it is not
// defined.
std::vector<line::NodeConfig> read_node_list(Findings& findings, const YAML::Node& node);
// A device file (EDS, DCF, XDD, XDC), with what it names as DownloadFile. What is wrong in it is
// told there, and at `place`, which names it.
std::optional<od::DeviceDescription> load_device(Findings& findings, const std::string& path,
                                                 std::uint8_t node_id, Place place);
// The content, which counts among the sources of the findings. Nothing, and an error at `place`, if
// there is no such file or it cannot be read to its end.
std::optional<std::string> read_file(Findings& findings, const std::string& path, Place place);
// `auto:` of a line whose nodes have been read.
void read_auto(Section& section, LinePlan& plan);
// A key of `pdos:` or `own_pdos:`.
struct PdoName {
  bool transmit = false;  // TPDO
  std::uint16_t number = 0;

  std::uint16_t communication() const {
    return static_cast<std::uint16_t>((transmit ? 0x1800 : 0x1400) + number - 1);
  }
  std::uint16_t mapping() const { return static_cast<std::uint16_t>(communication() + 0x200); }
};
std::optional<PdoName> parse_pdo_name(const std::string& text);
// `every:` and `queue:` of a PDO or of all of a line: how many receptions wait at the most, 0 =
// only the newest values are published; nothing if `every:` is not there.
std::optional<std::uint32_t> read_pdo_queue(Section& section);
// Its `type:`; what is none is told.
std::optional<std::uint8_t> read_transmission_type(Section& section, const YAML::Node& node);
// `feeds_every_tpdo:` of a line.
void read_feeds_every_tpdo(Section& section, LineSection& line);
// `mpdo_scanner:` and `mpdo_dispatcher:` of a line, once its own objects are known.
void read_mpdo_lists(Section& section, line::LineConfig& config);
// `own_objects:` of a line, once its role, devices and storage are known.
void read_own_objects(Section& section, line::LineConfig& config);
// `own_values:` and `own_concise_dcf:` of a line, once its role and devices are known. Those that
// put SYNC, TIME and EMCY on other identifiers are in config at once, for the line is made before
// the others are resolved.
std::vector<OwnValueSection> read_own_values(Section& section, line::LineConfig& config);
// Once all lines are complete: LineConfig::own_values.
void resolve_own_values(Findings& findings, std::vector<LineSection>& lines);
// `own_pdos:` of a line.
std::vector<OwnPdoSection> read_own_pdos(Findings& findings, const YAML::Node& node);
// `shared_objects:`, with their places.
std::vector<SharedObjectSection> read_shared_objects(Findings& findings, const YAML::Node& node);
// Once all lines are complete: LineConfig::forwarding, and what is forwarded so. Before the rules,
// which take the objects that are left.
void resolve_shared_objects(Findings& findings, const std::vector<SharedObjectSection>& objects,
                            JoinedLines& lines);
// `restore:`, `store:`, `concise_dcf:` and `program:` of a node; has_device: its device file has
// been read.
void read_configuration(Section& section, bool has_device, line::NodeConfig& config);
// `objects:` and `pdos:` of a node whose device file has been read.
void read_objects(Findings& findings, const YAML::Node& node, line::NodeConfig& config);
void read_pdos(Findings& findings, const YAML::Node& node, line::NodeConfig& config);
OutputsSection read_outputs(Findings& findings, const YAML::Node& node);

// Makes the line, and tells what is to be said of it; nullptr if it cannot be made. What concerns
// the device file of a node as a whole, such as a PDO on the COB-ID of something else, is told at
// the node, with the name of the file.
std::unique_ptr<line::Line> make_line(Findings& findings, const LineSection& section);
// Makes the line once to learn its layout; fills groups and defaults of its plan.
void resolve_outputs(Findings& findings, LineSection& section);

// 1 to kMostOfName letters, digits, '-' and '_'.
constexpr std::size_t kMostOfName = 64;
bool is_name(const std::string& name);
// The same; reports what is none.
bool check_name(Findings& findings, const std::string& name, Place place, std::string_view what);

}  // namespace linegate::config

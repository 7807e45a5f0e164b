// SPDX-License-Identifier: Apache-2.0
// The sections of plant.yaml and the functions that read them. Internal to this folder.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "gateway/config/plant.h"
#include "gateway/config/reader.h"
#include "stack/line/line.h"
#include "stack/od/objects.h"
#include "stack/pdo/parameters.h"

namespace linegate::config {

// An output that can be resolved only when the line's image layout is known.
struct OutputReference {
  std::string text;  // "drive1.Controlword", "drive1.6040:0", "io1.*"
  Place place;
};
struct GroupSection {
  line::OutputGroup group;  // its entries are not resolved yet
  std::vector<OutputReference> entries;
  Place place;
  bool by_name = false;  // written_by: named
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

// One element of a device's `bind:`, resolved when all lines are known.
struct BindingSection {
  std::uint8_t device = 0;
  od::Address object;
  Place object_place;
  std::string line;   // empty = the line of the device
  std::string entry;  // in the syntax of OutputReference
  Place entry_place;
  bool zero_when_lost = false;
};

// Networks as written: "3", "10..19"; in `enter:` also the name of a line, or "all".
struct WrittenNetworks {
  std::string text;
  Place place;
};
// One element of a line's `enter:`.
struct EnterSection {
  std::vector<WrittenNetworks> from;
  bool sdo = false;
  bool write = false;  // sdo: write access, too
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
  // Over another gateway: `line` and `gateway` are not used.
  std::optional<routing::GatewayWay> way{};
  bool emcy = false;  // EMCYs of its networks are received
};
// `routing:` and `routes:`.
struct RoutingSection {
  routing::Config common;  // applies to all lines
  std::vector<RouteSection> routes;
  std::string source;  // the text that `common` was read from
};

// One element of `forward:`, as "press.axis.Position -> hall.display.Value".
struct ForwardSection {
  struct End {
    std::string line;
    std::string entry;  // in the syntax of OutputReference
    Place place;
    std::string text;  // as written
  };
  End from;
  End to;
  WhenLost when_lost = WhenLost::hold;
  // Of a source in another gateway
  std::uint8_t reactions = line::kHoldOutputs;  // line::WatchdogReaction
  std::optional<Duration> timeout{};
  std::vector<std::string> reaction_words{};
  Place when_lost_place{};
  Place timeout_place{};
};

// One element of `shared_objects:`: objects from B000h on that PDOs of the own nodes of all lines
// may map.
struct SharedObjectSection {
  od::Address object;
  std::string name;
  Place place;
};
// One element of a line's `own_pdos:`.
struct OwnPdoSection {
  bool transmit = false;
  pdo::Parameters parameters;  // the lengths in its mapping are not set yet
  std::vector<Place> mapped;   // position of each mapped object
  Place place;
};

// One element of a line's `own_values:`, or of the concise DCF that `own_concise_dcf:` names.
struct OwnValueSection {
  od::Address object;
  std::optional<std::string> text{};  // data from a file
  std::vector<std::byte> data{};
  Place place;
  Place value_place;
};

// The position of a node: its element of `nodes:`, or `node_list:`.
struct NodePlace {
  std::uint8_t node = 0;
  Place place;
};

class JoinedLines;

// `history:` of a line. The text of an entry is in the syntax of EntryNames::find().
struct HistorySection {
  struct Entry {
    std::string text;
    Place place;
  };
  std::vector<Entry> entries;
  Place place;
};

// `named:` of a line. The text of an entry is in the syntax of EntryNames::find().
struct NamedSection {
  struct Alias {
    std::string entry;
    std::string identifier;
    Place place;
  };
  std::vector<Alias> aliases;
  Place place;
  Place ros2_place;
  Place described_place;
};

// One element of `lines:`, with the positions of keys that can conflict with other lines.
struct LineSection {
  LinePlan plan;
  OutputsSection outputs;
  HistorySection history;
  NamedSection named;
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
  Place clients_place;
};

// Whether the line has one own node with the dictionary of a manager: a manager, or a line in the
// role device without `devices:`, whose node obeys another master. Call it after devices were read.
inline bool has_own_node(const line::LineConfig& config) {
  return config.role != line::Role::observer && config.devices.empty();
}
// `lss:`. Precondition: the role was read.
void read_lss(Section& line, line::LineConfig& config);
// `flying_master:`. Precondition: the role was read.
void read_flying_master(Section& line, line::LineConfig& config);
// `sleep:` of a line.
void read_sleep(Section& line, line::LineConfig& config);
LineSection read_line(Findings& findings, const YAML::Node& node);
// `interface:`; the log of a replay is checked.
// canopen_fd, data_bit_rate, usdo_abort, emcy_fd.
void read_canopen_fd(Section& section, LinePlan& plan);
Interface read_interface(Section& line, const YAML::Node& node);
// `strict_ixxat`, `keep_operational` and `canopenia_base` of a line.
void read_diagnosis(Section& section, line::LineConfig& config);
// `sdo_connections:`. Precondition: the role was read.
void read_connections(Section& line, line::LineConfig& config);
std::optional<Record> read_record(Section& line, Place& place);

// A size in bytes, at least `smallest`. target is unchanged if there is none, or an invalid one.
void read_size(Section& section, const YAML::Node& node, std::uint64_t smallest,
               std::uint64_t& target);

// `history:` of a line; resolve_history() finds its entries in the layouts of the line.
HistorySection read_history(Section& line, History& history);
void resolve_history(Findings& findings, const HistorySection& section, const line::Line& made,
                     LinePlan& plan);
// `named:` of a line; resolve_named() finds the entries of its aliases in the layouts of the line,
// and reports identifiers that collide.
NamedSection read_named(Section& line, NamedTopics& named);
void resolve_named(Findings& findings, const NamedSection& section, const line::Line& made,
                   LinePlan& plan);
// `journal:` of the gateway.
std::optional<Journal> read_journal(Findings& findings, const YAML::Node& node);
// One element of `nodes:`, with its device file and all values written to the node.
line::NodeConfig read_node(Findings& findings, const YAML::Node& node, std::size_t longest_pdo);
// The keys of a node that concern its boot process.
void read_boot(Section& section, line::NodeConfig& config);
// `startup:`. Precondition: nodes and role were read.
void read_startup(Section& section, line::LineConfig& config);
// The device file of a node from `eds` or `dcf`. Returns true if it could be read. what: "a node".
bool read_device_file(Section& section, line::NodeConfig& config, std::string_view what);
// `devices:`, for the role device; reports keys that a line with devices cannot have.
void read_devices(Section& section, LineSection& line);
// `bind:` of a device.
void read_bindings(Findings& findings, const YAML::Node& node, std::uint8_t device,
                   std::vector<BindingSection>& bindings);
// `forward:`: the rules of PDO forwarding between lines.
std::vector<ForwardSection> read_forwards(Findings& findings, const YAML::Node& node);
// Resolves bindings and forwarding rules once all lines are complete.
void resolve_bindings(Findings& findings, JoinedLines& lines);
// plant: the gateway and its DDS, for rules with a source in another gateway.
void resolve_forwards(Findings& findings, const Plant& plant,
                      const std::vector<ForwardSection>& rules, JoinedLines& lines);
std::vector<EnterSection> read_enter(Findings& findings, const YAML::Node& node);
// `emcy_to:` and `gateways:` of a line.
void read_emcy_routing(Section& section, LineSection& line);
RoutingSection read_routing(Findings& findings, const YAML::Node& routing,
                            const YAML::Node& routes);
// Sets LineConfig::routing of the participating lines once all lines are known: all managers' lines
// if there is a route or a line may be entered.
void resolve_routing(Findings& findings, const RoutingSection& routing, const Plant& plant,
                     std::vector<LineSection>& lines);
// `node_list:`: the nodes of one network of a nodelist.cpj (CiA 306-3); empty without the key.
std::vector<line::NodeConfig> read_node_list(Findings& findings, const YAML::Node& node);
// Loads a device file (EDS, DCF, XDD, XDC) with its DownloadFiles. Reports errors there, and at
// `place`, which names it.
std::optional<od::DeviceDescription> load_device(Findings& findings, const std::string& path,
                                                 std::uint8_t node_id, Place place);
// Reads a file, which is added to the sources of the findings. Nothing, after an error at `place`,
// if it does not exist or cannot be read completely.
std::optional<std::string> read_file(Findings& findings, const std::string& path, Place place);
// `auto:` of a line. Precondition: its nodes were read.
void read_auto(Section& section, LinePlan& plan);
// A key of `pdos:` or `own_pdos:`.
struct PdoName {
  bool transmit = false;  // TPDO
  std::uint16_t number = 0;

  std::uint16_t communication() const {
    return static_cast<std::uint16_t>(
        (transmit ? od::objects::kTpdoCommunication : od::objects::kRpdoCommunication) + number -
        1);
  }
  std::uint16_t mapping() const { return static_cast<std::uint16_t>(communication() + 0x200); }
};
std::optional<PdoName> parse_pdo_name(const std::string& text);
// `every:` and `queue:` of a PDO or of all PDOs of a line: largest number of waiting receptions, 0
// = publish only the newest values; nothing without `every:`.
std::optional<std::uint32_t> read_pdo_queue(Section& section);
// `type:` of a PDO; reports an invalid one.
std::optional<std::uint8_t> read_transmission_type(Section& section, const YAML::Node& node);
// `feeds_every_tpdo:` of a line.
void read_feeds_every_tpdo(Section& section, LineSection& line);
// `mpdo_scanner:` and `mpdo_dispatcher:` of a line. Precondition: its own objects were read.
void read_mpdo_lists(Section& section, line::LineConfig& config);
// `own_objects:` of a line. Precondition: role, devices and storage were read.
void read_own_objects(Section& section, line::LineConfig& config);
// `own_values:` and `own_concise_dcf:` of a line. Precondition: role and devices were read. Values
// that move SYNC, TIME and EMCY to other COB-IDs are put into config at once, because the line is
// made before the others are resolved.
std::vector<OwnValueSection> read_own_values(Section& section, line::LineConfig& config);
// Sets LineConfig::own_values once all lines are complete.
void resolve_own_values(Findings& findings, std::vector<LineSection>& lines);
// `own_pdos:` of a line.
std::vector<OwnPdoSection> read_own_pdos(Findings& findings, const YAML::Node& node);
// `shared_objects:`, with their positions.
std::vector<SharedObjectSection> read_shared_objects(Findings& findings, const YAML::Node& node);
// Sets LineConfig::forwarding once all lines are complete. Call it before the rules of `forward:`,
// which use the remaining objects.
void resolve_shared_objects(Findings& findings, const std::vector<SharedObjectSection>& objects,
                            JoinedLines& lines);
// `restore:`, `store:`, `concise_dcf:` and `program:` of a node; has_device: its device file was
// read.
void read_configuration(Section& section, bool has_device, line::NodeConfig& config);
// `objects:`, `pdos:` and `srdo:` of a node. Precondition: its device file was read.
void read_objects(Findings& findings, const YAML::Node& node, line::NodeConfig& config);
void read_pdos(Findings& findings, const YAML::Node& node, line::NodeConfig& config,
               std::size_t longest_pdo);
// Returns the numbers of the SRDOs that it writes.
std::set<std::uint8_t> read_srdos(Findings& findings, const YAML::Node& node,
                                  line::NodeConfig& config);
// Sets 13FFh of these SRDOs, whose signature in the device file is that of other parameters. Call
// it after read_objects(), which may write others of their parameters, or 13FFh itself.
void sign_srdos(const std::set<std::uint8_t>& written, line::NodeConfig& config);
// `values:` of a node or device: alias, unit, scaling and limits of its objects. Precondition: its
// device file was read.
void read_values(Findings& findings, const YAML::Node& node, od::DeviceDescription& device);
// `unit`, `scale` and `offset` of an object whose type is set. what: names the object in messages.
void read_scaling(Section& section, std::string_view what, od::VariableDescription& variable);
// `low` and `high`, in the unit of the object. Precondition: its scaling was read.
void read_scaled_limits(Section& section, std::string_view what, od::VariableDescription& variable);
OutputsSection read_outputs(Findings& findings, const YAML::Node& node);

// Makes the line and reports its diagnostics; nullptr if it cannot be made. A diagnostic about a
// whole device file, such as a PDO on the COB-ID of another service, is reported at the node, with
// the name of the file.
std::unique_ptr<line::Line> make_line(Findings& findings, const LineSection& section);
// Makes the line once to get its layout; sets groups and defaults of its plan.
void resolve_outputs(Findings& findings, LineSection& section);

// 1 to kMostOfName letters, digits, '-' and '_'.
constexpr std::size_t kMostOfName = 64;
bool is_name(const std::string& name);
// Reports a name that is not of that form.
bool check_name(Findings& findings, const std::string& name, Place place, std::string_view what);
// Reports a name of a line that is not of that form, or has another meaning in commands: numbers
// are network-IDs, `all` and `own` are nodes, and what begins with '-' is an option.
bool check_line_name(Findings& findings, const std::string& name, Place place);
// Of a node: in commands (LINE:NODE) `all`, `own` and digits have another meaning.
bool is_node_name(const std::string& name);
bool check_node_name(Findings& findings, const std::string& name, Place place);

}  // namespace linegate::config

// The parts of plant.yaml, each read into its value. Internal to this folder.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include <yaml-cpp/yaml.h>

#include "gateway/config/plant.h"
#include "gateway/config/reader.h"

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

// One element of `lines:`. places of what other lines may collide with.
struct LineSection {
  LinePlan plan;
  OutputsSection outputs;
  Place place;
  Place interface_place;
  Place network_place;
  Place executor_place;
  Place record_place;
};

LineSection read_line(Findings& findings, const YAML::Node& node);
// `interface:`, with the log of a replay looked through.
Interface read_interface(Section& line, const YAML::Node& node);
// `record:`; place: of the file's name.
std::optional<Record> read_record(Section& line, Place& place);
// One element of `nodes:`, with its device file and everything written to the node.
line::NodeConfig read_node(Findings& findings, const YAML::Node& node);
// The nodes of a network of a nodelist.cpj (CiA 306-3), from `node_list:`; none if it is not
// defined.
std::vector<line::NodeConfig> read_node_list(Findings& findings, const YAML::Node& node);
// A device file (EDS, DCF, XDD, XDC), with what it names as DownloadFile. What is wrong in it is
// told there, and at `place`, which names it.
std::optional<od::DeviceDescription> load_device(Findings& findings, const std::string& path,
                                                 std::uint8_t node_id, Place place);
// The content, which counts among the sources of the findings; nothing if there is no such file.
std::optional<std::string> read_file(Findings& findings, const std::string& path);
// `objects:` and `pdos:` of a node whose device file has been read.
void read_objects(Findings& findings, const YAML::Node& node, line::NodeConfig& config);
void read_pdos(Findings& findings, const YAML::Node& node, line::NodeConfig& config);
OutputsSection read_outputs(Findings& findings, const YAML::Node& node);

// Makes the line once to learn its layout; fills groups and defaults of plan.config.
void resolve_outputs(Findings& findings, const OutputsSection& outputs, LinePlan& plan);

// 1 to 64 letters, digits, '-' and '_'.
bool is_name(const std::string& name);
// The same; reports what is none.
bool check_name(Findings& findings, const std::string& name, Place place, std::string_view what);

}  // namespace linegate::config

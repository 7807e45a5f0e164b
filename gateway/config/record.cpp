// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <system_error>

#include "gateway/config/sections.h"

namespace linegate::config {
namespace {

constexpr std::uint64_t kSmallest = 1000;
constexpr std::uint64_t kMostFiles = 10'000;

void read_file_name(Section& section, const YAML::Node& node, Record& record) {
  const auto text = section.text(node);
  if (!text) {
    return;
  }
  const auto path =
      (std::filesystem::path(section.findings().file()).parent_path() / *text).lexically_normal();
  const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  // A warning, because the line runs without its recording too, and the folder may appear later.
  std::error_code ignored;
  if (std::filesystem::is_directory(path, ignored)) {
    section.findings().warning(place_of(node), "nothing is recorded: " + path.string() +
                                                   " is a folder, record needs the name of a file");
  } else if (!std::filesystem::is_directory(folder, ignored)) {
    section.findings().warning(place_of(node),
                               "nothing is recorded until there is a folder " + folder.string());
  }
  record.file = path.string();
}

}  // namespace

void read_size(Section& section, const YAML::Node& node, std::uint64_t smallest,
               std::uint64_t& target) {
  const auto text = section.text(node);
  if (!text) {
    return;
  }
  const auto size = parse_size(*text);
  if (size && *size >= smallest) {
    target = *size;
  } else {
    section.findings().error(place_of(node), "expected a size from " + format_size(smallest) +
                                                 " such as 100MB, got \"" + *text + "\"");
  }
}

std::optional<Record> read_record(Section& line, Place& place) {
  const YAML::Node node = line.find("record");
  place = place_of(node);
  if (!node.IsDefined()) {
    return std::nullopt;
  }
  Record record;
  if (!node.IsMap()) {
    read_file_name(line, node, record);
    return record;
  }
  Section section(line.findings(), node, "record");
  const YAML::Node file = section.require("file");
  if (file.IsDefined()) {
    place = place_of(file);
  }
  read_file_name(section, file, record);
  read_size(section, section.find("max_size"), kSmallest, record.max_size);
  section.read_number("files", record.files, 1, kMostFiles);
  section.done();
  return record;
}

}  // namespace linegate::config

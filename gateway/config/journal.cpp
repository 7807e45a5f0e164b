// SPDX-License-Identifier: Apache-2.0
#include <filesystem>
#include <system_error>

#include "gateway/config/sections.h"
#include "gateway/config/value.h"

namespace linegate::config {
namespace {

constexpr std::uint64_t kSmallestJournal = 10'000'000;
constexpr std::uint64_t kSmallestHistory = 1'000'000;

// A warning, because the gateway runs without its journal too, and the folder may appear later.
void read_journal_file(Section& section, Journal& journal) {
  const YAML::Node node = section.require("file");
  const auto text = section.text(node);
  if (!text) {
    return;
  }
  const auto path =
      (std::filesystem::path(section.findings().file()).parent_path() / *text).lexically_normal();
  const auto folder = path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
  std::error_code ignored;
  if (text->empty() || std::filesystem::is_directory(path, ignored)) {
    section.findings().error(place_of(node), "journal needs the name of a file, not \"" + *text +
                                                 "\", such as /var/lib/linegate/journal.db");
  } else if (!std::filesystem::is_directory(folder, ignored)) {
    section.findings().warning(place_of(node),
                               "no event is stored until there is a folder " + folder.string());
  }
  journal.file = path.string();
}

}  // namespace

std::optional<Journal> read_journal(Findings& findings, const YAML::Node& node) {
  if (!node.IsDefined()) {
    return std::nullopt;
  }
  Journal journal;
  Section section(findings, node, "journal");
  read_journal_file(section, journal);
  read_size(section, section.find("max_size"), kSmallestJournal, journal.max_size);
  read_size(section, section.find("values_size"), kSmallestHistory, journal.values_size);
  const YAML::Node age = section.find("max_age");
  if (const auto text = section.text(age)) {
    const auto parsed = parse_age(*text);
    if (!parsed) {
      findings.error(place_of(age),
                     "expected an age from 1min such as 90d or 36h, got \"" + *text + "\"");
    }
    journal.max_age = parsed.value_or(Duration{});
  }
  section.done();
  return journal;
}

}  // namespace linegate::config

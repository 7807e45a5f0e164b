// SPDX-License-Identifier: Apache-2.0
#include "gateway/config/concise_file.h"

#include <filesystem>
#include <span>
#include <utility>

#include "gateway/config/sections.h"

namespace linegate::config {

std::vector<manager::ObjectWrite> read_concise_file(Findings& findings, const Place& place,
                                                    const std::string& name) {
  const auto path =
      (std::filesystem::path(findings.file()).parent_path() / name).lexically_normal().string();
  const auto content = read_file(findings, path, place);
  if (!content) {
    return {};
  }
  auto writes = manager::read_concise_dcf(std::as_bytes(std::span(*content)));
  if (!writes.ok()) {
    findings.error(place, path + " is no concise DCF: its " + std::to_string(content->size()) +
                              " bytes do not match its count and sizes");
    return {};
  }
  return *std::move(writes);
}

}  // namespace linegate::config

// SPDX-License-Identifier: Apache-2.0
// Device files named by plant.yaml and node lists.
#include <filesystem>
#include <span>

#include "bridges/xdd/xdd.h"
#include "gateway/config/data_sheet.h"
#include "gateway/config/sections.h"
#include "gateway/config/source.h"
#include "gateway/config/whole_file.h"
#include "stack/eds/reader.h"

namespace linegate::config {
namespace {

// The content, which is added to the sources of the findings, or an error.
std::optional<std::string> content_of(const std::filesystem::path& path, Findings& findings,
                                      std::string& why) {
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    why = "there is no file " + path.string();
    return std::nullopt;
  }
  auto content = whole_file(path, why);
  if (content) {
    findings.add_source(file_source(path.string(), *content));
  } else {
    why = path.string() + " " + why;
  }
  return content;
}

// Makes the content of a DownloadFile the configured value. Returns false if that is not possible.
bool read_download(od::VariableDescription& variable, const std::filesystem::path& device_file,
                   Findings& findings) {
  const auto path = (device_file.parent_path() / variable.notes.download_file).lexically_normal();
  const auto fail = [&](const std::string& text) {
    findings.add({{Severity::error, device_file.string(), variable.line, 0, text}});
    return false;
  };
  std::string why;
  const auto content = content_of(path, findings, why);
  if (!content) {
    return fail("DownloadFile: " + why);
  }
  const unsigned size = od::byte_size(variable.type);
  if (size != 0 && content->size() != size) {
    return fail("DownloadFile: " + path.string() + " has " + std::to_string(content->size()) +
                " bytes, " + std::string(od::name(variable.type)) + " has " + std::to_string(size));
  }
  const auto bytes = std::as_bytes(std::span(*content));
  variable.value.assign(bytes.begin(), bytes.end());
  variable.configured = true;
  return true;
}

bool read_downloads(od::DeviceDescription& device, const std::filesystem::path& device_file,
                    Findings& findings) {
  bool ok = true;
  for (od::ObjectDescription& object : device.objects) {
    for (od::VariableDescription& variable : object.variables) {
      if (!variable.notes.download_file.empty() && !variable.configured) {
        ok = read_download(variable, device_file, findings) && ok;
      }
    }
  }
  return ok;
}

Loaded<eds::DataSheet> parse_sheet(const std::string& content, const std::string& path,
                                   std::uint8_t node_id) {
  return xdd::is_xdd(path) ? xdd::read(content, path, node_id) : eds::read(content, path, node_id);
}

}  // namespace

std::optional<eds::DataSheet> load_sheet(const std::string& path, std::uint8_t node_id) {
  const auto content = whole_file(path);
  return content ? parse_sheet(*content, path, node_id).value : std::nullopt;
}

std::optional<std::string> read_file(Findings& findings, const std::string& path, Place place) {
  std::string why;
  auto content = content_of(path, findings, why);
  if (!content) {
    findings.error(place, why);
  }
  return content;
}

std::optional<od::DeviceDescription> load_device(Findings& findings, const std::string& path,
                                                 std::uint8_t node_id, Place place) {
  const auto content = read_file(findings, path, place);
  if (!content) {
    return std::nullopt;
  }
  auto loaded = parse_sheet(*content, path, node_id);
  findings.add(std::move(loaded.diagnostics));
  if (!loaded.value || !read_downloads(loaded.value->device, path, findings)) {
    findings.error(place, "the device file " + path + " has errors");
    return std::nullopt;
  }
  return std::move(loaded.value->device);
}

}  // namespace linegate::config

#include "bridges/console/output_text.h"

#include <array>
#include <string_view>

#include "bridges/console/table.h"
#include "stack/base/byte_order.h"
#include "stack/line/command.h"

namespace linegate::console {
namespace {

constexpr std::size_t kMostNames = 3;  // of entries in one sentence

std::string list_of(const std::vector<std::string>& names) {
  std::string out;
  for (std::size_t i = 0; i < names.size() && i < kMostNames; ++i) {
    out += (i == 0 ? "" : ", ") + names[i];
  }
  if (names.size() > kMostNames) {
    out += " and " + std::to_string(names.size() - kMostNames) + " more";
  }
  return out;
}

std::string name_in(const image::Layout* outputs, std::uint32_t entry) {
  return outputs != nullptr && entry < outputs->entries.size()
             ? printable(outputs->entries[entry].name)
             : "entry " + std::to_string(entry);
}

}  // namespace

std::string way_text(const std::vector<std::byte>& data, const image::Layout* outputs) {
  constexpr std::size_t kLength = 4;
  constexpr std::array<std::string_view, line::kPdoWaits> kWaits{
      "", "update time", "values that were never written", "own node operational", "trigger"};
  if (data.size() < kLength || data[0] != std::byte{line::kByPdo}) {
    return data.empty() ? "" : "by SDO";
  }
  std::string out = "by PDO " + std::to_string(load_le<std::uint16_t>(data.data() + 1));
  const auto wait = std::to_integer<std::size_t>(data[3]);
  std::vector<std::string> names;
  for (std::size_t i = kLength; i + sizeof(std::uint32_t) <= data.size();
       i += sizeof(std::uint32_t)) {
    names.push_back(name_in(outputs, load_le<std::uint32_t>(data.data() + i)));
  }
  if (!names.empty()) {
    return out + ", which waits for: values that were never written: " + list_of(names);
  }
  const std::string_view words = wait < kWaits.size() ? kWaits[wait] : "unknown";
  return words.empty() ? out : out + ", which waits for: " + std::string(words);
}

}  // namespace linegate::console

// SPDX-License-Identifier: Apache-2.0
#include "bridges/xdd/document.h"

#include <algorithm>

#include "stack/eds/text.h"

namespace linegate::xdd {
namespace {

bool is_space(char c) {
  return c == ' ' || c == '\t' || c == '\r' || c == '\n';
}

// Position of the attribute of that name in the start tag at `at`; `at` if it is not found.
std::size_t find_attribute(std::string_view text, std::size_t at, std::string_view name) {
  char quote = 0;
  for (std::size_t i = at; i < text.size(); ++i) {
    if (quote != 0) {
      quote = text[i] == quote ? '\0' : quote;
      continue;
    }
    if (text[i] == '"' || text[i] == '\'') {
      quote = text[i];
    } else if (text[i] == '>') {
      break;
    } else if (is_space(text[i]) && text.substr(i + 1).starts_with(name)) {
      const std::string_view behind = text.substr(i + 1 + name.size(), 1);
      if (behind == "=" || (!behind.empty() && is_space(behind.front()))) {
        return i + 1;
      }
    }
  }
  return at;
}

}  // namespace

std::string_view local_name(pugi::xml_node node) {
  const std::string_view name = node.name();
  const std::size_t colon = name.find(':');
  return colon == std::string_view::npos ? name : name.substr(colon + 1);
}

pugi::xml_node child(pugi::xml_node node, std::string_view name) {
  return node.find_child([name](pugi::xml_node c) { return local_name(c) == name; });
}

std::vector<pugi::xml_node> children(pugi::xml_node node, std::string_view name) {
  std::vector<pugi::xml_node> out;
  for (const pugi::xml_node c : node.children()) {
    if (local_name(c) == name) {
      out.push_back(c);
    }
  }
  return out;
}

Document::Document(std::string_view text, eds::Report& report) {
  if (text.starts_with("\xFF\xFE") || text.starts_with("\xFE\xFF")) {
    report.error({}, "the file is UTF-16; it must be UTF-8 or Latin-1");
    return;
  }
  if (text.starts_with("\xEF\xBB\xBF")) {
    text.remove_prefix(3);
  }
  text_ = eds::to_utf8(text);
  line_begins_.push_back(0);
  for (std::size_t i = 0; i < text_.size(); ++i) {
    if (text_[i] == '\n' || (text_[i] == '\r' && text_.compare(i + 1, 1, "\n") != 0)) {
      line_begins_.push_back(i + 1);
    }
  }
  const pugi::xml_parse_result result =
      document_.load_buffer(text_.data(), text_.size(), pugi::parse_default, pugi::encoding_utf8);
  if (!result) {
    report.error(place_at(static_cast<std::size_t>(result.offset)),
                 std::string("this is no XML: ") + result.description());
    document_.reset();
  }
}

eds::Place Document::place(pugi::xml_node node) const {
  return place_at(static_cast<std::size_t>(std::max<std::ptrdiff_t>(node.offset_debug(), 0)));
}

eds::Place Document::place(pugi::xml_node node, std::string_view attribute) const {
  const auto begin = static_cast<std::size_t>(std::max<std::ptrdiff_t>(node.offset_debug(), 0));
  return place_at(find_attribute(text_, begin, attribute));
}

eds::Place Document::place_at(std::size_t offset) const {
  const auto next = std::upper_bound(line_begins_.begin(), line_begins_.end(), offset);
  const auto line = static_cast<std::uint32_t>(next - line_begins_.begin());
  return {line, static_cast<std::uint32_t>(offset - *(next - 1) + 1)};
}

}  // namespace linegate::xdd

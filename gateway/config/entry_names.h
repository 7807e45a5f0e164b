// SPDX-License-Identifier: Apache-2.0
// Entries of an image by the names people give them. Internal to this folder.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stack/image/layout.h"
#include "stack/line/config.h"

namespace linegate::config {

// Of one direction of one line; both must outlive it.
class EntryNames {
 public:
  EntryNames(const line::LineConfig& config, const image::Layout& layout)
      : config_(config), layout_(layout) {}

  // Entry numbers; empty if there is none. text: the entry's name, "node.index:sub" or, for
  // several, "node.*". An object that is mapped several times gives all of its entries.
  std::vector<std::uint32_t> find(const std::string& text, bool several) const;
  // Of a text that stands for several entries, where one is meant: "... is ambiguous: ...", or
  // nothing.
  std::string ambiguity(const std::string& text) const;
  // "; did you mean ...?", or nothing.
  std::string suggestion(const std::string& text) const;

 private:
  std::optional<std::uint8_t> node_id(const std::string& name) const;

  const line::LineConfig& config_;
  const image::Layout& layout_;
};

}  // namespace linegate::config

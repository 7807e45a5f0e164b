// SPDX-License-Identifier: Apache-2.0
// Finds image entries by name. Internal to this folder.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "stack/image/layout.h"
#include "stack/line/config.h"

namespace linegate::config {

// Names of one direction of one line. Both must outlive this object.
class EntryNames {
 public:
  EntryNames(const line::LineConfig& config, const image::Layout& layout)
      : config_(config), layout_(layout) {}

  // Returns entry numbers; empty if there are none. text: the entry's name, "node.index:sub" or,
  // with several, "node.*". An object that is mapped several times yields all of its entries, but
  // not those of SRDOs if a PDO maps it, too.
  std::vector<std::uint32_t> find(const std::string& text, bool several) const;
  // An error message if the text matches several entries where one is expected: "... is ambiguous:
  // ..."; empty otherwise.
  std::string ambiguity(const std::string& text) const;
  // "; did you mean ...?", or why the object is no output: ": the node receives it by SRDO 2 ...";
  // or empty.
  std::string suggestion(const std::string& text) const;

 private:
  std::string srdo_reason(const std::string& text) const;
  std::optional<std::uint8_t> node_id(const std::string& name) const;

  const line::LineConfig& config_;
  const image::Layout& layout_;
};

}  // namespace linegate::config

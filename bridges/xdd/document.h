// SPDX-License-Identifier: Apache-2.0
// An XML file that keeps the position of each element; private to bridges/xdd.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include <pugixml.hpp>

#include "stack/eds/report.h"

namespace linegate::xdd {

// The name without the namespace: "CANopenObject" of "can:CANopenObject".
std::string_view local_name(pugi::xml_node node);

// The first child element of that local name, or an empty node.
pugi::xml_node child(pugi::xml_node node, std::string_view name);
// All child elements of that local name.
std::vector<pugi::xml_node> children(pugi::xml_node node, std::string_view name);

class Document {
 public:
  // text: UTF-8 or Latin-1. If it is not well-formed, that is reported and root() is an empty node.
  Document(std::string_view text, eds::Report& report);

  pugi::xml_node root() const { return document_.document_element(); }

  // The position of the element, or of its attribute of that name.
  eds::Place place(pugi::xml_node node) const;
  eds::Place place(pugi::xml_node node, std::string_view attribute) const;

 private:
  eds::Place place_at(std::size_t offset) const;

  std::string text_;  // UTF-8
  std::vector<std::size_t> line_begins_;
  pugi::xml_document document_;
};

}  // namespace linegate::xdd

// SPDX-License-Identifier: Apache-2.0
// CANopenObject and CANopenSubObject (CiA 311) as sections of CiA 306; private to bridges/xdd.
#pragma once

#include <map>
#include <string>

#include "bridges/xdd/document.h"
#include "bridges/xdd/sections.h"

namespace linegate::xdd {

// Parameters of the application process by uniqueID.
using Parameters = std::map<std::string, pugi::xml_node, std::less<>>;

class ObjectReader {
 public:
  ObjectReader(const Document& document, const Parameters& parameters, Sections& out,
               eds::Report& report)
      : document_(document), parameters_(parameters), out_(out), report_(report) {}

  // Converts the object with all its sub-indices. Returns its index as written in the file
  // ("1018"); empty if it has none, which is reported.
  std::string read(pugi::xml_node object);

 private:
  void read_sub(const std::string& index, pugi::xml_node object);
  void add_value(Sections::Builder& section, pugi::xml_node object);
  void add_parameter(Sections::Builder& section, pugi::xml_node parameter);
  void finish(Sections::Builder& section, pugi::xml_node object);

  const Document& document_;
  const Parameters& parameters_;
  Sections& out_;
  eds::Report& report_;
};

}  // namespace linegate::xdd

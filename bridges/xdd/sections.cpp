// SPDX-License-Identifier: Apache-2.0
#include "bridges/xdd/sections.h"

#include <utility>

namespace linegate::xdd {

Sections::Builder::Builder(Sections& owner, std::string name, eds::Place place) : owner_(owner) {
  section_.name = owner_.keep(std::move(name));
  section_.place = place;
}

void Sections::Builder::add(std::string_view key, const char* value, eds::Place place) {
  if (value != nullptr) {
    add(key, std::string(value), place);
  }
}

void Sections::Builder::add(std::string_view key, std::string value, eds::Place place) {
  if (section_.find(key) == nullptr) {
    append(std::string(key), std::move(value), place);
  }
}

void Sections::Builder::append(std::string key, std::string value, eds::Place place) {
  section_.entries.push_back(
      {owner_.keep(std::move(key)), owner_.keep(std::move(value)), place, place});
}

bool Sections::Builder::finish() {
  return owner_.ini_.add(std::move(section_));
}

}  // namespace linegate::xdd

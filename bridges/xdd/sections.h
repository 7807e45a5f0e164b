// SPDX-License-Identifier: Apache-2.0
// Sections of CiA 306 built from XML; private to bridges/xdd.
#pragma once

#include <deque>
#include <string>
#include <string_view>

#include "stack/eds/ini.h"

namespace linegate::xdd {

class Sections {
 public:
  // Builds one section.
  class Builder {
   public:
    Builder(Sections& owner, std::string name, eds::Place place);

    // Adds an entry. Ignored if the key exists already or value is nullptr.
    void add(std::string_view key, const char* value, eds::Place place);
    void add(std::string_view key, std::string value, eds::Place place);

    // Adds an entry without a check for duplicates.
    void append(std::string key, std::string value, eds::Place place);

    // Returns false if a section of that name exists already.
    bool finish();

   private:
    Sections& owner_;
    eds::Section section_;
  };

  const eds::Ini& ini() const { return ini_; }

 private:
  std::string_view keep(std::string text) { return texts_.emplace_back(std::move(text)); }

  std::deque<std::string> texts_;  // storage of the views in the sections
  eds::Ini ini_;
};

}  // namespace linegate::xdd

// SPDX-License-Identifier: Apache-2.0
// Sections of CiA 306 made of XML; private to bridges/xdd.
#pragma once

#include <deque>
#include <string>
#include <string_view>

#include "stack/eds/ini.h"

namespace linegate::xdd {

class Sections {
 public:
  // One section while it is made.
  class Builder {
   public:
    Builder(Sections& owner, std::string name, eds::Place place);

    // A later entry of the same key does not count; nor does a value that is nullptr.
    void add(std::string_view key, const char* value, eds::Place place);
    void add(std::string_view key, std::string value, eds::Place place);

    // Without looking for a key that is there already.
    void append(std::string key, std::string value, eds::Place place);

    // False if there is a section of that name already.
    bool finish();

   private:
    Sections& owner_;
    eds::Section section_;
  };

  const eds::Ini& ini() const { return ini_; }

 private:
  std::string_view keep(std::string text) { return texts_.emplace_back(std::move(text)); }

  std::deque<std::string> texts_;  // what the sections are views of
  eds::Ini ini_;
};

}  // namespace linegate::xdd

// SPDX-License-Identifier: Apache-2.0
// Names of a plant as identifiers of IDL. README.md has the rule.
#pragma once

#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>

namespace linegate::named {

// The identifier of a name: ASCII letters, digits and single underscores between them, beginning
// with a letter; with an underscore at the end if it would be a reserved word. Empty if the name
// has neither letter nor digit.
std::string identifier_of(std::string_view name);

// Whether the text is the identifier of itself.
bool is_identifier(std::string_view text);

// The identifiers of one scope, such as the members of a struct.
class Identifiers {
 public:
  // Returns the name of the identifier that collides with this one; nothing if there is none, and
  // the identifier is then in the scope. Two identifiers collide if they differ at most in case
  // (IDL 4.2, 7.2.3), or if one is that of the other with "m_" before it (the code of fastddsgen
  // has both).
  std::optional<std::string> add(const std::string& identifier, const std::string& name);

 private:
  std::set<std::pair<std::string, std::string>> known_;  // identifier in lower case, name
};

}  // namespace linegate::named

// SPDX-License-Identifier: Apache-2.0
// A file of DDS profiles as XML, for information that Fast DDS does not report: positions in the
// file, and whether a value was set or is the library's default.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace linegate::dds {

struct XmlProblem {
  std::uint32_t line = 0;  // from 1
  std::uint32_t column = 0;
  std::string text;
};

// The first syntax error of the text; nothing if it is well-formed XML.
std::optional<XmlProblem> xml_problem(std::string_view xml);

// The line of the first start tag <name; 0 if there is none.
std::uint32_t line_of_element(std::string_view xml, std::string_view name);
// The line of the start tag <element with profile_name="profile"; 0 if there is none.
std::uint32_t line_of_profile(std::string_view xml, std::string_view element,
                              std::string_view profile);

struct TransportText {
  std::string id;
  std::uint32_t line = 0;  // of its <transport_descriptor>; 0 if there is none
};

// The userTransports of that participant profile, in the order of
// ParticipantAttributes::userTransports.
std::vector<TransportText> transports_of(std::string_view xml,
                                         std::string_view participant_profile);

// The line where that participant profile sets allocation/remote_locators/max_multicast_locators to
// a number other than 0; 0 if it does not.
std::uint32_t line_of_multicast_locators(std::string_view xml,
                                         std::string_view participant_profile);

}  // namespace linegate::dds

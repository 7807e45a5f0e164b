// SPDX-License-Identifier: Apache-2.0
#include "bridges/dds/profile_text.h"

#include <algorithm>

#include <pugixml.hpp>

namespace linegate::dds {
namespace {

std::uint32_t line_at(std::string_view xml, std::size_t offset) {
  const std::string_view before = xml.substr(0, offset);
  return static_cast<std::uint32_t>(1 + std::count(before.begin(), before.end(), '\n'));
}

// The profiles are children of <profiles>, which is the root or a child of <dds>.
pugi::xml_node profiles_of(const pugi::xml_document& document) {
  const pugi::xml_node dds = document.child("dds");
  return dds ? dds.child("profiles") : document.child("profiles");
}

pugi::xml_node participant_of(const pugi::xml_document& document, std::string_view profile) {
  for (const pugi::xml_node participant : profiles_of(document).children("participant")) {
    if (profile == participant.attribute("profile_name").value())
      return participant;
  }
  return {};
}

}  // namespace

std::optional<XmlProblem> xml_problem(std::string_view xml) {
  pugi::xml_document document;
  const pugi::xml_parse_result result = document.load_buffer(xml.data(), xml.size());
  if (result) {
    return std::nullopt;
  }
  const std::size_t offset = std::min(static_cast<std::size_t>(result.offset), xml.size());
  const std::size_t line_begin = xml.substr(0, offset).rfind('\n') + 1;  // npos + 1 is 0
  return XmlProblem{line_at(xml, offset), static_cast<std::uint32_t>(offset - line_begin + 1),
                    result.description()};
}

std::uint32_t line_of_element(std::string_view xml, std::string_view name) {
  const std::string tag = "<" + std::string(name);
  for (std::size_t at = xml.find(tag); at != std::string_view::npos; at = xml.find(tag, at + 1)) {
    const std::string_view behind = xml.substr(at + tag.size(), 1);
    if (behind.find_first_of(" \t\r\n/>") == 0) {
      return line_at(xml, at);
    }
  }
  return 0;
}

std::uint32_t line_of_profile(std::string_view xml, std::string_view element,
                              std::string_view profile) {
  pugi::xml_document document;
  document.load_buffer(xml.data(), xml.size());
  const std::string name(element);
  for (const pugi::xml_node node : profiles_of(document).children(name.c_str())) {
    if (profile == node.attribute("profile_name").value()) {
      return line_at(xml, static_cast<std::size_t>(node.offset_debug()));
    }
  }
  return 0;
}

std::vector<TransportText> transports_of(std::string_view xml,
                                         std::string_view participant_profile) {
  pugi::xml_document document;
  document.load_buffer(xml.data(), xml.size());
  const pugi::xml_node descriptors = profiles_of(document).child("transport_descriptors");
  const pugi::xml_node participant = participant_of(document, participant_profile);
  std::vector<TransportText> out;
  for (const pugi::xml_node used :
       participant.child("rtps").child("userTransports").children("transport_id")) {
    TransportText& it = out.emplace_back();
    it.id = used.text().get();
    for (const pugi::xml_node descriptor : descriptors.children("transport_descriptor")) {
      if (it.id == descriptor.child("transport_id").text().get())
        it.line = line_at(xml, static_cast<std::size_t>(descriptor.offset_debug()));
    }
  }
  return out;
}

std::uint32_t line_of_multicast_locators(std::string_view xml,
                                         std::string_view participant_profile) {
  pugi::xml_document document;
  document.load_buffer(xml.data(), xml.size());
  const pugi::xml_node allocation =
      participant_of(document, participant_profile).child("rtps").child("allocation");
  for (const pugi::xml_node locators : allocation.children("remote_locators")) {
    for (const pugi::xml_node most : locators.children("max_multicast_locators")) {
      if (most.text().as_uint() != 0)
        return line_at(xml, static_cast<std::size_t>(most.offset_debug()));
    }
  }
  return 0;
}

}  // namespace linegate::dds

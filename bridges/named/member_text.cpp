// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/member_text.h"

#include <string_view>

#include "stack/image/scaling.h"
#include "stack/od/data_type.h"

namespace linegate::named {
namespace {

std::string_view meaning_of(Reading reading) {
  switch (reading) {
    case Reading::time_of_day:
      return ", as time";
    case Reading::duration:
      return ", in nanoseconds";
    case Reading::bits:
    case Reading::signed_bits:
    case Reading::characters:
    case Reading::utf16:
      break;
  }
  return "";
}

// No character that ends or continues the comment.
std::string in_comment(std::string_view text) {
  std::string out;
  for (const char c : text) {
    out += c >= ' ' && c <= '~' && c != '\\' ? c : '?';
  }
  return out;
}

}  // namespace

std::string comment_of(const Member& member) {
  std::string out = od::to_text(member.object) + ' ' + std::string(od::name(member.type));
  if (od::bit_size(member.type) != member.bit_length) {
    out += ", " + std::to_string(member.bit_length) + (member.bit_length == 1 ? " bit" : " bits");
  }
  out += meaning_of(member.reading);
  if (member.pdo != 0) {
    out += ", " + image::pdo_text(member.pdo);
  }
  out += ": " + in_comment(member.object_name);
  const std::string meaning = image::meaning_text(member.scaling, member.low, member.high);
  return meaning.empty() ? out : out + "; " + in_comment(meaning);
}

std::string time_member(std::uint16_t pdo) {
  return image::is_srdo(pdo) ? "srdo" + std::to_string(pdo - image::kFirstSrdo + 1)
                             : "pdo" + std::to_string(pdo);
}

}  // namespace linegate::named

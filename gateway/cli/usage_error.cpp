// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/usage_error.h"

#include <utility>

#include "gateway/tools/json_text.h"

namespace linegate::gateway {

namespace {

void print_problem(std::ostream& out, const char* domain, std::string text) {
  while (text.ends_with('\n')) {
    text.pop_back();
  }
  out << json_text({{"ok", false}, {"domain", domain}, {"text", text}}) << std::endl;
}

}  // namespace

void print_usage_error(std::ostream& out, std::string text) {
  print_problem(out, "usage", std::move(text));
}

void print_failure(std::ostream& out, std::string text) {
  print_problem(out, "console", std::move(text));
}

RecordingStream::int_type RecordingStream::Buffer::overflow(int_type character) {
  if (traits_type::eq_int_type(character, traits_type::eof())) {
    return traits_type::not_eof(character);
  }
  const char one = traits_type::to_char_type(character);
  return xsputn(&one, 1) == 1 ? character : traits_type::eof();
}

std::streamsize RecordingStream::Buffer::xsputn(const char* text, std::streamsize size) {
  if (text_.size() < kMost) {
    text_.append(text, static_cast<std::size_t>(size));
  }
  return to_.sputn(text, size);
}

}  // namespace linegate::gateway

// SPDX-License-Identifier: Apache-2.0
#include "bridges/named/identifiers.h"

#include <algorithm>
#include <array>

namespace linegate::named {
namespace {

// Before an identifier that would begin with a digit.
constexpr char kLetter = 'n';
// Before the private members of the code that fastddsgen generates.
constexpr std::string_view kPrivate = "m_";

// In lower case and sorted: keywords of IDL 4.2 (7.2.4), C11, C++20 and Python 3, macros of their
// libraries, and functions without parameters in the code of fastddsgen. The compilers of IDL do
// not escape all of them: fastddsgen 2.3 generates a member `class` as it is.
constexpr std::array kReserved = std::to_array<std::string_view>({"abstract",
                                                                  "alias",
                                                                  "alignas",
                                                                  "alignof",
                                                                  "and",
                                                                  "and_eq",
                                                                  "any",
                                                                  "as",
                                                                  "asm",
                                                                  "assert",
                                                                  "async",
                                                                  "attribute",
                                                                  "auto",
                                                                  "await",
                                                                  "bitand",
                                                                  "bitfield",
                                                                  "bitmask",
                                                                  "bitor",
                                                                  "bitset",
                                                                  "bool",
                                                                  "boolean",
                                                                  "break",
                                                                  "case",
                                                                  "catch",
                                                                  "char",
                                                                  "char16_t",
                                                                  "char32_t",
                                                                  "char8_t",
                                                                  "class",
                                                                  "co_await",
                                                                  "co_return",
                                                                  "co_yield",
                                                                  "compl",
                                                                  "component",
                                                                  "concept",
                                                                  "connector",
                                                                  "const",
                                                                  "const_cast",
                                                                  "consteval",
                                                                  "constexpr",
                                                                  "constinit",
                                                                  "consumes",
                                                                  "context",
                                                                  "continue",
                                                                  "custom",
                                                                  "decltype",
                                                                  "def",
                                                                  "default",
                                                                  "del",
                                                                  "delete",
                                                                  "do",
                                                                  "double",
                                                                  "dynamic_cast",
                                                                  "elif",
                                                                  "else",
                                                                  "emits",
                                                                  "enum",
                                                                  "eof",
                                                                  "errno",
                                                                  "eventtype",
                                                                  "except",
                                                                  "exception",
                                                                  "explicit",
                                                                  "export",
                                                                  "extern",
                                                                  "factory",
                                                                  "false",
                                                                  "final",
                                                                  "finally",
                                                                  "finder",
                                                                  "fixed",
                                                                  "float",
                                                                  "for",
                                                                  "friend",
                                                                  "from",
                                                                  "getkeymaxcdrserializedsize",
                                                                  "getmaxcdrserializedsize",
                                                                  "getraises",
                                                                  "global",
                                                                  "goto",
                                                                  "home",
                                                                  "if",
                                                                  "import",
                                                                  "in",
                                                                  "inline",
                                                                  "inout",
                                                                  "int",
                                                                  "int16",
                                                                  "int32",
                                                                  "int64",
                                                                  "int8",
                                                                  "interface",
                                                                  "is",
                                                                  "iskeydefined",
                                                                  "lambda",
                                                                  "linux",
                                                                  "local",
                                                                  "long",
                                                                  "manages",
                                                                  "map",
                                                                  "mirrorport",
                                                                  "module",
                                                                  "multiple",
                                                                  "mutable",
                                                                  "namespace",
                                                                  "native",
                                                                  "new",
                                                                  "noexcept",
                                                                  "none",
                                                                  "nonlocal",
                                                                  "not",
                                                                  "not_eq",
                                                                  "null",
                                                                  "nullptr",
                                                                  "object",
                                                                  "octet",
                                                                  "offsetof",
                                                                  "oneway",
                                                                  "operator",
                                                                  "or",
                                                                  "or_eq",
                                                                  "out",
                                                                  "pass",
                                                                  "port",
                                                                  "porttype",
                                                                  "primarykey",
                                                                  "private",
                                                                  "protected",
                                                                  "provides",
                                                                  "public",
                                                                  "publishes",
                                                                  "raise",
                                                                  "raises",
                                                                  "readonly",
                                                                  "register",
                                                                  "reinterpret_cast",
                                                                  "requires",
                                                                  "restrict",
                                                                  "return",
                                                                  "sequence",
                                                                  "setraises",
                                                                  "short",
                                                                  "signed",
                                                                  "sizeof",
                                                                  "static",
                                                                  "static_assert",
                                                                  "static_cast",
                                                                  "stderr",
                                                                  "stdin",
                                                                  "stdout",
                                                                  "string",
                                                                  "struct",
                                                                  "supports",
                                                                  "switch",
                                                                  "template",
                                                                  "this",
                                                                  "thread_local",
                                                                  "throw",
                                                                  "true",
                                                                  "truncatable",
                                                                  "try",
                                                                  "typedef",
                                                                  "typeid",
                                                                  "typename",
                                                                  "typeprefix",
                                                                  "uint16",
                                                                  "uint32",
                                                                  "uint64",
                                                                  "uint8",
                                                                  "union",
                                                                  "unix",
                                                                  "unsigned",
                                                                  "uses",
                                                                  "using",
                                                                  "valuebase",
                                                                  "valuetype",
                                                                  "virtual",
                                                                  "void",
                                                                  "volatile",
                                                                  "wchar",
                                                                  "wchar_t",
                                                                  "while",
                                                                  "with",
                                                                  "wstring",
                                                                  "xor",
                                                                  "xor_eq",
                                                                  "yield"});
static_assert(std::ranges::is_sorted(kReserved));

// Of ASCII alone, whatever the locale is.
bool is_digit(char c) {
  return c >= '0' && c <= '9';
}
bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

std::string lower(std::string_view text) {
  std::string out(text);
  for (char& c : out) {
    c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  }
  return out;
}

}  // namespace

std::string identifier_of(std::string_view name) {
  std::string out;
  bool gap = false;
  for (const char c : name) {
    if (!is_letter(c) && !is_digit(c)) {
      gap = !out.empty();
      continue;
    }
    if (out.empty() && is_digit(c)) {
      out += kLetter;
    }
    if (gap) {
      out += '_';
    }
    gap = false;
    out += c;
  }
  if (std::ranges::binary_search(kReserved, lower(out))) {
    out += '_';
  }
  return out;
}

bool is_identifier(std::string_view text) {
  return !text.empty() && identifier_of(text) == text;
}

std::optional<std::string> Identifiers::add(const std::string& identifier,
                                            const std::string& name) {
  const std::string own = lower(identifier);
  std::string other(kPrivate);
  other += own;
  for (const std::string& text :
       {own, other, own.starts_with(kPrivate) ? own.substr(kPrivate.size()) : own}) {
    const auto known = known_.lower_bound({text, {}});
    if (known != known_.end() && known->first == text) {
      return known->second;
    }
  }
  known_.emplace(own, name);
  return std::nullopt;
}

}  // namespace linegate::named

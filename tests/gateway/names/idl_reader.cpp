// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/names/idl_reader.h"

#include <bit>
#include <cstdint>
#include <sstream>
#include <stdexcept>

#include "tests/gateway/names/meaning.h"

namespace linegate::names {
namespace {

struct Primitive {
  unsigned size = 0;
  bool is_signed = false;
  bool is_real = false;
};

const std::map<std::string, Primitive> kPrimitives{
    {"boolean", {1, false, false}},
    {"octet", {1, false, false}},
    {"int8", {1, true, false}},
    {"short", {2, true, false}},
    {"unsigned short", {2, false, false}},
    {"long", {4, true, false}},
    {"unsigned long", {4, false, false}},
    {"long long", {8, true, false}},
    {"unsigned long long", {8, false, false}},
    {"float", {4, false, true}},
    {"double", {8, false, true}},
};

std::string member_text(const std::string& type, const Primitive& primitive, std::uint64_t value) {
  if (type == "boolean")
    return value == 1 ? "true" : value == 0 ? "false" : "neither true nor false";
  if (primitive.is_real)
    return text_of(primitive.size == 8
                       ? std::bit_cast<double>(value)
                       : double{std::bit_cast<float>(static_cast<std::uint32_t>(value))});
  return meaning(primitive.is_signed ? od::DataType::integer64 : od::DataType::unsigned64,
                 primitive.size * 8, value);
}

std::uint64_t value_of(const Primitive& primitive, const std::string& text) {
  if (text == "true" || text == "false")
    return text == "true" ? 1 : 0;
  if (!primitive.is_real)
    return text.empty()     ? 0
           : text[0] == '-' ? static_cast<std::uint64_t>(std::stoll(text))
                            : std::stoull(text);
  if (text.empty() || text == "nan")
    return text.empty() ? 0 : primitive.size == 8 ? 0x7FF8'0000'0000'0000 : 0x7FC0'0000;
  const auto bits = std::stoull(text, nullptr, 16);
  return primitive.size == 8 ? bits
                             : std::bit_cast<std::uint32_t>(
                                   static_cast<float>(std::bit_cast<double>(std::uint64_t{bits})));
}

}  // namespace

// A place in a sample; grows when it is written.
struct IdlReader::Cursor {
  std::vector<std::uint8_t> octets;
  std::size_t at = 4;  // behind the encapsulation

  void align(unsigned size) {
    while ((at - 4) % size != 0)
      ++at;
  }
  std::uint64_t number(unsigned size) {
    align(size);
    std::uint64_t value = 0;
    for (unsigned i = 0; i < size; ++i, ++at)
      value |= std::uint64_t{octets.at(at)} << 8 * i;
    return value;
  }
  void put(std::uint64_t value, unsigned size) {
    align(size);
    octets.resize(at);
    for (unsigned i = 0; i < size; ++i, ++at)
      octets.push_back(static_cast<std::uint8_t>(value >> 8 * i));
  }
};

IdlReader::IdlReader(const std::string& idl) {
  std::istringstream lines(idl);
  std::vector<Member>* open = nullptr;
  constexpr std::string_view kStruct = "@final struct ";
  constexpr std::string_view kKey = "@key ";
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(kStruct)) {
      open =
          &structs_[line.substr(kStruct.size(), line.find(' ', kStruct.size()) - kStruct.size())];
    } else if (line == "};") {
      open = nullptr;
    } else if (open != nullptr) {
      std::string declared = line.substr(2, line.find(';') - 2);
      if (declared.starts_with(kKey))
        declared.erase(0, kKey.size());
      const std::size_t space = declared.rfind(' ');
      Member member{declared.substr(0, space), declared.substr(space + 1)};
      if (const std::size_t bracket = member.name.find('['); bracket != std::string::npos) {
        member.count = std::stoul(member.name.substr(bracket + 1));
        member.name.erase(bracket);
      }
      open->push_back(member);
    }
  }
}

std::map<std::string, std::string> IdlReader::read(const std::string& type,
                                                   std::span<const std::byte> sample) const {
  Cursor from;
  for (const std::byte octet : sample)
    from.octets.push_back(std::to_integer<std::uint8_t>(octet));
  std::map<std::string, std::string> out;
  try {
    read_struct(type, "", from, out);
  } catch (const std::out_of_range&) {
    return {};
  }
  return from.at == sample.size() ? out : std::map<std::string, std::string>{};
}

void IdlReader::read_struct(const std::string& type, const std::string& path, Cursor& from,
                            std::map<std::string, std::string>& to) const {
  for (const Member& member : structs_.at(type)) {
    const auto primitive = kPrimitives.find(member.type);
    std::string& text = to[path + member.name];
    if (member.type.starts_with("string<")) {
      const std::uint64_t length = from.number(4);
      if (length - 1 > std::stoul(member.type.substr(7)))
        throw std::out_of_range("a text is too long");
      text = "'";
      for (std::uint64_t i = 1; i < length; ++i)
        text += static_cast<char>(from.octets.at(from.at++));
      text += from.octets.at(from.at++) == 0 ? "" : "without an end";
    } else if (member.count != 0) {
      std::vector<std::uint8_t> octets;
      for (std::size_t i = 0; i < member.count; ++i)
        octets.push_back(static_cast<std::uint8_t>(from.number(1)));
      text = hex(octets);
    } else if (primitive != kPrimitives.end()) {
      text = member_text(member.type, primitive->second, from.number(primitive->second.size));
    } else {
      to.erase(path + member.name);
      read_struct(member.type, path + member.name + '.', from, to);
    }
  }
}

std::vector<std::byte> IdlReader::write(const std::string& type,
                                        const std::map<std::string, std::string>& values) const {
  Cursor to;
  to.octets = {0, 1, 0, 0};  // CDR_LE
  write_struct(type, "", values, to);
  std::vector<std::byte> out;
  for (const std::uint8_t octet : to.octets)
    out.push_back(std::byte{octet});
  return out;
}

void IdlReader::write_struct(const std::string& type, const std::string& path,
                             const std::map<std::string, std::string>& from, Cursor& to) const {
  for (const Member& member : structs_.at(type)) {
    const auto primitive = kPrimitives.find(member.type);
    const auto found = from.find(path + member.name);
    const std::string text = found == from.end() ? "" : found->second;
    if (member.type.starts_with("string<")) {
      to.put(text.empty() ? 1 : text.size(), 4);  // with its end, and without the quote
      for (std::size_t i = 1; i < text.size(); ++i)
        to.put(static_cast<std::uint8_t>(text[i]), 1);
      to.put(0, 1);
    } else if (member.count != 0) {
      for (std::size_t i = 0; i < member.count; ++i)
        to.put(text.empty() ? 0 : std::stoul(text.substr(1 + 2 * i, 2), nullptr, 16), 1);
    } else if (primitive != kPrimitives.end()) {
      to.put(value_of(primitive->second, text), primitive->second.size);
    } else {
      write_struct(member.type, path + member.name + '.', from, to);
    }
  }
}

}  // namespace linegate::names

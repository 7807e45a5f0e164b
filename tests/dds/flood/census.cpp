// SPDX-License-Identifier: Apache-2.0
#include "tests/dds/flood/census.h"

namespace linegate::flood {
namespace {

using dds::guard::Reason;

std::string hexadecimal(std::uint32_t value, unsigned digits) {
  std::string out;
  for (unsigned i = digits; i > 0; --i)
    out.push_back("0123456789ABCDEF"[value >> 4 * (i - 1) & 0xFU]);
  return out + "h";
}

std::string kind_name(std::uint32_t kind) {
  return hexadecimal(kind, 2);
}
std::string writer_name(std::uint32_t writer) {
  return writer == 0 ? "applications" : hexadecimal(writer, 8);
}
std::string parameter_name(std::uint32_t id) {
  return hexadecimal(id, 4);
}

// All other kinds, and all other parameters, share one row: a mutation may create any value.
bool is_kind(std::uint8_t kind) {
  return kind <= 0x16 || (kind >= 0x30 && kind <= 0x34) || kind == 0x80;
}
bool is_parameter(std::uint16_t id) {
  return id <= 0x83 || (id >= 0x1001 && id <= 0x1006) || (id >= 0x8000 && id <= 0x8010);
}

}  // namespace

void Census::add(const Bytes& datagram, Reason reason) {
  ++sent_;
  ++reasons_.at(static_cast<std::size_t>(reason));
  const std::uint64_t passed = reason == Reason::none ? 1 : 0;
  const auto count = [&](std::map<std::uint32_t, Count>& counts, std::uint32_t key) {
    Count& it = counts[key];
    ++it.sent;
    it.passed += passed;
  };
  for (const Part& part : split(datagram)) {
    count(kinds_, is_kind(part.kind) ? part.kind : 0xFF);
    if (!part.is_data() || part.body.size() < 20)
      continue;
    const std::uint32_t writer = dds::guard::Wire(part.body, part.little()).entity(8);
    count(writers_, (writer & 0xC0U) == 0xC0U ? writer : 0);
    for (const Place& place : parameters(part))
      count(parameters_, is_parameter(place.id) ? place.id : 0xFFFF);
  }
}

void Census::print(std::string& out, const char* title,
                   const std::map<std::uint32_t, Count>& counts,
                   std::string (*name)(std::uint32_t)) const {
  out += std::string(title) + ", sent/passed:";
  std::uint64_t shown = 0;
  std::uint64_t rare = 0;
  for (const auto& [key, it] : counts) {
    if (it.sent < sent_ / 100'000) {
      ++rare;
      continue;
    }
    out += " " + name(key) + " " + std::to_string(it.sent) + "/" + std::to_string(it.passed);
    shown += it.passed != 0 ? 1U : 0U;
  }
  out += "; " + std::to_string(shown) + " of them passed, " + std::to_string(rare) +
         " rare ones left out\n";
}

std::string Census::text() const {
  std::string out = std::to_string(sent_) + " datagrams, by verdict:";
  for (std::size_t i = 0; i < reasons_.size(); ++i)
    out += " " + std::string(to_string(static_cast<Reason>(i))) + " " + std::to_string(reasons_[i]);
  out += "\n";
  print(out, "submessages", kinds_, kind_name);
  print(out, "writers of DATA", writers_, writer_name);
  print(out, "parameters", parameters_, parameter_name);
  return out;
}

}  // namespace linegate::flood
